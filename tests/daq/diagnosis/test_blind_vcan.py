"""Blind over CAN frames in virtual time: only the drives' process knows what is hidden; the seal stays shut.

A short form of benchmarks/naming_over_can.py.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.naming_over_can import blind, virtual_time
from daq.recording.reader import read_capture
from tests.drivers.test_vcan import TOOL, needs_tool


@pytest.mark.slow
@needs_tool
@pytest.mark.timeout(600)
def test_what_is_sealed_is_named_from_frames(tmp_path: Path) -> None:
    hidden = "asymmetric_friction"
    result = blind(tmp_path, hidden, 900, 6.0, 4.0, virtual_time(TOOL), refit=True)
    assert result["opened_before_the_diagnosis"] == []
    (name, axes), found = result["hidden"][0], result["findings"][0]
    assert (name, len(result["hidden"]), len(result["findings"])) == (hidden, 1, 1)
    assert (found["effect"], found["joints"]) == (name, axes)
    before, after, floor = (result["gap"][key][axes[0] - 1] for key in ("before", "after", "floor"))
    assert after - floor < 0.2 * (before - floor)
    for capture in (read_capture(tmp_path / f"{part}.mcap") for part in ("fit", "validation")):
        assert capture.run["channel"] == "socketcan:vcan0"
        assert capture.outcome is not None and capture.outcome["missed_cycles"] == "0"
