"""Gate 1's parts: the randomisation by blocks of time, torque and following error, relevance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from ident.exogeneity import GateSettings, TestedRows
from ident.exogeneity.agreement import SimulationAgreement, following_checks, torque_checks
from ident.exogeneity.instruments import instruments_gate
from ident.exogeneity.motion_functions import loop_functions, torque_functions
from ident.exogeneity.sign_flips import sign_flip_test
from robots.arrays import FloatArray

SAMPLES = 800
TIME = np.arange(SAMPLES) / 100.0
SEGMENT = np.zeros(SAMPLES, dtype=np.int64)
USED = np.ones((SAMPLES, 1), dtype=np.bool_)


def coloured(seed: int, columns: int, correlation: float = 0.8) -> FloatArray:
    shocks = np.random.default_rng(seed).normal(size=(SAMPLES + 100, columns))
    return np.asarray(lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], shocks, axis=0)[100:])


def smooth() -> FloatArray:
    """Instruments as a motion makes them: samples × 3."""
    return np.column_stack([np.sin(2.0 * TIME), np.cos(3.1 * TIME), np.sin(0.7 * TIME + 1.0) ** 2])


# The randomisation


def test_sign_flips_keep_their_size_whatever_the_memory_of_the_noise() -> None:
    # Correlated along time, common to two columns, and larger where the motion is larger. A true 5 % test
    # rejects at most 25 of 300 with probability 0.995.
    z = smooth()
    single, joint = np.zeros(2), 0
    for seed in range(300):
        noise = coloured(seed, 1) * (0.2 + np.abs(z[:, :1]))
        v = np.concatenate([noise, 0.5 * noise + 0.1 * coloured(seed + 1000, 1)], axis=1)
        found = sign_flip_test(v[:, np.newaxis], z[:, np.newaxis], SEGMENT)
        single += found.columns < 0.05
        joint += found.joint < 0.05
    assert single.max() <= 25
    assert single.min() >= 4
    assert 4 <= joint <= 25


def test_a_departure_with_a_direction_is_found_in_its_column() -> None:
    z = smooth()
    v = np.concatenate([coloured(1, 1), coloured(2, 1) + 0.8 * z[:, :1]], axis=1)
    found = sign_flip_test(v[:, np.newaxis], z[:, np.newaxis], SEGMENT)
    assert found.columns[0] > 0.05
    assert found.columns[1] <= 0.002
    assert found.joint <= 0.01


def test_the_randomisation_is_the_same_every_time_and_knows_recordings() -> None:
    z, v = smooth()[:, np.newaxis], coloured(3, 2)[:, np.newaxis]
    segment = np.repeat([0, 1, 2], [90, 310, 400])
    one, other = (sign_flip_test(v, z, segment) for _ in range(2))
    assert one.columns.tolist() == other.columns.tolist()
    assert sign_flip_test(v, z, SEGMENT).columns.tolist() != one.columns.tolist()


# Torque and following error


def agreement(
    lacking: FloatArray, following: FloatArray, noise: float = 0.05, seed: int = 5
) -> SimulationAgreement:
    """One joint; the robot's torque has ``lacking`` beyond the simulation's, its error is ``following``."""
    position, velocity = np.sin(2.0 * TIME), 2.0 * np.cos(2.0 * TIME)
    acceleration = -4.0 * position
    torque = 3.0 * acceleration + 2.0 * velocity + 4.0 * np.sign(velocity)
    error = 0.01 * torque + 0.02 * velocity
    size = float(np.std(torque))
    return SimulationAgreement(
        torque_measured=(torque + lacking + noise * size * coloured(seed, 1)[:, 0])[:, np.newaxis],
        torque_simulated=torque[:, np.newaxis],
        torque_functions=torque_functions(position, velocity, torque)[:, np.newaxis],
        following_measured=(following + 0.1 * noise * 0.01 * size * coloured(seed + 1, 1)[:, 0])[
            :, np.newaxis
        ],
        following_simulated=error[:, np.newaxis],
        loop_functions=loop_functions(error, torque, velocity, acceleration)[:, np.newaxis],
        moves=np.ones((1, 1), dtype=np.bool_),
    )


def columns() -> FloatArray:
    """The model's own columns: samples × 1 × 3."""
    velocity = 2.0 * np.cos(2.0 * TIME)
    return np.column_stack([-4.0 * np.sin(2.0 * TIME), velocity, np.sign(velocity)])[:, np.newaxis]


