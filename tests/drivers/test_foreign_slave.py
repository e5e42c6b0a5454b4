"""Six drives on an independent CANopen stack (the crate zencan-node) under our master, on a CAN device.

The slave in ``foreign_slave/`` is built here; it has units of its own, a heartbeat time that cannot be
written, and RPDOs that do not wait for the SYNC.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.drivers.test_vcan import HOW_TO_GET_ONE, ROOT, TOOL, own_device

SOURCE = Path(__file__).parent / "foreign_slave"
PROGRAM = Path(__file__).parent / "foreign_drives.py"
TO_BUILD, TO_RUN = 420, 240
"""s; the build takes one minute on two idle processors."""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(TO_BUILD + TO_RUN + 60)]


def cargo(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The build tool of Rust in a folder."""
    return subprocess.run(
        ["cargo", *words], cwd=folder, capture_output=True, text=True, timeout=TO_BUILD, check=False
    )


@pytest.fixture(scope="module")
def slave(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program of one drive."""
    if shutil.which("cargo") is None:
        pytest.skip("no cargo: the foreign slave is written in Rust")
    folder = tmp_path_factory.mktemp("foreign") / "slave"
    shutil.copytree(SOURCE, folder, ignore=shutil.ignore_patterns("target", "Cargo.lock"))
    fetched = cargo(folder, "fetch")
    if fetched.returncode:
        pytest.skip(
            f"the crates of the foreign slave cannot be had: {fetched.stderr.strip().splitlines()[-1]}"
        )
    built = cargo(folder, "build", "--release", "--offline")
    assert built.returncode == 0, built.stderr
    return folder / "target" / "release" / "foreign_slave"


@pytest.fixture(scope="module")
def told(slave: Path) -> dict[str, Any]:
    """What the program of the master says of all six."""
    device, before = own_device(), list[str]()
    if device is None and TOOL.is_file() and os.geteuid() == 0:
        device, before = "vcan0", [str(TOOL), "-t", str(TO_RUN), "--"]
    if device is None:
        pytest.skip(HOW_TO_GET_ONE)
    done = subprocess.run(
        [*before, sys.executable, str(PROGRAM), device, str(slave)],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=TO_RUN,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    answer: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return answer


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
