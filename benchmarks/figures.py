"""The figures that README and docs state, on one page: each beside its anchor, with where it is from.

    python -m benchmarks.figures             # the page, from the benchmarks' pages and figures.json
    python -m benchmarks.figures --measure   # first measures the recordings in $ARMHIL_DATA again

A figure of a benchmark is read out of its page, out of the table's row and column: it stands there once, and
``tests/test_figures.py`` fails where this page or what quotes it says another one. Those of recorded arms are
measured here, in a minute.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
MEASURED, PAGE = FOLDER / "figures.json", FOLDER / "figures.md"
PACKAGES = ("numpy", "scipy", "numba", "pin", "mujoco-core", "ruckig")


@dataclass(frozen=True)
class Quoted:
    """A figure of a benchmark's page.

    Attributes:
        what: in words.
        page: of this folder, without its ending.
        row: how the row begins that it stands in.
        column: heading of its column; the second column where empty.
        anchor: what it is to be held against.
        again: the command that measures it.
        stated: pages of the clone that state it.
    """

    what: str
    page: str
    row: str
    column: str
    anchor: str
    again: str
    stated: tuple[str, ...] = ()


NAMING = "python -m benchmarks.naming"
ROLLOUTS = "python -m benchmarks.elsewhere SEED"
QUOTED = (
    Quoted("one hidden effect: right name and joint first", "naming", "right name and joint first", "",
           "every arm; seeds nobody had looked at", NAMING, ("README.md",)),
    Quoted("share of the gap left on other motion, median", "naming", "share of the gap that is left", "",
           "none", NAMING, ("README.md",)),
    Quoted("two hidden effects: both named first", "naming", "two hidden: both named first", "",
           "every arm", NAMING, ("README.md",)),
    Quoted("plants of another engine: right name and joint first", "evidence",
           "right name and joint first, of what the vocabulary has", "895 logs",
           "seeds nobody had looked at; asked 92 %",
           "python -m benchmarks.evidence --report benchmarks/evidence.jsonl"),
    Quoted("the same: a wrong name", "evidence", "a wrong name, named", "895 logs", "asked 3 %",
           "python -m benchmarks.evidence --report benchmarks/evidence.jsonl"),
    Quoted("effects as large as `plan --power` predicts: right name first", "power", "1, all 36",
           "right name first", "80 % by the prediction",
           "python -m benchmarks.power --report benchmarks/power.jsonl"),
    Quoted("size of the revised test, one axis, AR(1) 0.9, %", "exogeneity", "**revised**", "AR(1) 0.9",
           "5 by construction; the textbook's 56.6", "python benchmarks/exogeneity.py"),
    Quoted("what printed 95 % intervals cover, near reversals, %", "coverage", "rows near reversals fitted",
           "**as printed**", "95; least squares 86.2", "python benchmarks/interval_coverage.py"),
    Quoted("predicted / obtained %σ, median", "prediction", "**%σ, ar**", "median",
           "1", "python benchmarks/prediction.py --seeds 3 --periods 16"),
    Quoted("motion of 10 s, tr C, TX40, median of 5", "excitation", "**ruckig, median of 5**", "tr C",
           "FIGAROH's log, scaled: 1.10; Fourier 0.1683", "python benchmarks/excitation.py"),
    Quoted("forged frames that passed as a complete row", "forged_frames", "dense, 1000 a second",
           "of these complete", "0", "python benchmarks/forged_frames.py --seed 9100"),
    Quoted("recording lost when the parent is killed, most, s", "killed_streams", "parent", "most lost, s",
           "what one chunk holds", "python benchmarks/killed_streams.py"),
    Quoted("cycles late by more than half a period, 250 Hz, busy machine", "cyclic", "late by more than half",
           "250 Hz", "0", "python benchmarks/cyclic.py --busy"),
    Quoted("processor seconds of a diagnosis, clean, 60 s of six axes", "naming_time", "nothing",
           "processor seconds", "60 s of recording", "python -m benchmarks.naming_time"),
    Quoted("damaged logs that were wrong without a warning, of 300", "damaged_logs", "wrong without",
           "", "0", "python benchmarks/damaged_logs.py --data DATA"),
    Quoted("rollout in MuJoCo, 0.1 s, seed 101", "elsewhere", "101, scored once", "0.1 s",
           "0; the description's 110 mrad", ROLLOUTS, ("docs/how-to/elsewhere.md",)),
    Quoted("rollout in MuJoCo, 2 s, seed 101", "elsewhere", "101, scored once", "2 s",
           "0; the description's 2804 mrad", ROLLOUTS, ("docs/how-to/elsewhere.md",)),
)  # fmt: skip


def cells_of(text: str) -> Iterator[tuple[list[str], list[str]]]:
    """Each row of each table of a page, with the headings of its columns."""
    headings: list[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            headings = []
        elif not headings:
            headings = cells
        elif not set("".join(cells)) <= set("-: "):
            yield headings, cells


def read(figure: Quoted, folder: Path = FOLDER) -> str:
    """The figure as its page has it now, without bold.

    Raises:
        ValueError: the page has no such row and column.
    """
    path = folder / f"{figure.page}.md"
    for headings, cells in cells_of(path.read_text(encoding="utf-8")):
        if cells[0].startswith(figure.row) and (not figure.column or figure.column in headings):
            place = headings.index(figure.column) if figure.column else 1
            return cells[place].replace("**", "")
    raise ValueError(f"{path}: no row {figure.row!r} with {figure.column or 'a second column'!r}")


def measured() -> dict[str, Any]:
    """Figures of recorded arms, with machine and versions; a minute on one core."""
    import robots
    from daq.importing.load import load_recording
    from ident import identify

    data = Path(os.environ["ARMHIL_DATA"])
    emps, tx40 = robots.load("emps"), robots.load("tx40")
    rig = load_recording(data / "emps" / "DATA_EMPS.mat", emps)
    own = identify(emps, rig.recordings).result
    arm = load_recording(data / "tx40", tx40)
    errors = []
    for change in ({"cutoff_hz": 100.0, "decimation": 10}, {}):
        settings = arm.settings.model_copy(update=change)
        fitted = identify(tx40.model_copy(update={"identification": settings}), arm.recordings).result
        errors.append(f"{fitted.least_squares.relative_error_percent:.2f}")

    def digits(estimate: Any, places: int) -> str:
        values = (f"{parameter.value:.{places}f}" for parameter in estimate.parameters)
        return ", ".join(values).replace("-", "−")

    rows = [
        ["EMPS: M, Fv, Fc, offset, least squares", digits(own.least_squares, 4), EMPS_PUBLISHED],
        ["EMPS: the same by instrumental variables", digits(own.instrumental, 3), EMPS_IV],
        [
            "EMPS: relative torque error, %",
            f"{own.least_squares.relative_error_percent:.4f}",
            "4.0834, Janot",
        ],
        ["TX40: relative torque error, 100 Hz filter, 500 Hz rows, %", errors[0], FIGAROH],
        ["TX40: the same, 50 Hz filter, 100 Hz rows, %", errors[1], "–"],
    ]
    return {"machine": machine(), "versions": {name: version(name) for name in PACKAGES}, "figures": rows}


EMPS_PUBLISHED = "95.1089, 203.5034, 20.3935, −3.1648; Janot and others 2019"
EMPS_IV = "95.18, 203.30, 20.41, −3.165; Janot and others 2019"
FIGAROH = "15.4, FIGAROH 1.0.2 on the same log"


def machine() -> str:
    """Processor, cores, system and Python in words."""
    names = [
        line.partition(":")[2].strip()
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        if line.startswith("model name")
    ]
    return (
        f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores, {platform.system()}"
        f" {platform.machine()}, Python {platform.python_version()}"
    )


def page(found: dict[str, Any]) -> str:
    """The page as text."""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    lines = [
        "# Figures and their anchors",
        "",
        "Made by `python -m benchmarks.figures`; a figure that README and docs state of a benchmark is here",
        "or on the page that it links to. Tables there say seeds, dates and what was looked at before.",
        "",
        "## Recorded arms",
        "",
        f"Measured by `python -m benchmarks.figures --measure` on {found['machine']};",
        f"{versions}. [Where the data are from](published.md).",
        "",
        "| figure | armhil | anchor |",
        "|---|---|---|",
        *(f"| {what} | {value} | {anchor} |" for what, value, anchor in found["figures"]),
        "",
        "## Benchmarks",
        "",
        "| figure | armhil | anchor | page | again by |",
        "|---|---|---|---|---|",
    ]
    for one in QUOTED:
        link = f"[{one.page}]({one.page}.md)"
        lines.append(f"| {one.what} | {read(one)} | {one.anchor} | {link} | `{one.again}` |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--measure", action="store_true", help="recordings in $ARMHIL_DATA")
    if parser.parse_args().measure:
        text = json.dumps(measured(), indent=1, ensure_ascii=False)
        MEASURED.write_text(text + "\n", encoding="utf-8")
    PAGE.write_text(page(json.loads(MEASURED.read_text(encoding="utf-8"))), encoding="utf-8")


if __name__ == "__main__":
    main()
