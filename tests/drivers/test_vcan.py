"""The stream over a real SocketCAN device: an own one, or one inside a user-mode kernel."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT.parent / "shared" / "tools" / "vcan" / "vcan-run"
PROGRAM = Path(__file__).parent / "vcan_stream.py"
HOW_TO_GET_ONE = (
    "no vcan here: sudo ip link add vcan0 type vcan && sudo ip link set vcan0 up, or set ARMHIL_VCAN, "
    "or have ../shared/tools/vcan/vcan-run"
)


def own_device() -> str | None:
    """A virtual CAN device of this machine that is up."""
    if name := os.environ.get("ARMHIL_VCAN"):
        return name
    for device in sorted(Path("/sys/class/net").glob("vcan*")):
        if int((device / "flags").read_text(), 16) & 1:
            return device.name
    return None


needs_device = pytest.mark.skipif(own_device() is None, reason=HOW_TO_GET_ONE)
needs_tool = pytest.mark.skipif(
    not TOOL.is_file() or os.geteuid() != 0, reason="no user-mode kernel: needs root and vcan-run"
)


def stream(device: str, *before: str) -> dict[str, Any]:
    """What the program says, run directly or behind a command."""
    done = subprocess.run(
        [*before, sys.executable, str(PROGRAM), device],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    answer: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return answer


@pytest.mark.slow
@needs_tool
def test_in_virtual_time_every_cycle_is_complete_on_time_and_the_same_in_each_run() -> None:
    first, second = (stream("vcan0", str(TOOL), "-v", "-t", "150", "--") for _ in range(2))
    assert (first["outcome"], first["cycles"]) == ("completed", 500), first
    assert (first["missed"], first["late"], first["incomplete"]) == (0, 0, 0)
    assert first["largest_lateness"] < 0.0001
    assert first["largest_error"] < 0.05
    assert first["content"] == second["content"]


@pytest.mark.slow
@needs_tool
def test_in_real_time_inside_a_user_mode_kernel() -> None:
    answer = stream("vcan0", str(TOOL), "-t", "150", "--")
    assert (answer["outcome"], answer["cycles"]) == ("completed", 500), answer


@needs_device
def test_on_a_device_of_this_machine() -> None:
    answer = stream(str(own_device()))
    assert (answer["outcome"], answer["cycles"]) == ("completed", 500), answer
    assert answer["missed"] + answer["incomplete"] <= 25