def simulated_error() -> FloatArray:
    return agreement(np.zeros(SAMPLES), np.zeros(SAMPLES)).following_simulated[:, 0]


def test_a_simulation_that_reproduces_the_robot_passes_and_its_p_values_keep_their_size() -> None:
    # 100 replicates: a true 5 % test rejects at most 12 with probability 0.998.
    torque, following = 0, 0
    for seed in range(100):
        case = agreement(np.zeros(SAMPLES), simulated_error(), seed=2 * seed)
        (one,) = torque_checks(case, columns(), SEGMENT, USED, 0.05, 0.05)
        (other,) = following_checks(case, SEGMENT, USED, 0.05, 0.005)
        assert one.passed
        assert other.passed
        assert one.p_value is not None
        assert other.p_value is not None
        torque += one.p_value < 0.05
        following += other.p_value < 0.05
    assert torque <= 12
    assert following <= 12


@pytest.mark.parametrize("effect", ["asymmetric", "stribeck", "spring"])
def test_an_effect_that_the_model_lacks_shows_in_the_torque(effect: str) -> None:
    position, velocity = np.sin(2.0 * TIME), 2.0 * np.cos(2.0 * TIME)
    lacking = {
        "asymmetric": 4.0 * (velocity > 0) * velocity**2,
        "stribeck": 6.0 * np.sign(velocity) * np.exp(-np.abs(velocity) / 0.4),
        "spring": 15.0 * position**2,
    }[effect]
    case = agreement(lacking, simulated_error())
    (check,) = torque_checks(case, columns(), SEGMENT, USED, 0.05, 0.05)
    left = lacking - columns()[:, 0] @ np.linalg.lstsq(columns()[:, 0], lacking, rcond=None)[0]
    share = np.linalg.norm(left) / np.linalg.norm(case.torque_measured)
    assert share > 0.06
    assert check.size == pytest.approx(share, rel=0.15)
    assert not check.passed


def test_what_the_models_parameters_can_take_up_is_no_missing_effect() -> None:
    case = agreement(2.0 * np.cos(2.0 * TIME), simulated_error())
    (check,) = torque_checks(case, columns(), SEGMENT, USED, 0.05, 0.05)
    assert check.size < 0.02
    assert check.passed


@pytest.mark.parametrize("gain", [0.8, 1.2])
def test_a_gain_that_is_off_shows_in_the_following_error(gain: float) -> None:
    case = agreement(np.zeros(SAMPLES), simulated_error() / gain)
    (check,) = following_checks(case, SEGMENT, USED, 0.05, 0.005)
    assert check.size == pytest.approx(abs(1.0 - gain), rel=0.02)
    assert check.p_value is not None
    assert check.p_value < 1e-6
    assert not check.passed


def test_a_loop_that_is_simulated_exactly_has_no_difference() -> None:
    case = agreement(np.zeros(SAMPLES), simulated_error(), noise=0.0)
    (torque,) = torque_checks(case, columns(), SEGMENT, USED, 0.05, 0.05)
    (following,) = following_checks(case, SEGMENT, USED, 0.05, 0.005)
    assert (torque.size, torque.p_value, torque.passed) == (0.0, 1.0, True)
    assert (following.size, following.p_value, following.passed) == (0.0, 1.0, True)


def test_a_joint_that_turns_one_way_only_has_a_friction_curve_for_that_way() -> None:
    functions = torque_functions(TIME, np.full(SAMPLES, 0.5) + 0.1 * np.sin(TIME), np.ones(SAMPLES))
    assert np.isfinite(functions).all()
    assert not functions[:, 4:8].any()


# The gate


