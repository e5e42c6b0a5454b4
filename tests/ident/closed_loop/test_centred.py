"""The simulation answers when the arm does: against itself in steps 20 times finer, and against the lag."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from ident import Recording, RegressorModel, identify
from ident.closed_loop import SimulatedRun, simulate
from ident.effects import State
from ident.identification.options import Options
from robots.description import Robot

HELD = [0.001, 0.0006]
"""s; for so long a controller holds its output, twice the lag of its torque."""

SOON = 10e-6
"""s; delays below this are none."""


@cache
def arm(held: float) -> Robot:
    """The shipped arm with recordings at its controller's rate and a cut-off above the motion."""
    robot = robots.load("tx40")
    controller = robot.controller.model_copy(update={"sample_time": held, "velocity_difference_samples": 1})
    settings = robot.identification.model_copy(
        update={"control_signal_lag": held / 2, "control_signal_reading": "averaged", "cutoff_hz": 100.0}
    )
    return robot.model_copy(update={"controller": controller, "identification": settings})


@cache
def multi_sine(held: float) -> Recording:
    """Ten seconds of large slow waves with tones of 3 to 28 Hz on top."""
    robot = arm(held)
    generator = np.random.default_rng(5)
    time = np.arange(0.0, 10.0, held)[:, np.newaxis]
    fade = np.clip(np.minimum(time, 10.0 - time) / 0.5, 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
    waves = np.zeros((time.shape[0], robot.n))
    for hz, size in [
        (0.3, 0.4),
        (0.7, 0.2),
        *((hz, 0.25 / (2 * np.pi * hz) ** 1.5) for hz in range(3, 29, 5)),
    ]:
        waves += size * np.sin(2 * np.pi * hz * time + generator.uniform(0, 2 * np.pi, robot.n))
    reference = np.array(robot.home) + fade * waves
    model, still = RegressorModel.of(robot), np.zeros((1, robot.n))
    hold = model.columns(State(reference[:1], still, still)) @ model.prior()
    signal = np.repeat(robot.control_signal(hold), time.shape[0], axis=0)
    return Recording("multi-sine", time[:, 0], reference, reference.copy(), signal)


@cache
def driven(held: float, substeps: int) -> SimulatedRun:
    model = RegressorModel.of(arm(held))
    return simulate(model, model.prior(), multi_sine(held), substeps)


@pytest.mark.slow
@pytest.mark.parametrize("held", HELD)
def test_the_simulation_is_that_of_steps_20_times_finer(held: float) -> None:
    usual = round(np.ceil(held / 0.00025))
    coarse, fine = driven(held, usual), driven(held, 20 * usual)
    apart = np.std(coarse.control_signal - fine.control_signal, axis=0) / np.std(fine.control_signal, axis=0)
    assert apart.max() < 2e-4  # half a step early it was 4e-3


@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("finer", [1, 20])
def test_the_lag_of_a_simulated_arm_is_half_of_what_its_controller_holds(held: float, finer: int) -> None:
    usual = round(np.ceil(held / 0.00025))
    run, generator = driven(held, finer * usual), np.random.default_rng(1)
    noise = 0.02 * generator.normal(size=run.control_signal.shape) / arm(held).gains
    recorded = replace(multi_sine(held), position=run.position, control_signal=run.control_signal + noise)
    signals = identify(arm(held), (recorded,), options=Options(method="ls")).result.signals
    assert signals is not None and signals.estimated_lag is not None and signals.lag_sigma is not None
    assert signals.lag_sigma < 0.5 * SOON
    assert abs(signals.estimated_lag - held / 2) < SOON
