"""Base parameters: the right number, the right relations, and one answer every time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import robots
from ident import BaseParameters, RegressorModel, base_parameters, drive_parameters
from ident.effects import State
from ident.parameters.base import _expression, _independent_columns, _relation, random_states


@pytest.fixture(scope="module")
def tx40() -> BaseParameters:
    return base_parameters(RegressorModel.of(robots.load("tx40")))


@pytest.fixture(scope="module")
def emps() -> BaseParameters:
    return base_parameters(RegressorModel.of(robots.load("emps")))


def test_one_axis_has_the_four_published_parameters(emps: BaseParameters) -> None:
    assert emps.names == ("M1R", "Fv1", "Fc1", "off1")
    assert emps.expressions == ("M1 + Ia1", "Fv1", "Fc1", "off1")
    assert emps.units == ("kg", "N·s/m", "N", "N")


def test_six_axes_have_the_published_number_of_base_parameters(tx40: BaseParameters) -> None:
    # 58 without coupling (FIELD-NOTES' benchmark), and the coupled drive's Iam, Fvm, Fcm.
    assert len(tx40.names) == 61
    assert {"Iam6", "Fvm6", "Fcm6"} <= set(tx40.names)


def test_published_regrouping_of_the_first_joints(tx40: BaseParameters) -> None:
    # Published for this arm: Izz1 + Ia1 + Iyy2 + Iyy3 + 0.07 mz3 + 0.05185 (m3 + … + m6).
    first = dict(zip(tx40.names, range(len(tx40.names)), strict=True))["ZZ1R"]
    named = dict(zip(tx40.model.names, tx40.relation[first], strict=True))
    expected = {"ZZ1": 1, "Ia1": 1, "YY2": 1, "YY3": 1, "MZ3": 0.07} | {
        f"M{j}": 0.05185 for j in (3, 4, 5, 6)
    }
    present = {name: value for name, value in named.items() if value}
    assert present == pytest.approx(expected, abs=1e-9)


def test_base_columns_times_base_vector_is_the_full_torque(tx40: BaseParameters) -> None:
    model = tx40.model
    state = random_states(model.robot, seed=7, states=40)
    standard = np.random.default_rng(3).normal(size=len(model.names))
    full = model.columns(state) @ standard
    assert np.allclose(tx40.columns(state) @ tx40.regroup(standard), full, rtol=1e-8, atol=1e-8)


def test_any_seed_gives_the_same_set(tx40: BaseParameters) -> None:
    for seed in (1, 2, 3):
        other = base_parameters(tx40.model, seed=seed)
        assert np.array_equal(other.independent, tx40.independent)
        assert np.allclose(other.relation, tx40.relation, atol=1e-9)


def test_any_number_of_blas_threads_gives_the_same_set(tx40: BaseParameters) -> None:
    program = (
        "import robots; from ident import RegressorModel, base_parameters;"
        "base = base_parameters(RegressorModel.of(robots.load('tx40')));"
        "print(';'.join(base.expressions))"
    )
    for threads in ("1", "3"):
        variables = {f"{library}_NUM_THREADS": threads for library in ("OMP", "OPENBLAS", "MKL")}
        environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])} | variables
        printed = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
        )
        assert printed.stdout.strip() == ";".join(tx40.expressions), threads


def test_standard_vector_keeps_the_base_vector_and_stays_near_the_prior(tx40: BaseParameters) -> None:
    prior = tx40.model.prior()
    wanted = tx40.regroup(prior) * 1.1
    standard = tx40.standard_from(wanted, prior)
    assert np.allclose(tx40.regroup(standard), wanted, atol=1e-10)
    # Minimum norm: the shift has no part that the base vector cannot see.
    shift = standard - prior
    seen = np.linalg.pinv(tx40.relation) @ (tx40.relation @ shift)
    assert np.allclose(shift, seen, atol=1e-10)
    assert np.allclose(tx40.standard_from(tx40.regroup(prior), prior), prior, atol=1e-12)


def test_rigid_body_columns_agree_with_recursive_newton_euler() -> None:
    import pinocchio

    robot = robots.load("tx40")
    model = RegressorModel.of(robot)
    state = random_states(robot, seed=5, states=20)
    links = model.effects[0]
    pin_model = robots.rigid_body_model(robot)
    data = pin_model.createData()
    expected = np.array(
        [
            pinocchio.rnea(pin_model, data, q, v, a)
            for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True)
        ]
    )
    found = links.columns(state) @ robots.cad_parameters(pin_model)
    assert np.allclose(found, expected, rtol=1e-10, atol=1e-10)


def test_drive_parameters_give_the_torque_of_the_transmission() -> None:
    # Independent of the columns: friction and inertia act at the drive outputs, torques go back by Tᵀ.
    robot = robots.load("tx40")
    model = RegressorModel.of(robot)
    generator = np.random.default_rng(11)
    inertia, viscous, coulomb = (generator.uniform(0.5, 2.0, robot.n) for _ in range(3))
    state = random_states(robot, seed=9, states=30)
    transmission = robot.transmission_matrix
    speed = state.velocity @ transmission.T
    width = robot.identification.friction_width
    at_drives = (
        state.acceleration @ transmission.T * inertia + speed * viscous + np.tanh(speed / width) * coulomb
    )
    values = drive_parameters(robot, inertia, viscous, coulomb)
    found = model.columns(state) @ model.standard_parameters(values)
    assert np.allclose(found, at_drives @ transmission, rtol=1e-12, atol=1e-12)


def test_at_standstill_nothing_chatters() -> None:
    robot = robots.load("tx40")
    model = RegressorModel.of(robot)
    noise = np.random.default_rng(0).normal(scale=1e-5, size=(100, robot.n))
    state = State(np.zeros((100, robot.n)), noise, np.zeros((100, robot.n)))
    coulomb = [k for k, name in enumerate(model.names) if name.startswith("Fc")]
    assert np.abs(model.columns(state)[:, :, coulomb]).max() < 0.02


def test_expressions_in_print() -> None:
    names = ("a", "b", "c", "d", "e")
    assert (
        _expression(np.array([2.0, -1.0, 0.0, 1.0 + 1e-10, -0.51234567]), names) == "2 a − b + d − 0.512346 e"
    )
    assert _expression(np.array([0.0, -1.0, 0.5, 0.0, 0.0]), names) == "−b + 0.5 c"
    assert _expression(np.array([1.0 + 1e-6, 0.0, 0.0, 0.0, 0.0]), names) == "1 a"
    assert _expression(np.array([-2.5, 0.0, 0.0, 0.0, 1.0]), names) == "−2.5 a + e"


def test_a_column_that_depends_on_those_before_it_goes() -> None:
    """By less than 1e-6 of its norm; the order is kept."""
    e = np.eye(6)
    columns = [e[0], (e[0] + 0.9e-6 * e[1]), e[2], (e[0] + e[2]) / np.sqrt(2), (e[2] + 1.1e-6 * e[3]), e[4]]
    assert _independent_columns(np.column_stack(columns)).tolist() == [0, 2, 4, 5]


def test_relations_are_what_least_squares_says_and_rounding_is_none() -> None:
    """c = 3 a − 0.5 b in columns of sizes 10 and 0.1; 1e-8 of the columns' scale is rounding."""
    q = np.linalg.qr(np.random.default_rng(1).normal(size=(8, 3)))[0]
    a, b = 10.0 * q[:, 0], 0.1 * q[:, 1]
    rows = np.column_stack([a, b, 3.0 * a - 0.5 * b, a + 1e-8 * q[:, 1], np.zeros(8)])
    scale = np.linalg.norm(rows, axis=0)
    relation = _relation(rows, scale, np.array([0, 1]), np.array([0, 1, 2, 3]))
    expected = [[1.0, 0.0, 3.0, 1.0, 0.0], [0.0, 1.0, -0.5, 0.0, 0.0]]
    assert np.allclose(relation, expected, atol=1e-9)
    assert relation[1, 3] == 0.0
    assert relation[0, 2] == np.round(relation[0, 2], 12)


