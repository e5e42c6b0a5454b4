"""Second encoders, temperatures and flags of a log are found by what they do, and used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.files.toml_text import toml_text
from daq.importing.guess_log import guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_log, load_recording
from robots.arrays import FloatArray
from tests.daq.calls import Call
from tests.daq.importing.test_guess_log import URDF, motion, numbered, written

__all__ = ["motion"]
STIFFNESS = np.array([4e4, 5e4, 2e4, 1e4, 8e3, 4e3])


def _log(folder: Path, motion: tuple[FloatArray, ...], **more: FloatArray) -> Path:
    t, q, _, torque = motion
    return written(folder / "log.csv", {"t": t, **numbered("q", q), **numbered("tau", torque), **more})


def test_what_stands_beside_is_read(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    flags = np.ones(len(t))
    flags[1000:1003] = 0.0
    link = np.rad2deg(q - torque / STIFFNESS)
    log = _log(
        tmp_path,
        motion,
        **numbered("link_q_", link),
        **numbered("motor_temp_", 40.0 + 0.0 * q),
        valid=flags,
    )
    guessed = guess_log(log, URDF, tmp_path, LogHints())
    assert guessed.columns["second_encoder"] == {"columns": [f"link_q_{k}" for k in range(6)], "unit": "deg"}
    assert guessed.columns["temperature"] == {"columns": [f"motor_temp_{k}" for k in range(6)]}
    assert guessed.columns["complete"] == {"columns": ["valid"]}
    loaded = load_log(log, guessed.robot, tmp_path / "import.toml")
    assert [len(part.time) for part in loaded.recordings] == [1000, len(t) - 1003]
    second, temperature = loaded.recordings[1].second, loaded.recordings[1].temperature
    assert second is not None and temperature is not None
    np.testing.assert_allclose(second, np.deg2rad(link)[1003:], atol=1e-12)
    assert (temperature == 40.0).all()
    words = [text for text in loaded.warnings if "second encoders show elastic gears directly" in text]
    assert sum(text.count("N·m/rad") for text in words) == 6
    assert all("joint_" in text and len(text) <= 160 for text in words)


@pytest.mark.parametrize("name", ["link_q_", "valid"])
def test_what_is_not_what_it_is_called_is_not_used(
    tmp_path: Path, motion: tuple[FloatArray, ...], name: str
) -> None:
    """Positions of another motion, and flags that are counts."""
    t, q, *_ = motion
    other = numbered(name, q[::-1]) if name == "link_q_" else {name: np.floor(10 * t)}
    guessed = guess_log(_log(tmp_path, motion, **other), URDF, tmp_path, LogHints())
    assert not {"second_encoder", "complete"} & set(guessed.columns)


def test_an_import_keeps_what_stands_beside(
    armhil: Call, tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    """Second encoders, temperatures, forces and added signals come back sample by sample, in pieces."""
    t, q, _, torque = motion
    flags = np.ones(len(t))
    flags[1000:1003] = 0.0
    wrench = np.outer(np.sin(t), [3.0, 2.0, 1.0, 0.3, 0.2, 0.1])
    log = _log(
        tmp_path,
        motion,
        **numbered("link_q_", q - torque / STIFFNESS),
        **numbered("motor_temp_", 40.0 + q),
        **numbered("wrench", wrench),
        **numbered("ff", np.cos(q)),
        valid=flags,
    )
    guessed = guess_log(log, URDF, tmp_path, LogHints())
    columns = tmp_path / "more.toml"
    columns.write_text(
        (tmp_path / "import.toml").read_text("utf-8")
        + toml_text({"force": {"columns": [f"wrench{k}" for k in range(6)]}})
        + toml_text({"added": {"columns": [f"ff{k}" for k in range(6)]}}),
        "utf-8",
    )
    robot = tmp_path / "robot.toml"
    code, out, _ = armhil("import", log, "--robot", robot, "--columns", columns, "--out", tmp_path / "c.mcap")
    assert code == 1 and "no place" not in out
    direct = load_log(log, guessed.robot, columns)
    kept = load_recording(tmp_path / "c.mcap", guessed.robot)
    assert len(kept.recordings) == len(direct.recordings) == 2
    for ours, theirs in zip(kept.recordings, direct.recordings, strict=True):
        for channel in ("second", "temperature", "outside", "added"):
            np.testing.assert_array_equal(getattr(ours, channel), getattr(theirs, channel))
    assert [w for w in kept.warnings if "elastic gears directly" in w]
