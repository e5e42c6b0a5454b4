"""Hidden in a plant that nobody of this project wrote: MuJoCo. Short form of benchmarks/naming_mujoco.py."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio
import pytest

pytest.importorskip("mujoco", reason="MuJoCo has no wheel for this platform")

import mujoco

import robots
from benchmarks.mujoco_arm import NOTHING, Hidden, build, on, record, without_noise
from benchmarks.naming_mujoco import KINDS, draw, search
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from ident import Recording
from ident.discrepancy import Diagnosis
from robots import Robot, rigid_body_model


@cache
def arm() -> Robot:
    return robots.load("tx40")


@cache
def truth() -> PlantTruth:
    return draw_truth(arm(), 41)


def recorded(hidden: Hidden, motion: int, seed: int) -> Recording:
    return record(arm(), truth(), exercise(arm(), duration=8.0, seed=motion), hidden, seed=seed)


@cache
def diagnosed(hidden: Hidden) -> Diagnosis:
    accepted, fit, validation = recorded(NOTHING, 0, 1), recorded(hidden, 0, 2), recorded(hidden, 1, 3)
    return search(arm(), accepted, fit, validation)


def test_it_is_the_arm_of_the_description() -> None:
    model, states = build(arm(), truth()), np.random.default_rng(0)
    data, ours = mujoco.MjData(model), rigid_body_model(arm())
    for link in range(1, arm().n + 1):
        ours.inertias[link] = pinocchio.Inertia.FromDynamicParameters(truth().link(link))
    rotors = arm().transmission_matrix.T @ np.diag(truth().per_drive("Ia")) @ arm().transmission_matrix
    for _ in range(5):
        data.qpos[:], data.qvel[:] = states.uniform(-1.5, 1.5, (2, arm().n))
        mujoco.mj_forward(model, data)
        mass = np.zeros((arm().n, arm().n))
        mujoco.mj_fullM(model, data, mass)
        work = ours.createData()
        expected = pinocchio.crba(ours, work, np.array(data.qpos)) + rotors
        np.testing.assert_allclose(mass, expected, rtol=1e-6, atol=1e-8)
        bias = pinocchio.rnea(ours, work, np.array(data.qpos), np.array(data.qvel), np.zeros(arm().n))
        np.testing.assert_allclose(data.qfrc_bias, bias, rtol=1e-6, atol=1e-6)


def test_it_moves_as_the_project_s_own_plant_does() -> None:
    quiet = without_noise(truth())
    path = exercise(arm(), duration=4.0, seed=0)
    theirs = record(arm(), quiet, path, periods=1)
    ours = simulate_offline(arm(), quiet, path)
    difference = np.sqrt(np.mean((theirs.position - ours.position) ** 2, axis=0))
    following = np.sqrt(np.mean((ours.reference - ours.position) ** 2, axis=0))
    assert (difference < 0.05 * following).all(), difference / following
    # The same path with half of the friction gone is another motion.
    loose = record(arm(), quiet, path, Hidden(friction=on(arm(), 2, -3.0)), periods=1)
    assert np.abs(loose.position - theirs.position)[:, 2].max() > 3 * np.abs(difference[2])


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("nothing", "tendon coupling")])
def test_what_is_hidden_moves_the_arm_otherwise(kind: str) -> None:
    quiet = without_noise(truth())
    path = exercise(arm(), duration=2.0, seed=0)
    hidden, _, size = draw(arm(), quiet, kind, seed=3)
    assert size != 0.0
    usual, other = (record(arm(), quiet, path, what, periods=1) for what in (NOTHING, hidden))
    change = np.abs(other.control_signal - usual.control_signal).max(axis=0)
    assert change.max() > 0.005, change


@pytest.mark.slow
def test_nothing_hidden_gets_no_name() -> None:
    assert diagnosed(NOTHING).findings == ()


@pytest.mark.slow
def test_a_payload_is_named_and_weighed() -> None:
    found = diagnosed(Hidden(payload=(0.8, 0.02, -0.01, 0.06)))
    assert [(finding.effect, finding.joints) for finding in found.findings] == [("payload", ())]
    mass = next(p for p in found.findings[0].parameters if p.name == "M_payload")
    assert mass.value == pytest.approx(0.8, abs=0.08)