def test_random_states_fill_the_limits_and_leave_none() -> None:
    robot = robots.load("tx40")
    state = random_states(robot, 0, 4000)
    assert state.position.shape == state.velocity.shape == state.acceleration.shape == (4000, 6)
    middle, half = (robot.upper + robot.lower) / 2, (robot.upper - robot.lower) / 2
    for values, centre, limit in (
        (state.position, middle, half),
        (state.velocity, np.zeros(6), robot.velocity_limits),
        (state.acceleration, np.zeros(6), robot.acceleration_limits),
    ):
        share = (values - centre) / limit
        assert np.all(np.abs(share) <= 1.0)
        assert np.all(share.min(axis=0) < -0.99)
        assert np.all(share.max(axis=0) > 0.99)
    again = random_states(robot, 0, 4000)
    assert np.array_equal(again.velocity, state.velocity)
    assert not np.array_equal(random_states(robot, 1, 4000).velocity, state.velocity)


def test_names_and_units_belong_to_what_stays(tx40: BaseParameters) -> None:
    for row, name, column in zip(tx40.relation, tx40.names, tx40.independent, strict=True):
        assert row[column] == 1.0
        others = np.flatnonzero(row).size - 1
        assert name == tx40.model.names[column] + ("R" if others else "")
    standard = {name: float(k) for k, name in enumerate(tx40.model.names)}
    assert np.allclose(tx40.regroup(standard), tx40.relation @ np.arange(len(standard)))


def test_effects_that_are_added_have_base_parameters_of_their_own(emps: BaseParameters) -> None:
    """The last of two parameters of one effect, and both of the other: three rows more, with ones."""
    joint, friction = emps.model.effects[0], emps.model.effects[1:]
    added = [joint, *friction]
    more = sum(len(effect.parameters) for effect in added)
    kept = np.zeros(more, dtype=np.bool_)
    kept[[1, more - 2, more - 1]] = True
    base = emps.with_effects(added, kept)
    b, p = emps.relation.shape
    expected = np.zeros((b + 3, p + more))
    expected[:b, :p] = emps.relation
    expected[b, p + 1] = expected[b + 1, p + more - 2] = expected[b + 2, p + more - 1] = 1.0
    np.testing.assert_array_equal(base.relation, expected)
    np.testing.assert_array_equal(base.independent, [*emps.independent, p + 1, p + more - 2, p + more - 1])


def test_columns_of_which_none_depends_have_no_relation() -> None:
    rows = np.diag([2.0, 3.0])
    found = _relation(rows, np.array([2.0, 3.0]), np.array([0, 1]), np.array([0, 1]))
    np.testing.assert_array_equal(found, np.eye(2))


def test_a_column_is_judged_by_its_direction_and_not_by_its_size() -> None:
    """A parameter in a small unit is as independent as one in a large unit."""
    draws = np.random.default_rng(3).normal(size=(200, 1, 3))
    small = draws * np.array([1.0, 1e-6, 1.0])
    small[..., 2] = small[..., 0] + 1e3 * small[..., 1]

    class Model:
        robot = robots.load("emps")
        effects = ()

        def columns(self, state: State) -> np.ndarray:
            return small

    assert base_parameters(Model()).independent.tolist() == [0, 1]  # type: ignore[arg-type]
