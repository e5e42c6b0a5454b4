"""The compiled dynamics of serial chains against Pinocchio."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio
import pytest

import robots
from ident.effects.chain import chain_frames
from ident.effects.link_columns import link_columns
from ident.kernels.friction import WORK_ROWS, friction, implicit_step
from ident.kernels.rigid_bodies import is_positive_definite, mass_and_bias
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel


def random_chain(seed: int) -> pinocchio.Model:
    """Five links on joints of all kinds, axes in any direction."""
    generator = np.random.default_rng(seed)
    axes = generator.normal(size=(2, 3))
    joints = [
        pinocchio.JointModelRevoluteUnaligned(axes[0] / np.linalg.norm(axes[0])),
        pinocchio.JointModelPX(),
        pinocchio.JointModelRY(),
        pinocchio.JointModelPrismaticUnaligned(axes[1] / np.linalg.norm(axes[1])),
        pinocchio.JointModelRX(),
    ]
    model = pinocchio.Model()
    model.gravity.linear = generator.normal(size=3) * 5
    for parent, joint in enumerate(joints):
        pinocchio.seed(seed * 100 + parent)
        link = model.addJoint(parent, joint, pinocchio.SE3.Random(), f"joint_{parent + 1}")
        model.inertias[link] = pinocchio.Inertia.Random()
    return model


MODELS = {
    "tx40": lambda: robots.rigid_body_model(robots.load("tx40")),
    "emps": lambda: robots.rigid_body_model(robots.load("emps")),
    "any axes": lambda: random_chain(7),
    "other axes": lambda: random_chain(8),
}


def evaluate(
    frames: np.ndarray, links: np.ndarray, model: pinocchio.Model, q: np.ndarray, *others: np.ndarray
) -> None:
    turn = np.column_stack([np.cos(q), np.sin(q)])
    gravity = np.array(model.gravity.linear)
    mass_and_bias(tuple(range(q.size)), frames, links, gravity, q, turn, *others)


@pytest.mark.parametrize("name", MODELS)
def test_mass_matrix_and_bias_are_those_of_pinocchio(name: str) -> None:
    model = MODELS[name]()
    data, n = model.createData(), model.nv
    frames = chain_frames(model)
    assert frames is not None
    links = robots.cad_parameters(model).reshape(n, 10)
    generator = np.random.default_rng(1)
    for _ in range(50):
        q, v = generator.normal(size=n) * 2, generator.normal(size=n) * 3
        mass, bias, work = np.full((n, n), np.nan), np.full(n, np.nan), np.full((n, 22), np.nan)
        evaluate(frames, links, model, q, v, mass, bias, work)
        upper = pinocchio.crba(model, data, q)
        expected = np.triu(upper) + np.triu(upper, 1).T
        assert np.abs(mass - expected).max() <= 1e-12 * np.abs(expected).max()
        forces = pinocchio.nonLinearEffects(model, data, q, v)
        assert np.abs(bias - forces).max() <= 1e-12 * max(np.abs(forces).max(), 1e-3)


def test_dynamics_are_linear_in_parameters_without_mass() -> None:
    """Standard parameters of an identification need not belong to a body: no mass, negative moments."""
    model = random_chain(3)
    data, n = model.createData(), model.nv
    frames = chain_frames(model)
    assert frames is not None
    generator = np.random.default_rng(2)
    links = generator.normal(size=(n, 10))
    links[2, 0] = 0.0
    q, v, a = generator.normal(size=(3, n))
    mass, bias, work = np.empty((n, n)), np.empty(n), np.empty((n, 22))
    evaluate(frames, links, model, q, v, mass, bias, work)
    regressor = pinocchio.computeJointTorqueRegressor(model, data, q, v, a)
    np.testing.assert_allclose(mass @ a + bias, regressor @ links.ravel(), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", MODELS)
def test_columns_of_links_are_those_of_pinocchio(name: str) -> None:
    model = MODELS[name]()
    data, n = model.createData(), model.nv
    frames, gravity = chain_frames(model), np.array(model.gravity.linear)
    assert frames is not None
    motion = np.random.default_rng(4).normal(size=(3, 20, n)) * 2.0
    rows = [pinocchio.computeJointTorqueRegressor(model, data, *motion[:, k]) for k in range(20)]
    expected = np.stack(rows).reshape(20, n, 10 * n)
    for first in (0, n - 1):
        columns = np.zeros((20, n, 10 * (n - first)))
        link_columns(frames, gravity, *motion, first, columns)
        np.testing.assert_allclose(columns, expected[:, :, 10 * first :], rtol=1e-11, atol=1e-11)


def test_another_gravity_is_held_as_pinocchio_holds_it() -> None:
    """As a tilted base has it."""
    usual = RegressorModel.of(robots.load("tx40"))
    present = Present(usual, usual.prior())
    gravity = np.array([1.0, -2.0, -9.0])
    position = np.random.default_rng(6).normal(size=(20, 6))
    model = present._links()
    model.gravity.linear = gravity
    data = model.createData()
    expected = [pinocchio.computeGeneralizedGravity(model, data, q) for q in position]
    np.testing.assert_allclose(present.gravity_torque(position, gravity), expected, atol=1e-11)
    assert np.abs(expected).max() > 10.0


def test_a_branched_model_has_no_chain() -> None:
    model = pinocchio.Model()
    for name in ("left", "right"):
        model.addJoint(0, pinocchio.JointModelRZ(), pinocchio.SE3.Identity(), name)
    assert chain_frames(model) is None


def test_a_matrix_is_positive_definite_when_its_eigenvalues_are() -> None:
    generator = np.random.default_rng(5)
    verdicts = []
    for shift in np.linspace(-2.0, 2.0, 41):
        half = generator.normal(size=(4, 4))
        matrix = half + half.T + 2.0 * shift * np.eye(4)
        verdicts.append(bool(np.linalg.eigvalsh(matrix)[0] > 0))
        assert is_positive_definite((0, 1, 2, 3), matrix, np.empty((4, 4))) is verdicts[-1]
    assert any(verdicts) and not all(verdicts)
    assert not is_positive_definite((0, 1), np.full((2, 2), np.nan), np.empty((2, 2)))


def solved(width: float, v: np.ndarray, push: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Two coupled axes with three friction terms: the new velocity and what is left of the equation."""
    implicit = np.array([[1.0, 0.3], [0.3, 0.2]])
    speed = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    torque = speed * np.array([[5.0], [2.0], [1.5]])
    terms = np.column_stack([np.full(3, 1 / width), np.zeros((3, 3)), speed, torque])
    spans = np.array([[0, 1, 0, 1], [1, 2, 1, 2], [0, 2, 0, 2]])
    new, work = v.copy(), np.zeros((WORK_ROWS, 3))
    work[0, :2] = v
    friction(terms, spans, None, work, 0, 7)
    row = implicit_step(
        (0, 1), terms, spans, np.ones(3), np.ones(3), None, implicit, push, new, h, np.empty((2, 2)), work, 7
    )
    # What is handed on to the next step belongs to the new velocity.
    np.testing.assert_allclose(work[row], speed @ new / width, rtol=1e-12, atol=1e-12)
    return new, implicit @ (new - v) + h * np.tanh(speed @ new / width) @ torque - push


@pytest.mark.parametrize("width", [1e-6, 1e-3, 0.1])
def test_the_implicit_step_satisfies_its_equation(width: float) -> None:
    generator = np.random.default_rng(9)
    for _ in range(200):
        v, push = (
            generator.normal(size=2) * generator.choice([1e-6, 1e-3, 1.0]),
            generator.normal(size=2) * 1e-3,
        )
        _, rest = solved(width, v, push, 1e-3)
        assert np.abs(rest).max() <= 1e-9 * max(np.abs(push).max(), 5e-3)


def test_friction_holds_what_it_can_hold() -> None:
    new, _ = solved(1e-6, np.array([1e-4, -1e-4]), np.array([2e-3, 0.5e-3]), 1e-3)
    assert np.abs(new).max() < 1e-6


def test_chain_constants_are_rotations() -> None:
    frames = chain_frames(random_chain(4))
    assert frames is not None
    for first, second in pairwise(frames):
        for row in (first, second):
            turned = (row[:9] + row[9:18] * np.cos(0.7) + row[18:27] * np.sin(0.7)).reshape(3, 3)
            still = row[:9].reshape(3, 3)
            rotation = turned if row[36] else still
            np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
