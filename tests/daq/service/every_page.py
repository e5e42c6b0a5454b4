"""Every page that armhil writes into a file, made once: reports, checks, diagnosis, plans, protocol.

    python -m tests.daq.service.every_page FOLDER

writes them there with a picture of each, on a desk and on a phone, light and dark, and ``check.png``, the one
in docs/images.
"""

from __future__ import annotations

import base64
import json
import os
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity
from daq.check.judged import comparison_json
from daq.cli import entry
from daq.files.checksum import file_sha256
from daq.protocol.content import protocol_of
from daq.protocol.writing import write_protocol
from daq.report.check_view import check_view
from daq.report.page import ReportContent, write_report
from daq.session.motions import read_trajectory
from daq.session.stages import STAGES, StageName, fingerprint
from drivers.simulated import draw_truth
from drivers.simulated.scenario import Scenario
from ident.drift import compare, patterns_of
from tests.daq.diagnosis.offline_bench import OfflineBench
from tests.daq.report.contents import content
from tests.daq.service.browser import Browser, browsing, chromium
from tests.daq.session.commissioned import real_identity
from tests.ident.drift.arms_of_nights import draw_nights, geometry
from trajectories import plan

WIDTHS = (1280, 390)
"""px: a desk and a phone."""
SCHEMES = ("light", "dark")
_CELL = """format = 1
floor = -0.32
[[obstacle]]
name = "control cabinet"
centre = [0.0, 0.9, 0.3]
size = [0.6, 0.4, 1.2]
"""
_FOUND: dict[str, str] = {
    "plan": "40 of 45 parameters well seen; nothing comes closer than 29 mm",
    "check": "drives agree with the description; all is well",
    "first move": "all six joints moved 0.02 rad as they were told",
    "approach": "at the start of the motion",
    "return": "at rest at home",
}
"""What stages that drive no motion say."""
_SEARCH = ("--evaluations", "60", "--searches", "1", "--workers", "1", "--duration", "4")


def write_pages(folder: Path) -> tuple[Path, ...]:
    """The pages, in a folder."""
    write_report(folder / "check.html", failed_check())
    return (
        folder / "check.html",
        *planned(folder),
        *protocols(folder),
        *of_a_recording(folder),
    )


def failed_check() -> ReportContent:
    """Coulomb friction of joint 2 + 30 % since four nights of forty-four."""
    made = geometry(friction=12.0)
    pattern = next(p for p in patterns_of(made) if (p.effect, p.joint) == ("coulomb_friction", 2))
    assert pattern.scale is not None
    change = 0.3 * pattern.scale * pattern.directions[:, 0]
    nights = draw_nights(made, 45, 1, change=change, first=41)
    nights[41:44] = [replace(night, clean=False) for night in nights[41:44]]
    details = {"comparison": json.loads(json.dumps(comparison_json(compare(nights[0], nights[1:], made))))}
    details |= {"celsius": [18.5], "settings": {"tolerance": 0.05}}
    baseline, tonight = ("run 3", "accepted 2026-10-01 by Ada"), ("run 47", "2026-11-22 02:31 UTC")
    sentence = str(details["comparison"]["sentence"])
    view = check_view("failed", sentence, details, baseline, tonight)
    return replace(content("exogenous"), title="tx40-12: check", check=view)


def protocols(folder: Path) -> tuple[Path, ...]:
    """Of an arm that has passed every stage with figures of its full run, and of one that is half-way."""
    arm, motion = robots.load("tx40"), folder / "planned" / "tx40.trajectory.json"
    identity, capture = real_identity(arm, 3), folder / "full-run.mcap"
    OfflineBench(arm, draw_truth(arm, 3)).stream(read_trajectory(motion, arm), capture)
    made = []
    for name, until in (("protocol", "return"), ("protocol-open", "slow run")):
        os.environ["ARMHIL_CATALOGUE"] = str(folder / f"{name}.db")
        with Catalogue() as catalogue:
            for stage in STAGES[: STAGES.index(until) + 1]:
                _pass(catalogue, identity, stage, capture if stage == "full run" else None)
            found = protocol_of(catalogue, "tx40", "tx40")
        made.append(folder / f"{name}.html")
        for file in (made[-1], made[-1].with_suffix(".pdf")):
            write_protocol(file, found)
    return tuple(made)


