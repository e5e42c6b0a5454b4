"""A sealed truth holds everything, shows nothing, and tells who opened it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers import Channel, DriveError
from drivers.simulated import PlantTruth, Scenario, SimulatedArm, open_seal, sealed_content, write_seal
from drivers.simulated.seal import SealError, truth_of, was_opened

HIDDEN = Scenario.from_dict({"backlash": [{"drive": 3, "width": 1e-3}]})


def test_what_was_sealed_comes_out(tmp_path: Path, truth: PlantTruth) -> None:
    file = tmp_path / "run.sealed"
    write_seal(file, sealed_content(truth, HIDDEN, ratio=3.2))
    assert was_opened(file) == ()
    content = open_seal(file, by="scoring of a test")
    assert truth_of(content) == (truth, HIDDEN)
    assert content["ratio"] == 3.2
    open_seal(file, by="a second look")
    assert was_opened(file) == ("scoring of a test", "a second look")


def test_nothing_of_it_can_be_read_by_accident(tmp_path: Path, truth: PlantTruth) -> None:
    file = tmp_path / "run.sealed"
    write_seal(file, sealed_content(truth, HIDDEN))
    text = file.read_text()
    assert "backlash" not in text
    assert "Fc3" not in text


def test_a_seal_is_not_written_twice(tmp_path: Path) -> None:
    file = tmp_path / "run.sealed"
    write_seal(file, {"a": 1})
    with pytest.raises(SealError, match="exists already"):
        write_seal(file, {"a": 2})
    with pytest.raises(SealError, match="cannot be written"):
        write_seal(tmp_path / "no" / "folder", {"a": 2})


def test_a_broken_seal_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.sealed"
    write_seal(file, {"a": 1})
    other = tmp_path / "other.sealed"
    write_seal(other, {"a": 2})
    envelope = json.loads(file.read_text())
    swapped = envelope | {"content": json.loads(other.read_text())["content"]}
    for text, message in (
        (json.dumps(swapped), "does not fit its digest"),
        (json.dumps(envelope | {"content": "AAAA"}), "damaged"),
        (json.dumps({"a": 1}), "not a sealed truth"),
        ("{", "damaged"),
    ):
        file.write_text(text)
        with pytest.raises(SealError, match=message) as refusal:
            open_seal(file, by="test")
        assert "\n" not in str(refusal.value)
    assert was_opened(file) == ()
    with pytest.raises(SealError, match="cannot be read"):
        open_seal(tmp_path / "none", by="test")


def test_the_process_of_the_drives_seals_and_does_not_tell(
    tmp_path: Path, truth: PlantTruth, new_channel: Callable[[], Channel]
) -> None:
    hidden = tmp_path / "hidden.toml"
    hidden.write_text("[[backlash]]\ndrive = 3\nwidth = 1e-3\n")
    seal = tmp_path / "run.sealed"
    with (
        SimulatedArm("tx40", new_channel(), truth=truth, scenario=hidden, seal=seal) as arm,
        pytest.raises(DriveError, match="sealed"),
    ):
        arm.truth()
    assert truth_of(open_seal(seal, by="test")) == (truth, HIDDEN)


def test_a_bad_scenario_stops_the_process_with_its_line(
    tmp_path: Path, new_channel: Callable[[], Channel]
) -> None:
    hidden = tmp_path / "hidden.toml"
    hidden.write_text("[[backlash]]\ndrive = 9\nwidth = 1e-3\n")
    with pytest.raises(DriveError, match=r"backlash\[1\]: axis 9; allowed: 1 to 6"):
        SimulatedArm("tx40", new_channel(), scenario=hidden)
