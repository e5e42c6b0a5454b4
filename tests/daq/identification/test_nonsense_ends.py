"""Nonsense never ends as a model for use: it is refused with 2, or shown as not to be trusted with 1."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from daq.importing.guess_log import guess_log
from daq.importing.guess_torque import LogHints
from robots.arrays import FloatArray
from tests.daq.calls import Call
from tests.daq.importing.published_logs import EMPS_URDF
from tests.daq.importing.test_guess_log import URDF, motion, numbered, written

__all__ = ["motion"]
TIME = 0.002 * np.arange(6000)
ACCELERATION = -0.2 * np.sin(2.0 * TIME) - 0.98 * np.sin(7.0 * TIME + 1.0)
SPEED = 0.1 * np.cos(2.0 * TIME) + 0.14 * np.cos(7.0 * TIME + 1.0)
NOISE = np.random.default_rng(11)
POSITION = 0.1 + 0.05 * np.sin(2.0 * TIME) + 0.02 * np.sin(7.0 * TIME + 1.0)
POSITION = POSITION + 1e-7 * NOISE.standard_normal(TIME.size)
FORCE = 95.0 * ACCELERATION + 200.0 * SPEED + 20.0 * np.sign(SPEED) + 0.2 * NOISE.standard_normal(TIME.size)
Odd = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def off_at(*samples: int) -> FloatArray:
    """20 mm."""
    off = np.zeros(TIME.size)
    off[list(samples)] = 0.02
    return off


def describes(folder: Path, log: Path, urdf: Path) -> Path:
    """The arm's folder, as a good log shows it: what is odd later is not taken up by a guess."""
    arm = folder / "arm"
    arm.mkdir()
    guess_log(log, urdf, arm, LogHints())
    return arm


def slider(folder: Path, odd: Odd) -> tuple[Path, Path]:
    good = written(folder / "good.csv", {"t": TIME, "q1": POSITION, "tau1": FORCE})
    position, force = odd(POSITION.copy(), FORCE.copy())
    log = written(folder / "log.csv", {"t": TIME, "q1": position, "tau1": force})
    return describes(folder, good, EMPS_URDF), log


def said_of(armhil: Call, arm: Path, log: Path) -> tuple[int, str]:
    code, out, err = armhil("identify", log, "--robot", arm, "--no-catalogue", "--quiet")
    return code, " ".join((out + err).split())


def recommends(text: str) -> bool:
    return "use" in text.lower().replace("used", "").split() or "good to" in text


def test_the_log_that_is_made_odd_is_a_good_one(armhil: Call, tmp_path: Path) -> None:
    code, text = said_of(armhil, *slider(tmp_path, lambda q, f: (q, f)))
    assert code == 0
    assert "Do not trust" not in text


REFUSED: dict[str, tuple[Odd, str]] = {
    "signal 1000 times too large": (lambda q, f: (q, 1000.0 * f), "as no arm can"),
    "torque beyond the limits": (lambda q, f: (q, f + 8000.0), "times its limit"),
    "two samples 20 mm off": (
        lambda q, f: (q + off_at(3000, 3001), f),
        "jumps at 2 samples (5.998, 6.004 s)",
    ),
    "every seventh sample off": (lambda q, f: (q + off_at(*range(1000, 5000, 7)), f), "look for jumps"),
    "no torque": (lambda q, f: (q, 0.0 * f), "was it recorded?"),
    "friction that drives": (lambda q, f: (q, -f), "is the sign of the control signal"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_recording_of_an_arm_is_refused_in_a_line(armhil: Call, tmp_path: Path, case: str) -> None:
    odd, why = REFUSED[case]
    code, text = said_of(armhil, *slider(tmp_path, odd))
    assert code == 2
    assert text.startswith("armhil: ")
    assert why in text
    assert not recommends(text)


NOT_TRUSTED: dict[str, tuple[Odd, str]] = {
    "mass below zero": (
        lambda q, f: (q, f - 190.0 * ACCELERATION),
        "nertia at a joint below zero (carriage by",
    ),
    "noise": (
        lambda q, f: (q, 100.0 * np.random.default_rng(3).standard_normal(f.size)),
        "one of 4 parameters",
    ),
}


@pytest.mark.parametrize("case", NOT_TRUSTED)
def test_a_model_that_no_arm_can_have_is_not_to_be_trusted(armhil: Call, tmp_path: Path, case: str) -> None:
    odd, why = NOT_TRUSTED[case]
    code, text = said_of(armhil, *slider(tmp_path, odd))
    assert code == 1
    assert text.startswith("Do not trust this model")
    assert why in text
    assert not recommends(text)


def test_a_single_sample_is_set_aside_and_told(armhil: Call, tmp_path: Path) -> None:
    code, text = said_of(armhil, *slider(tmp_path, lambda q, f: (q + off_at(3000), f)))
    assert code == 0
    assert "position of joint 1 is off by up to 0.02 at one sample (6 s), set aside" in text


def test_a_torque_rather_far_beyond_the_limits_is_told(armhil: Call, tmp_path: Path) -> None:
    """Limits of published URDFs are placeholders: said, and refused beyond a factor of 20."""
    _, text = said_of(armhil, *slider(tmp_path, lambda q, f: (q, f + 3000.0)))
    assert "joint 1's torque reaches 3" in text
    assert "times its limit 351.507; are its unit and gain right?" in text


def test_a_rotor_below_zero_is_not_to_be_trusted(
    armhil: Call, tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    """Of six axes: as if the torque of the fourth motor helped its rotor along."""
    t, q, v, torque = motion
    good = written(tmp_path / "good.csv", {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)})
    arm = describes(tmp_path, good, URDF)
    assert said_of(armhil, arm, good)[0] == 0
    torque = torque.copy()
    torque[:, 3] -= 1.0 * np.gradient(v[:, 3], t)
    log = written(tmp_path / "log.csv", {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)})
    code, text = said_of(armhil, arm, log)
    assert code == 1
    assert text.startswith("Do not trust this model")
    assert "otor inertia below zero (Ia4" in text
    assert "nertia at a joint below zero (joint_4 by" in text
    assert not recommends(text)