def rows_of(seed: int, noise: float, mixing: float) -> TestedRows:
    """X = mixing · Z + V."""
    z = smooth()
    x = mixing * z + noise * np.random.default_rng(seed).normal(size=z.shape)
    torque = x @ [1.0, -2.0, 3.0] + 0.1 * coloured(seed, 1)[:, 0]
    return TestedRows(torque[:, np.newaxis], x[:, np.newaxis], z[:, np.newaxis], SEGMENT, USED)


def test_the_gate_tells_relevance_and_the_shift_that_a_departure_would_cause() -> None:
    case = rows_of(1, 0.02, 1.0)
    gate = instruments_gate(case, case.omega(), case.whitened(case.omega()), ("a", "b", "c"), GateSettings())
    assert gate.passed
    assert "weakest conditional first-stage F" in gate.detail
    assert "would shift" in gate.detail


@pytest.mark.parametrize(("stretch", "departure"), [(1.1, 0.1), (0.9, -0.1)])
def test_the_shift_is_that_of_the_parameters_either_way(stretch: float, departure: float) -> None:
    """Columns 10 % too large or too small: parameters in their place would be 10 % off, so many σ."""
    stretched = rows_of(1, 0.02, stretch)
    block = stretched.whitened(stretched.omega())
    gate = instruments_gate(stretched, stretched.omega(), block, ("a", "b", "c"), GateSettings())
    assert not gate.passed
    sizes = [check.size for check in gate.columns]
    assert sizes == pytest.approx([abs(departure) / stretch] * 3, rel=0.05)
    assert gate.p_value == pytest.approx(0.001)
    inverse = np.linalg.inv(block.x.T @ block.x)
    shift = 0.1 * np.abs(inverse @ block.x.T @ block.y) / np.sqrt(np.diag(inverse))
    told = float(gate.detail.split("most, by ")[1].split(" σ")[0])
    assert told == pytest.approx(shift.max(), rel=0.1)


def test_instruments_that_hardly_move_the_regressors_are_refused() -> None:
    case = rows_of(2, 20.0, 1.0)
    gate = instruments_gate(case, case.omega(), case.whitened(case.omega()), ("a", "b", "c"), GateSettings())
    assert not gate.passed
    strength = float(gate.detail.split("first-stage F ")[1].split(" (")[0])
    assert strength < 10.0


def test_gate_one_asks_the_loop_for_torque_and_following_error_too() -> None:
    """A difference of torque that a free parameter takes up passes; the same where that one is held fails."""
    names = ("a", "b", "c")
    velocity = 2.0 * np.cos(2.0 * TIME)
    case = agreement(2.0 * velocity, simulated_error())
    rows = TestedRows(case.torque_measured, columns(), columns(), SEGMENT, USED)
    block = rows.whitened(rows.omega())
    for free, passed in (
        (None, True),
        (np.array([False, True, False]), True),
        (np.array([True, False, False]), False),
    ):
        gate = instruments_gate(rows, rows.omega(), block, names, GateSettings(), case, free)
        expected = ("torque of joint 1", "following error of drive 1")
        assert tuple(check.column for check in gate.columns) == (*names, *expected)
        columns_free = columns() if free is None else columns()[:, :, free]
        (torque,) = torque_checks(case, columns_free, SEGMENT, USED, 0.05, 0.05)
        (following,) = following_checks(case, SEGMENT, USED, 0.05, 0.005)
        assert gate.columns[3:] == (torque, following)
        assert gate.columns[3].passed is passed and gate.passed is passed


def test_a_large_departure_that_chance_explains_passes_at_the_level_of_the_settings() -> None:
    """The published level is 5 %: a p-value above it passes whatever the size."""
    z = smooth()[:, :1]
    noise = coloured(3, 1)
    rows = TestedRows(noise + z, (z + 0.3 * noise)[:, np.newaxis], z[:, np.newaxis], SEGMENT, USED)
    block = rows.whitened(rows.omega())
    gate = instruments_gate(rows, rows.omega(), block, ("a",), GateSettings(margin=1e-6))
    (check,) = gate.columns
    assert check.p_value is not None
    assert 0.05 < check.p_value < 0.95
    assert check.passed
    held = GateSettings(margin=1e-6, level=check.p_value + 1e-9)
    assert not instruments_gate(rows, rows.omega(), block, ("a",), held).passed
