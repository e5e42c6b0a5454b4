"""The search on logs that are not of the simulated bench, scored.

Recorded logs are those of the shared data (``ARMHIL_DATA``): a foreign plant, EMPS, TX40, KR300. Drawn ones
come of :mod:`benchmarks.foreign_plant`, or of the own simulated arm (``--plant own``), by seed. Each answer
is one line of JSON, so that a campaign can be stopped and gone on with. A line says which search answered;
a report has a column for each (files of before acd2f99c hold the search by rules, too).

    python -m benchmarks.evidence --recorded --out recorded.jsonl
    python -m benchmarks.evidence --first 40000 --seeds 20 --out drawn.jsonl
    python -m benchmarks.evidence --plant own --first 1060000 --seeds 20 --out drawn.jsonl
    python -m benchmarks.evidence --report drawn.jsonl --picture reliability.svg
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.evidence.asked import asked
from benchmarks.evidence.case import Case
from benchmarks.evidence.drawn import drawn
from benchmarks.evidence.own import own
from benchmarks.evidence.recorded import recorded
from benchmarks.evidence.reliability import picture
from benchmarks.evidence.scores import SEARCH, report


def main() -> None:
    """Run what is asked for, or report what was run."""
    given = _arguments().parse_args()
    if given.report is None:
        given.keep.mkdir(parents=True, exist_ok=True)
        ended = time.monotonic() + given.seconds
        for name, case in _cases(given).items():
            if time.monotonic() < ended and name not in _done(given.out):
                _ask(given.out, name, case())
    lines = _lines(given.report or given.out)
    print(report(lines))
    if given.picture:
        given.picture.write_text(picture(lines), encoding="utf-8")


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--recorded", action="store_true", help="the logs of the shared data")
    parser.add_argument("--only", nargs="*", help="these names of them")
    parser.add_argument("--first", type=int, default=40000, help="first seed that is drawn")
    parser.add_argument("--seeds", type=int, default=0)
    parser.add_argument("--plant", choices=("foreign", "own"), default="foreign", help="which draws them")
    parser.add_argument("--keep", type=Path, default=Path("evidence-data"), help="folder for drawn logs")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="nothing is begun after so many")
    parser.add_argument("--out", type=Path, default=Path("evidence.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these answers")
    parser.add_argument("--picture", type=Path, help="write the reliability diagram")
    return parser


def _cases(given: argparse.Namespace) -> dict[str, Callable[[], Case]]:
    cases: dict[str, Callable[[], Case]] = {}
    if given.recorded:
        cases = recorded(Path(os.environ["ARMHIL_DATA"]), given.keep)
    if given.only:
        cases = {name: cases[name] for name in given.only}
    seeds = range(given.first, given.first + given.seeds)
    if given.plant == "own":
        return {**cases, **{f"own {seed}": partial(own, seed) for seed in seeds}}
    return {**cases, **{f"seed {seed}": partial(drawn, seed, given.keep) for seed in seeds}}


def _ask(out: Path, name: str, case: Case) -> None:
    line = {
        "name": name,
        "kind": case.kind,
        "truth": case.truth,
        "search": SEARCH,
        "answer": asked(case),
    }
    with out.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def _done(path: Path) -> set[str]:
    return {line["name"] for line in _lines(path) if SEARCH in line["answers"]}


def _lines(path: Path) -> Sequence[dict[str, Any]]:
    """One entry per log, with the answers of each search."""
    found: dict[str, dict[str, Any]] = {}
    for text in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        line = json.loads(text)
        entry = {**{key: line[key] for key in ("name", "kind", "truth")}, "answers": {}}
        entry = found.setdefault(line["name"], entry)
        entry["answers"][line["search"]] = line["answer"]
    return list(found.values())


if __name__ == "__main__":
    main()
