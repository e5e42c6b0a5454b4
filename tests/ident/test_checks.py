"""What a recording cannot be: each common mistake is named in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.importing.load import load_recording
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from ident import IdentificationError, Recording, identify
from ident.preparation.checks import check_recordings
from robots import Robot


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def sound(tx40: Robot) -> Recording:
    """Fourteen seconds of the simulated arm, all joints in motion."""
    time = np.arange(0.0, 14.0, tx40.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(time, 14.0 - time))[:, np.newaxis] ** 3
    tones = [(0.13, 0.5), (0.31, 0.22), (0.7, 0.06)]
    waves = sum(
        a * np.sin(2 * np.pi * f * (1 + 0.09 * np.arange(6)) * time[:, np.newaxis] + np.arange(6))
        for f, a in tones
    )
    run = simulate_offline(tx40, draw_truth(tx40, 1), np.array(tx40.home) + window * waves)
    return Recording("run", run.time, run.reference, run.position, run.control_signal)


def swapped(r: Recording) -> Recording:
    return replace(r, position=r.control_signal, control_signal=r.position)


def constant_joint(r: Recording) -> Recording:
    position = r.position.copy()
    position[:, 3] = position[0, 3]
    return replace(r, position=position)


def not_recorded(r: Recording) -> Recording:
    signal = r.control_signal.copy()
    signal[:, 1] = 0.0
    return replace(r, control_signal=signal)


def flipped(r: Recording) -> Recording:
    return replace(r, control_signal=r.control_signal * np.array([1, 1, -1, 1, 1, 1]))


def in_degrees(r: Recording) -> Recording:
    return replace(r, position=np.rad2deg(r.position))


def fewer_joints(r: Recording) -> Recording:
    return Recording("run", r.time, None, r.position[:, :4], r.control_signal[:, :4])


def short(r: Recording) -> Recording:
    return Recording("run", r.time[:120], None, r.position[:120], r.control_signal[:120])


def in_step(r: Recording) -> Recording:
    """All joints as the first: nothing tells them apart."""
    return replace(r, position=np.repeat(0.3 * r.position[:, :1], 6, axis=1) + r.position[0], reference=None)


def one_way(r: Recording) -> Recording:
    """Joint 3 goes on where it turned back."""
    position = r.position.copy()
    position[1:, 2] = position[0, 2] + 0.2 * np.cumsum(np.abs(np.diff(position[:, 2])))
    return replace(r, position=position, reference=None)


def test_a_sound_recording_is_let_through(tx40: Robot, sound: Recording) -> None:
    assert check_recordings(tx40, (sound,)) == ()
    identify(tx40, (sound,))


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (swapped, "run: the control signal of joint . is far smoother than its position.* swapped"),
        (
            constant_joint,
            r"run: joint 4 does not move \(0 rad in all\), so inertia and friction cannot be seen",
        ),
        (not_recorded, "run: the control signal of drive 2 is 0 throughout; was it recorded"),
        (flipped, "joint 3: viscous and Coulomb friction come out negative.* sign"),
        (in_degrees, r"run: joint . reaches .*; allowed: -.* to .* rad\. Is the position in degrees\?"),
        (fewer_joints, "run: 4 joints; allowed: 6, as tx40 has"),
        (short, "too short a record; allowed: at least"),
        (in_step, "does not tell apart|does not excite"),
        (one_way, "does not tell apart Fc3, off3: joint 3 moves one way only, so dry friction is constant"),
    ],
)
def test_a_mistake_is_refused_in_one_line_that_names_it(
    tx40: Robot, sound: Recording, mistake: Callable[[Recording], Recording], said: str
) -> None:
    with pytest.raises(IdentificationError, match=said) as caught:
        identify(tx40, (mistake(sound),))
    assert "\n" not in str(caught.value)


def test_small_angles_in_degrees_are_known_by_their_speed(tx40: Robot, sound: Recording) -> None:
    small = 0.02 * (sound.position - sound.position[0])
    fast = Recording("run", sound.time / 20, None, np.rad2deg(small), sound.control_signal)
    said = check_recordings(tx40, (fast,))
    assert any("times its velocity limit; are its unit (degrees?)" in sentence for sentence in said)


def test_positions_beyond_the_limits_are_a_warning(tx40: Robot, sound: Recording) -> None:
    off = replace(sound, position=sound.position + np.array([0, 0, 0, 0, 2.5, 0]))
    (said,) = check_recordings(tx40, (off,))
    assert said.startswith("run: joint 5 moves from") and "beyond its limits -2.0943 to 2.33" in said


def test_a_wrong_sampling_rate_shows_as_speed(tx40: Robot, sound: Recording) -> None:
    said = check_recordings(tx40, (replace(sound, time=sound.time / 8),))
    assert said and all("times its velocity limit" in sentence for sentence in said)


def test_slow_joints_are_the_reason_for_what_is_not_seen(tx40: Robot, sound: Recording) -> None:
    slow = sound.position.copy()
    slow[:, 5] = slow[0, 5] + 0.05 * np.linspace(0.0, 1.0, len(slow))
    still = tx40.model_copy(
        update={"identification": tx40.identification.model_copy(update={"minimum_speed": 0.0})}
    )
    reason = re.compile("joint 6 (moves too slowly|hardly accelerates)")
    recording = Recording("run", sound.time, None, slow, sound.control_signal)
    try:
        warnings = identify(still, (recording,)).result.warnings
    except IdentificationError as error:
        warnings = (str(error),)
    assert any(reason.search(sentence) for sentence in warnings), warnings


def test_published_recordings_are_sound(shared_data: Path) -> None:
    for name, path in (("tx40", shared_data / "tx40"), ("emps", shared_data / "emps" / "DATA_EMPS.mat")):
        robot = robots.load(name)
        assert check_recordings(robot, load_recording(path, robot).recordings) == ()
