"""One definition of every effect: simulated with it, the motion takes the torque that its columns say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import robots
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.effects import State
from ident.effects.entry import EffectEntry
from ident.effects.placed import Family, Placed
from ident.effects.vocabulary import VOCABULARY, effect_from, family_named
from ident.parameters.present import Present
from robots.description import Robot
from tests.ident.closed_loop.held_torque import held_torque, middle_of_steps

STEP, EDGE = 0.00025, 400
"""s; samples at either end, where filters and differences do not hold."""


def fine(robot: Robot) -> Robot:
    """Controller, integration and recording in the same steps, so that differences of samples are exact."""
    controller = robot.controller.model_copy(update={"sample_time": STEP, "interpolation": "spline"})
    return robot.model_copy(update={"controller": controller})


TX40 = fine(robots.load("tx40"))
MODEL = RegressorModel.of(TX40)
PRIOR = MODEL.prior()


def motion(robot: Robot, duration: float = 1.4) -> Recording:
    """Two reversals of every joint, at speeds and accelerations of an exciting trajectory."""
    time = np.arange(0.0, duration, STEP)
    fade = np.clip(np.minimum(time, duration - time) / 0.2, 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
    phase = np.arange(robot.n)
    waves = np.sin(2 * np.pi * (1.1 + 0.15 * phase) * time[:, np.newaxis] + phase) - np.sin(phase)
    reference = np.array(robot.home) + 0.25 * fade[:, np.newaxis] * waves
    at_rest = np.zeros((1, robot.n))
    hold = MODEL.columns(State(np.array([robot.home]), at_rest, at_rest)) @ PRIOR
    signal = np.repeat(robot.control_signal(hold), time.size, axis=0)
    return Recording("motion", time, reference, reference.copy(), signal)


MOTION = motion(TX40)

UNFILTERED = TX40.model_copy(
    update={"identification": TX40.identification.model_copy(update={"cutoff_hz": 1e6})}
)
"""For columns that know of the filter of the positions: there is none here."""
KNOWING_THE_FILTER = (
    "gear_ripple",
    "torque_ripple",
    "current_loop_lag",
    "time_delay",
    "encoder_eccentricity",
    "command_dead_zone",
)


def torques(
    robot: Robot,
    effect: Placed,
    values: np.ndarray,
    recording: Recording = MOTION,
    standard: np.ndarray = PRIOR,
) -> tuple[np.ndarray, np.ndarray]:
    """What the usual model leaves of the control signals' torque, and what the effect's columns say of it."""
    model = replace(MODEL, effects=(*MODEL.effects, effect))
    run = simulate(model, np.concatenate([standard, values]), recording, 1)
    torque = robot.joint_torque(run.control_signal[1:-1])
    state = replace(middle_of_steps(run, STEP), torque=torque)
    left, said = torque - held_torque(MODEL, standard, run, STEP), effect.columns(state) @ values
    # Both through the low-pass that both sides of the identification go through.
    lowpass = butter(4, robot.identification.cutoff_hz, fs=1.0 / STEP, output="sos")
    smooth = [sosfiltfilt(lowpass, torque, axis=0)[EDGE:-EDGE] for torque in (left, said)]
    return smooth[0], smooth[1]


# Family: index of the place, shape (None: the middle of the grid), values, largest share of the effect's
# torque that its columns may miss. Falling friction and loads are taken at the old velocity, and columns that
# are linear in the effect (of a lag, a delay, a gear that gives way) miss its second order. Backlash is the
# coarsest: its columns are the gear's own state along the recorded motion, where an impact comes at another
# instant. With another inertia the stiffest friction is taken at another share of a step.
CASES: dict[str, list[tuple[int, tuple[float, ...] | None, tuple[float, ...], float]]] = {
    "viscous_friction": [(2, None, (0.5,), 0.005), (5, None, (0.5,), 0.005)],
    "coulomb_friction": [(2, None, (0.5,), 0.01), (5, None, (0.5,), 0.01), (1, None, (-3.0,), 0.01)],
    "asymmetric_friction": [(2, None, (0.5, 0.3), 0.01), (5, None, (-0.4, 0.1), 0.02)],
    "stribeck_friction": [(2, None, (2.0,), 0.05), (4, None, (1.0,), 0.05)],
    "static_friction": [(2, None, (2.0, 0.5), 0.15), (2, None, (0.0, 2.0), 0.1)],
    "nonlinear_viscous_friction": [(2, (0.5,), (2.0, -0.1), 0.005), (2, (2.0,), (5.0, 0.2), 0.005)],
    "load_dependent_friction": [(1, None, (0.1,), 0.03), (4, None, (0.5,), 0.03)],
    "load_quadratic_friction": [(1, None, (0.003,), 0.03), (2, None, (0.01,), 0.03)],
    "directional_efficiency": [(1, None, (0.1, 0.05), 0.03), (4, None, (0.5, -0.2), 0.03)],
    "dragging_brake": [(2, (4.0, 0.4, 0.3), (0.5,), 0.35)],
    "drifting_friction": [
        (2, (8.0,), (0.5, 0.3, 0.0, 0.0), 0.005),
        (2, (2.0,), (0.0, 0.0, 0.05, 0.03), 0.005),
        (5, (2.0,), (0.2, 0.1, -0.1, -0.05), 0.005),
    ],
    "temperature_viscous_friction": [(2, (8.0,), (0.3, 0.0), 0.005), (5, (2.0,), (0.1, -0.05), 0.005)],
    "position_dependent_friction": [(2, (3.0,), (0.5, 0.3), 0.01), (5, (2.0,), (0.3, 0.3), 0.01)],
    "joint_elasticity": [(2, None, (1.0,), 0.1), (1, None, (1.0,), 0.1)],
    "stiffening_elasticity": [(2, None, (1.0,), 0.1)],
    "backlash": [(2, None, (1.0,), 0.4)],
    "hysteresis": [(2, None, (1.0,), 0.01), (5, None, (0.5,), 0.01)],
    "wrist_coupling": [(0, None, (0.005, 0.2, 0.3), 0.01)],
    "gear_ripple": [(2, (1.0, 200.0), (2e-4, 1e-4), 0.06), (2, (1.0, 1000.0), (2e-4, 1e-4), 0.035)],
    "drive_gain_error": [(2, None, (0.05,), 0.01), (4, None, (-0.05,), 0.01)],
    "current_offset": [(2, None, (1.0,), 1e-6), (5, None, (0.5,), 1e-6)],
    "torque_ripple": [
        (2, (2.0, 0.0), (0.5, 0.3), 0.001),
        (5, (1.0, 0.0), (0.3, 0.1), 0.001),
        (2, (2.0, 1.0), (0.03, 0.02), 0.06),
    ],
    "saturation": [(2, (25.0,), (1.0,), 0.001)],
    "encoder_eccentricity": [(2, (45.0,), (1e-4, 5e-5), 0.06), (1, (1.0,), (5e-3, 3e-3), 0.06)],
    "torque_constant_droop": [(1, None, (0.2,), 0.01), (4, None, (0.3,), 0.01)],
    "command_dead_zone": [(1, None, (1.0,), 0.1), (2, None, (0.5,), 0.1)],
    "rotor_inertia": [(2, None, (0.02,), 0.002)],
    "current_loop_lag": [(2, None, (0.001,), 0.05)],
    "payload": [(0, None, (0.5, 0.01, 0.0, 0.05, 0.006, 0.0, 0.006, 0.0, -0.001, 0.001), 0.001)],
    "gravity_spring": [(1, None, (20.0, 5.0), 1e-4)],
    "base_tilt": [(0, None, (0.02, -0.03), 1e-6)],
    "base_compliance": [
        (0, (2e-5, 0.0, 0.0, 0.05), (1.0,), 0.1),
        (0, (1e-5, 1.0, 2.0, 0.02), (1.0,), 0.1),
        (0, (8e-6, 2.0, 0.0, 0.1), (1.0,), 0.1),
    ],
    "time_delay": [
        (0, (0.001,), (0.001,), 0.1),
        (3, (0.001,), (0.001,), 0.1),
        (0, (-0.001,), (-0.001,), 0.1),
        (2, (-0.001,), (-0.001,), 0.1),
    ],
    "cable_spring": [(2, None, (3.0, 1.0), 1e-4)],
    "dress_pack_hysteresis": [(2, None, (1.0, 2.0, 0.5), 0.01)],
    "contact": [(2, (1.55, 1.0), (100.0,), 0.001)],
}


def test_the_whole_vocabulary_is_here() -> None:
    assert set(CASES) == {family.name for family in VOCABULARY}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "case"),
    [pytest.param(f, case, id=f"{f.name}-{case[0]}") for f in VOCABULARY for case in CASES[f.name]],
)
def test_the_simulated_motion_takes_the_torque_of_the_columns(
    family: Family, case: tuple[int, tuple[float, ...] | None, tuple[float, ...], float]
) -> None:
    index, shape, values, share = case
    place = family.places(TX40)[index]
    middle = tuple(s.grid[len(s.grid) // 2] for s in family.shapes(TX40, place))
    robot = UNFILTERED if family.name in KNOWING_THE_FILTER else TX40
    present = Present(replace(MODEL, robot=robot), PRIOR)
    effect = family.effect(robot, place, middle if shape is None else shape, present)
    left, said = torques(TX40, effect, np.array(values))
    assert np.abs(said).max() > 0.05  # N·m: there is something to explain
    missed = np.sqrt(np.mean((left - said) ** 2, axis=0))
    assert missed.max() <= share * np.sqrt(np.mean(said**2, axis=0)).max()


@pytest.mark.parametrize("offset_at_link", [1.0, 0.0])
@pytest.mark.parametrize(
    ("name", "values", "more"),
    [
        ("load_dependent_friction", (0.1,), {}),
        ("load_dependent_friction", (0.1,), {"load_memory": 0.02}),
        ("load_dependent_friction", (1.0,), {"motor_share": 0.2}),
        ("load_quadratic_friction", (0.003,), {}),
        ("load_quadratic_friction", (0.003,), {"load_memory": 0.02}),
        ("directional_efficiency", (0.1, 0.05), {}),
        ("directional_efficiency", (0.1, 0.05), {"load_memory": 0.02}),
    ],
)
def test_friction_of_the_load_is_simulated_as_its_columns_say(
    name: str, values: tuple[float, ...], more: dict[str, float], offset_at_link: float
) -> None:
    """With 40 N·m that hold the shoulder all the time; without them the simulated friction is another one."""
    at = MODEL.names.index("off2")
    standard = PRIOR.copy()
    standard[at] = 40.0
    entry = EffectEntry(name, (2,), {"offset_at_link": offset_at_link, **more})
    effect = effect_from(TX40, entry, Present(MODEL, standard))
    left, said = torques(TX40, effect, np.array(values), standard=standard)
    missed = np.sqrt(np.mean((left - said) ** 2, axis=0)).max()
    assert missed <= 0.03 * np.sqrt(np.mean(said**2, axis=0)).max()


def test_a_term_of_the_load_has_the_constant_load_too() -> None:
    """In columns and in simulation, as the friction of that name has it that acts behind the gear."""
    standard = PRIOR.copy()
    standard[MODEL.names.index("off2")] = 40.0
    present = Present(MODEL, standard)
    term = effect_from(TX40, EffectEntry("term: sign q̇₂·|load₂|", (2,), {}), present)
    named = effect_from(TX40, EffectEntry("load_dependent_friction", (2,), {"offset_at_link": 1.0}), present)
    values = np.array([0.1])
    left, said = torques(TX40, term, values, standard=standard)
    missed = np.sqrt(np.mean((left - said) ** 2, axis=0)).max()
    assert missed <= 0.03 * np.sqrt(np.mean(said**2, axis=0)).max()
    np.testing.assert_allclose(said, torques(TX40, named, values, standard=standard)[1], atol=1e-6)


def test_a_later_recording_finds_the_gear_as_warm_as_it_leaves_it() -> None:
    """Columns and simulation begin with the warmth that motions like this one give in the time before."""
    place = family_named("drifting_friction").places(TX40)[2]
    effect = family_named("drifting_friction").effect(TX40, place, (2.0,), Present(MODEL, PRIOR))
    values = np.array([0.0, 0.0, 0.05, 0.03])
    size = {}
    for started in (0.0, 6.0):
        later = replace(MOTION, time=MOTION.time + started)
        left, said = torques(TX40, effect, values, later)
        missed = np.sqrt(np.mean((left - said) ** 2, axis=0)).max()
        size[started] = np.sqrt(np.mean(said**2, axis=0)).max()
        # The mean power of the time before is that of the set-points here, of the motion there.
        assert missed <= (0.03 if started else 0.005) * size[started]
    assert size[6.0] > 2.0 * size[0.0]