def _pass(catalogue: Catalogue, identity: ArmIdentity, stage: StageName, capture: Path | None) -> None:
    """A stage as commissioning keeps it."""
    facts: dict[str, object] = {**fingerprint(identity, "5b" * 32, "c4" * 32), "channel": "socketcan can0"}
    if stage in _FOUND:
        facts["found"] = _FOUND[stage]
    else:
        facts |= {"cycles": 1001, "missed_cycles": 2 if capture else 0}
    begun = runs.begin(
        catalogue,
        identity,
        "commission",
        stage=stage,
        trajectory="ruckig, seed 0, 4.0 s",
        facts=facts,
        note="cold hall",
    )
    path, sha256 = (str(capture), file_sha256(capture)) if capture else (None, None)
    runs.finish(catalogue, begun.id, "completed", capture=path, capture_sha256=sha256)


def planned(folder: Path) -> tuple[Path, ...]:
    """A motion of six axes in a cell, and one that is refused."""
    (folder / "cell.toml").write_text(_CELL, encoding="utf-8")
    good, bad = folder / "planned", folder / "refused"
    armhil("plan", "tx40", *_SEARCH, "--cell", folder / "cell.toml", "--out", good)
    check = ("--check", good / "tx40.trajectory.json", "--tool-speed", "0.01")
    armhil("plan", "tx40", *check, "--cell", folder / "cell.toml", "--out", bad)
    return good / "plan.html", bad / "plan.html"


def of_a_recording(folder: Path) -> tuple[Path, ...]:
    """Identification and diagnosis of an axis that slides."""
    arm = robots.load("emps")
    motion = plan(arm, cycle_time=arm.bus.cycle_time, duration=5.0, seed=0, evaluations=60, periods=2)
    capture = folder / "run.mcap"
    OfflineBench(arm, draw_truth(arm, 1), Scenario.from_dict({"format": 1})).stream(motion, capture)
    armhil("identify", capture, "--out", folder / "identified")
    armhil("diagnose", capture, "--split-half", "--without", "coulomb_friction", "--out", folder / "why")
    return folder / "identified" / "report.html", folder / "why" / "diagnosis.html"


def armhil(*arguments: object) -> None:
    """The command in this process; what it says is shown where it leaves no page."""
    said, before = StringIO(), sys.argv
    sys.argv = ["armhil", *map(str, arguments)]
    out = Path(str(arguments[-1]))
    try:
        with redirect_stdout(said), redirect_stderr(said):
            entry.main()
    except SystemExit:
        pass  # a refused motion ends with 2, and has a page too
    finally:
        sys.argv = before
    assert out.is_dir(), said.getvalue()


def name_of(page: Path, folder: Path) -> str:
    """Of its pictures."""
    return "-".join(page.relative_to(folder).with_suffix("").parts)


def main() -> None:
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    pages = write_pages(folder)
    program = chromium()
    assert program is not None, "pictures need Chromium"
    with browsing(program, folder / "profile", "") as browser:
        for page in pages:
            pictures(browser, page.as_uri(), folder, name_of(page, folder))
        top_of_check(browser, folder / "check.html", folder / "check.png")


def pictures(browser: Browser, address: str, folder: Path, name: str) -> None:
    """Of one page, in both widths and both colours."""
    browser.open(address)
    for width in WIDTHS:
        for scheme in SCHEMES:
            browser.resize(width, 844)
            browser.colours(scheme)
            browser.picture(folder / f"{name}-{width}-{scheme}.png")


def top_of_check(browser: Browser, page: Path, picture: Path) -> None:
    """The page of a check down to what the verdict rests on, for the documentation."""
    browser.resize(1180, 900)
    browser.colours("light")
    browser.open(page.as_uri())
    height = browser.evaluate("document.querySelector('#rests').getBoundingClientRect().top") - 24
    clip = {"x": 0, "y": 0, "width": 1180, "height": height, "scale": 1}
    found = browser.call("Page.captureScreenshot", format="png", clip=clip)
    picture.write_bytes(base64.b64decode(found["data"]))


if __name__ == "__main__":
    main()
