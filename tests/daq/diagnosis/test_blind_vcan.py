"""Blind over CAN frames in virtual time: only the drives' process knows what is hidden; the seal stays shut.

A short form of benchmarks/naming_over_can.py.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.naming_over_can import blind, virtual_time
from daq.recording.reader import read_capture
from tests.drivers.test_vcan import TOOL, needs_tool


@needs_tool
@pytest.mark.timeout(600)
def test_a_sealed_payload_is_named_from_frames(tmp_path: Path) -> None:
    result = blind(tmp_path, "payload", 900, 6.0, 4.0, virtual_time(TOOL))
    assert result["opened_before_the_diagnosis"] == []
    assert result["hidden"] == [["payload", []]]
    assert [finding["effect"] for finding in result["findings"]] == ["payload"]
    before, after, floor = (result["gap"][key][1] for key in ("before", "after", "floor"))
    assert after - floor < 0.2 * (before - floor)
    for name in ("fit", "validation"):
        capture = read_capture(tmp_path / f"{name}.mcap")
        assert capture.run["channel"] == "socketcan:vcan0"
        assert capture.outcome is not None and capture.outcome["missed_cycles"] == "0"
