"""``armhil gain``: two captures, one with a known payload; and what is wrong with them."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from robots import Robot
from tests.daq.calls import Call
from tests.daq.payload_captures import GAIN_ERROR, PAYLOAD, write_payload_captures


@pytest.fixture
def gain(armhil: Call) -> Call:
    """Calls ``armhil gain``."""
    return partial(armhil, "gain")


@pytest.fixture(scope="module")
def files(emps: Robot, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    return write_payload_captures(emps, tmp_path_factory.mktemp("payload"))


def test_the_true_gain_is_found(gain: Call, files: tuple[Path, Path, Path], emps: Robot) -> None:
    unloaded, loaded, payload = files
    code, out, err = gain(unloaded, "--loaded", loaded, "--payload", payload, "--json")
    assert code == 0
    content: dict[str, Any] = json.loads(out)
    (found,) = content["gains"]
    truth = emps.gains[0] * (1.0 + GAIN_ERROR)
    assert abs(found["value"] - truth) < 4 * found["sigma"]
    assert found["value"] == pytest.approx(truth, rel=0.01)
    assert 0.001 < found["sigma"] / found["value"] < 0.01  # the payload's uncertainty is in it
    assert found["seen"] is True and found["described"] == emps.gains[0]
    assert content["unloaded"] == [str(unloaded)] and content["loaded"] == [str(loaded)]
    words = " ".join(err.split())
    assert "Drive gains" in words and "gain_relative_uncertainty" in words


def test_captures_that_are_interchanged_are_refused(gain: Call, files: tuple[Path, Path, Path]) -> None:
    unloaded, loaded, payload = files
    code, _, err = gain(loaded, "--loaded", unloaded, "--payload", payload)
    assert code == 2
    assert "are the captures rightly told into loaded and unloaded" in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "mass = 60.0",
            "mass = -1.0",
            "payload.toml:2: mass: -1.0 is not allowed; allowed: a number from 0.0001 to 10000",
        ),
        ("center = [0.0, 0.0, 0.1]", "center = [0.0, 0.1]", "payload.toml:3: center"),
        (
            "mass = 60.0",
            "weight = 60.0",
            "payload.toml:2: weight: 60.0 is given to a key that does not exist",
        ),
        ("[0.4, 0.0, 0.4, 0.0, 0.0, 0.4]", "[0.1, 0.0, 0.1, 0.0, 0.0, 9.0]", "payload: no body has the mass"),
        (
            "format = 1",
            'format = 1\nframe = "hand"',
            'payload: "hand" is not a moving link of emps.urdf; allowed:',
        ),
    ],
)
def test_a_payload_that_cannot_be(
    gain: Call, files: tuple[Path, Path, Path], tmp_path: Path, old: str, new: str, said: str
) -> None:
    unloaded, loaded, _ = files
    assert old in PAYLOAD
    payload = tmp_path / "payload.toml"
    payload.write_text(PAYLOAD.replace(old, new), encoding="utf-8")
    code, _, err = gain(unloaded, "--loaded", loaded, "--payload", payload)
    assert code == 2
    (line,) = err.splitlines()
    assert line.startswith("armhil: ") and said in line


def test_files_and_options_that_are_missing(gain: Call, files: tuple[Path, Path, Path]) -> None:
    unloaded, loaded, payload = files
    code, _, err = gain(unloaded, "--payload", payload)
    assert code == 2 and "--loaded" in err
    code, _, err = gain(unloaded, "--loaded", loaded, "--payload", "nowhere.toml")
    assert code == 2
    assert err == "armhil: nowhere.toml: no such file; allowed: a payload file (payload.toml)\n"
    code, _, err = gain(unloaded, "--loaded", "nowhere.mcap", "--payload", payload)
    assert code == 2 and "nowhere.mcap" in err.splitlines()[-1]
