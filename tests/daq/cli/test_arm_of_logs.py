"""An arm that is known from logs alone: what reads logs works, what drives says in a line what is missing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import robots
from drivers import Channel
from robots.fields import MissingFromDescription
from tests.daq.calls import Call

URDF = Path(__file__).parents[3] / "robots" / "emps" / "emps.urdf"
STIFF, DAMPED, MASS, VISCOUS, DRY, PERIOD = 20_000.0, 2_000.0, 95.0, 200.0, 20.0, 0.002
CONTROLLER = """
[controller]
type = "pd"
sample_time = 0.001
position_gain = [20000.0]
velocity_gain = [2000.0]
integral_gain = [0]
velocity_feed_forward = [0]
saturation = [351.0]
"""


class Kept(NamedTuple):
    """Folders of the arm as it was saved, and with a controller, and a log of it."""

    arm: Path
    controlled: Path
    log: Path


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Kept:
    """A sliding axis behind a spring and a damper to its set-points, 12 s at 500 Hz."""
    from daq.importing.guess_log import guess_log
    from daq.importing.guess_torque import LogHints

    folder = tmp_path_factory.mktemp("kept")
    noise = np.random.default_rng(11)
    t = PERIOD * np.arange(6000)
    q = 0.1 + 0.05 * np.sin(2.0 * t) + 0.02 * np.sin(7.0 * t + 1.0)
    v = 0.1 * np.cos(2.0 * t) + 0.14 * np.cos(7.0 * t + 1.0)
    a = -0.2 * np.sin(2.0 * t) - 0.98 * np.sin(7.0 * t + 1.0)
    force = MASS * a + VISCOUS * v + DRY * np.sign(v) + 0.2 * noise.standard_normal(t.size)
    target = q + (force + DAMPED * v) / STIFF
    table = np.column_stack([t, target, q + 1e-7 * noise.standard_normal(t.size), force])
    log = folder / "log.csv"
    np.savetxt(log, table, delimiter=",", header="t,q_ref1,q1,tau1", comments="")
    for name in ("arm", "controlled"):
        (folder / name).mkdir()
        guess_log(log, URDF, folder / name, LogHints())
    with (folder / "controlled" / "robot.toml").open("a", encoding="utf-8") as file:
        file.write(CONTROLLER)
    return Kept(folder / "arm", folder / "controlled", log)


def test_what_a_log_needs_is_all_that_was_written(kept: Kept) -> None:
    text = (kept.arm / "robot.toml").read_text(encoding="utf-8")
    for key in ("[[drive]]", "[bus]", "[controller]", "node_id", "encoder_counts", "home"):
        assert key not in text


READING = {
    "identify": "identify {log} --robot {arm} --no-catalogue --quiet",
    "controller": "controller {log} --robot {controlled} --quiet",
    "import": "import {log} --robot {arm} --out {new}/log.capture.mcap",
    "diagnose": "diagnose {log} --robot {arm} --split-half --no-catalogue --quiet",
}


@pytest.mark.parametrize(
    "command", [pytest.param(c, marks=[pytest.mark.slow] if c == "diagnose" else []) for c in READING]
)
def test_what_reads_logs_needs_no_drives(armhil: Call, kept: Kept, tmp_path: Path, command: str) -> None:
    words = READING[command].format(**kept._asdict(), new=tmp_path).split()
    code, out, err = armhil(*words)
    # 1 says of an answer that it must not be trusted, 3 of a diagnosis that it confirms nothing.
    assert code in ((0, 1, 3) if command == "diagnose" else (0, 1)), err
    assert out
    assert "robot.toml" not in err


def test_a_controller_alone_serves_the_simulated_loop(armhil: Call, kept: Kept) -> None:
    said = {}
    for arm in (kept.arm, kept.controlled):
        _, out, _ = armhil("identify", kept.log, "--robot", arm, "--no-catalogue", "--quiet", "--json")
        said[arm.name] = json.loads(out)
    assert said["arm"]["test"]["verdict"] == "not_testable"
    assert said["controlled"]["test"]["verdict"] != "not_testable"
    assert said["controlled"]["estimates"]["iv"] is not None


DRIVING = {
    "demo": "demo --robot {arm} --out {new}/out",
    "run": "run {arm} {log} --out {new}/out",
    "commission": "commission {arm} --out {new}/out",
    "home": "home {arm}",
    "jog": "jog {arm} --joint carriage --by 0.01",
    "acknowledge": "acknowledge {arm}",
    "check": "check {arm} --out {new}/out",
    "check simulated": "check {arm} --simulated --out {new}/out",
    "diagnose live": "diagnose --live {arm} --out {new}/out",
    "doctor": "doctor {arm}",
    "sim": "sim {arm}",
}
LONGEST = 160
"""Two lines of a terminal, without the path and the command whose help goes on."""


@pytest.mark.parametrize("command", DRIVING)
def test_what_drives_says_what_is_missing_before_anything_begins(
    armhil: Call, kept: Kept, tmp_path: Path, command: str
) -> None:
    words = DRIVING[command].format(**kept._asdict(), new=tmp_path).split()
    code, out, err = armhil(*words)
    assert (code, out) == (2, "")
    said = " ".join(err.split())
    expected = "emps: its robot.toml has no [[drive]] and no [controller]: driving an arm, or simulating its"
    assert said.startswith(f"armhil: {expected} drives, needs that")
    assert len(said.rpartition("; see `")[0]) <= LONGEST
    assert not (tmp_path / "out").exists()


def test_a_controller_alone_drives_nothing(kept: Kept) -> None:
    with pytest.raises(MissingFromDescription, match=r"has no \[\[drive\]\]: driving an arm"):
        Channel.of(robots.load(kept.controlled))


def test_the_law_of_a_controller_is_not_found_without_its_clock(armhil: Call, kept: Kept) -> None:
    code, _, err = armhil("controller", kept.log, "--robot", kept.arm, "--quiet")
    assert code == 2
    assert "has no [controller]: identifying the law (its sample_time and saturation) needs that" in err


def test_a_plan_needs_the_controller_alone(armhil: Call, kept: Kept, tmp_path: Path) -> None:
    few = ("--duration", "3", "--evaluations", "100", "--searches", "1", "--workers", "1", "--quiet")
    code, _, err = armhil("plan", kept.arm, *few, "--out", tmp_path / "none")
    assert code == 2
    assert "has no [controller]: planning (its saturation limits the torque) needs that" in err
    assert not (tmp_path / "none").exists()
    code, _, err = armhil("plan", kept.controlled, *few, "--out", tmp_path / "plan")
    assert code == 0, err


def test_an_arm_of_a_fleet_without_drives_is_refused_alone(kept: Kept, tmp_path: Path) -> None:
    from daq.check.fleet import FleetArm

    with pytest.raises(MissingFromDescription, match=r"robot\.toml has no"):
        FleetArm(robot=str(kept.arm), simulated=True).order()
