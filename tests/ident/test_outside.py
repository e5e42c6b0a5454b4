"""Forces from outside and signals added to the controller's, in a loop that is integrated here."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.controllers.columns import LoopSignals
from robots import Robot
from robots.arrays import FloatArray

MASS, VISCOUS, GAIN = 90.0, 200.0, 35.0
KP, KD = 2000.0, 60.0
STEP, FINER = 0.001, 20


@cache
def axis() -> Robot:
    """The one-axis rig with a PD controller that runs with the samples."""
    rig = robots.load("emps")
    controller = rig.controller.model_copy(
        update={
            "type": "pd",
            "sample_time": STEP,
            "position_gain": (KP,),
            "velocity_gain": (KD,),
            "integral_gain": (0.0,),
            "velocity_feed_forward": (0.0,),
            "acceleration_feed_forward": (),
            "friction_feed_forward": (),
            "velocity_cutoff_hz": None,
            "velocity_difference_samples": 1,
            "delay_samples": 0,
            "saturation": (1e4,),
        }
    )
    drive = rig.drive[0].model_copy(update={"gain": GAIN})
    return rig.model_copy(update={"controller": controller, "drive": (drive,)})


def run(added: FloatArray, push: FloatArray) -> Recording:
    """M q̈ = g v + push − Fv q̇ with v = kp (r − q) − kd q̇ + added, in 20 steps per sample."""
    samples = added.size
    time = STEP * np.arange(samples)
    reference = 0.05 * np.sin(2 * np.pi * 0.8 * time) * np.minimum(1.0, time)
    q = last = speed = 0.0
    position, signal = np.empty(samples), np.empty(samples)
    for k in range(samples):
        position[k] = q
        signal[k] = KP * (reference[k] - q) - KD * (q - last) / STEP + added[k]
        last, h = q, STEP / FINER
        for part in range(FINER):
            force = push[k] + (push[min(k + 1, samples - 1)] - push[k]) * part / FINER
            speed += h * (GAIN * signal[k] + force - VISCOUS * speed) / MASS
            q += h * speed
    return Recording("axis", time, reference[:, None], position[:, None], signal[:, None])


WAVES = np.sin(2 * np.pi * np.outer(STEP * np.arange(3000), [3.0, 7.0, 11.0])).sum(axis=1)
NONE = np.zeros(3000)


def off(recording: Recording) -> tuple[float, float]:
    """rms of position and control signal that the true arm's simulation lacks, as shares."""
    robot = axis()
    model = RegressorModel.of(robot)
    standard = model.standard_parameters({"M1": MASS, "Fv1": VISCOUS})
    found = simulate(model, standard, recording, substeps=FINER)
    return (
        float(np.std(found.position - recording.position) / np.std(recording.position)),
        float(np.std(found.control_signal - recording.control_signal) / np.std(recording.control_signal)),
    )


def test_the_loop_without_either_is_simulated() -> None:
    assert max(off(run(NONE, NONE))) < 0.01


def test_a_signal_that_was_injected_moves_the_simulated_arm() -> None:
    injected = 10.0 * WAVES
    recording = run(injected, NONE)
    assert max(off(replace(recording, added=injected[:, None]))) < 0.01
    assert max(off(recording)) > 0.05


def test_a_force_from_outside_moves_it_and_is_not_in_the_drives() -> None:
    push = 400.0 * WAVES
    recording = run(NONE, push)
    assert max(off(replace(recording, outside=push[:, None]))) < 0.01
    assert max(off(recording)) > 0.05


def test_the_controllers_gains_are_those_without_what_was_added() -> None:
    injected = 10.0 * WAVES
    recording = replace(run(injected, NONE), added=injected[:, None])
    signals = LoopSignals.of(axis(), recording, 1)
    np.testing.assert_allclose(signals.signal, recording.control_signal - injected[:, None])


@pytest.mark.parametrize("channel", ["added", "outside"])
def test_a_channel_of_another_length_is_refused(channel: str) -> None:
    with pytest.raises(ValueError, match="has shape"):
        replace(run(NONE, NONE), **{channel: np.zeros((5, 1))})
