"""Six drives on an independent CANopen stack (the crate zencan-node) under our master, on a CAN device.

The slave in ``foreign_slave/`` is built here; it has units of its own, a heartbeat time that cannot be
written, and RPDOs that do not wait for the SYNC.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.drivers.test_vcan import HOW_TO_GET_ONE, ROOT, TOOL, own_device
from tests.shared_folder import shared_folder

SOURCE = Path(__file__).parent / "foreign_slave"
PROGRAM = Path(__file__).parent / "foreign_drives.py"
COMMISSIONING = Path(__file__).parent / "foreign_commissioning.py"
TO_BUILD, TO_RUN, TO_COMMISSION = 420, 240, 600
"""s; the build takes 20 on two idle processors, commissioning two minutes, in virtual time."""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(TO_BUILD + TO_COMMISSION + 60)]


def cargo(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The build tool of Rust in a folder; nobody debugs what it builds, and nothing is built twice."""
    return subprocess.run(
        ["cargo", *words],
        cwd=folder,
        env={**os.environ, "CARGO_PROFILE_DEV_DEBUG": "0", "CARGO_INCREMENTAL": "0"},
        capture_output=True,
        text=True,
        timeout=TO_BUILD,
        check=False,
    )


@pytest.fixture(scope="module")
def bus() -> tuple[str, bool]:
    """A CAN device, and whether a kernel of its own has to be started for it."""
    device = own_device()
    if device is not None:
        return device, False
    if not TOOL.is_file() or os.geteuid() != 0:
        pytest.skip(HOW_TO_GET_ONE)
    return "vcan0", True


@pytest.fixture(scope="module")
def slave(bus: tuple[str, bool], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program of one drive, built only where there is a bus for it."""
    if shutil.which("cargo") is None:
        pytest.skip("no cargo: the foreign slave is written in Rust")
    folder = shared_folder(tmp_path_factory, "foreign_slave", build)
    return folder / "slave" / "target" / "debug" / "foreign_slave"


def build(folder: Path) -> None:
    """The program from its source, in a folder of its own; skipped where its crates cannot be had."""
    source = folder / "slave"
    shutil.copytree(SOURCE, source, ignore=shutil.ignore_patterns("target", "Cargo.lock"))
    fetched = cargo(source, "fetch")
    if fetched.returncode:
        pytest.skip(
            f"the crates of the foreign slave cannot be had: {fetched.stderr.strip().splitlines()[-1]}"
        )
    built = cargo(source, "build", "--offline")
    assert built.returncode == 0, built.stderr


def under_the_master(
    program: Path, seconds: int, bus: tuple[str, bool], slave: Path, *words: str, virtual: bool
) -> dict[str, Any]:
    """What a program of the master says of six slaves on a CAN device of this machine or of another kernel.

    Args:
        program: which.
        seconds: it may take.
        bus: the CAN device, and whether it is another kernel's.
        slave: of one drive.
        words: for the program, after device and slave.
        virtual: whether time may be virtual, where the kernel is another one.
    """
    device, elsewhere = bus
    options = ["-v"] if virtual else []
    before = [str(TOOL), *options, "-t", str(seconds), "--"] if elsewhere else []
    done = subprocess.run(
        [*before, sys.executable, str(program), device, str(slave), *words],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    answer: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return answer


@pytest.fixture(scope="module")
def told(bus: tuple[str, bool], slave: Path) -> dict[str, Any]:
    """What the master says of drives without an arm."""
    return under_the_master(PROGRAM, TO_RUN, bus, slave, virtual=False)


@pytest.fixture(scope="module")
def commissioned(
    bus: tuple[str, bool], slave: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """What the commands say of drives with an arm behind them."""
    folder = tmp_path_factory.mktemp("commissioned")
    return under_the_master(COMMISSIONING, TO_COMMISSION, bus, slave, str(folder), virtual=True)


def test_a_scan_finds_them_and_a_wrong_description_is_refused(told: dict[str, Any]) -> None:
    assert told["doctor"] == "ok"
    assert [drive["node"] for drive in told["found"]] == [1, 2, 3, 4, 5, 6]
    assert {drive["units"] for drive in told["found"]} == {"608F 4096/1, 6091 100/1, 6092 360000/1"}
    assert all(drive["watches"] and drive["modes"] == ["csp"] for drive in told["found"])
    assert "6092: the drive counts 360000 per turn of the output" in told["wrong"]
    assert "write counts_per_output_turn = 360000" in told["wrong"]
    assert any("1017: cannot be written: its own 50 ms" in finding for finding in told["findings"])


def test_each_joint_moves_what_was_asked(told: dict[str, Any]) -> None:
    for joint, (outcome, reason, moved) in enumerate(told["jogs"]):
        assert outcome == "completed", reason
        assert moved == pytest.approx([2.0 if k == joint else 0.0 for k in range(6)], abs=0.01)


def test_a_run_is_whole_and_a_killed_drive_ends_the_next(told: dict[str, Any]) -> None:
    run, killed = told["run"], told["killed"]
    assert (run["outcome"], run["cycles"]) == ("completed", 500), run
    assert run["largest_error"] < 0.005
    assert (
        killed["outcome"] == "aborted" and "no TPDO from drive of joint joint_4 (node 4)" in killed["reason"]
    )
    assert "NOT KNOWN to be at rest" in killed["ending"] and "joint_4 (node 4)" in killed["ending"]


def test_an_arm_of_foreign_drives_is_commissioned(commissioned: dict[str, Any]) -> None:
    """Units, direction and gravity of each joint differ; the arm is the slaves' own."""
    bus = {check["name"]: check["status"] for check in commissioned["doctor"]["json"]["checks"]}
    assert bus["bus"] == bus["bus load"] == "ok"
    assert commissioned["locked"]["code"] == 2
    assert "has not been commissioned" in commissioned["locked"]["told"][-1]
    assert commissioned["home"]["json"]["posture"] == pytest.approx([0, 0, 1.5707, 0, 0.5, 0], abs=2e-5)
    done = commissioned["commission"]
    assert done["code"] == 0, done["told"]
    stages = [stage["stage"] for stage in done["json"]["done"]]
    assert stages == [
        "plan",
        "check",
        "first move",
        "approach",
        "warm-up",
        "slow run",
        "full run",
        "return",
    ]


def test_it_is_driven_and_a_killed_drive_ends_the_run(commissioned: dict[str, Any]) -> None:
    run, killed, after = (commissioned[name] for name in ("run", "killed", "after"))
    assert run["code"] == 0, run["told"]
    assert (run["json"]["outcome"], run["json"]["incomplete_cycles"]) == ("completed", 0)
    assert killed["code"] == 2
    assert "no TPDO from drive of joint joint_4 (node 4)" in killed["told"][-1]
    assert "NOT KNOWN to be at rest and without torque: drive of joint joint_4" in killed["told"][-1]
    assert after["code"] == 2 and "(node 4): reading 6041:00: no answer" in after["told"][-1]


def test_a_load_that_nobody_described_is_felt_at_rest(commissioned: dict[str, Any]) -> None:
    """20 kg at the tool, under the same description: nothing has moved yet."""
    done = commissioned["loaded"]
    assert done["code"] == 2
    assert re.search(r"stage first move: joint_[23]: at rest it holds .*described gravity", done["told"][-1])
