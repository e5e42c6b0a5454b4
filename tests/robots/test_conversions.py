"""Control signal, torque, counts and names: conversions that must invert each other."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import robots
from robots.arrays import FloatArray
from robots.standard import EITHER_UNIT, torque_unit, torque_units_of

TX40 = robots.load("tx40")
values = st.floats(-10, 10)


@given(arrays(np.float64, st.tuples(st.integers(1, 5), st.just(6)), elements=values))
def test_torque_and_control_signal_are_inverse(control_signal: FloatArray) -> None:
    torque = TX40.joint_torque(control_signal)
    np.testing.assert_allclose(TX40.control_signal(torque), control_signal, rtol=1e-12, atol=1e-12)


@given(arrays(np.float64, 6, elements=values))
def test_one_sample_may_be_a_vector(control_signal: FloatArray) -> None:
    torque = TX40.joint_torque(control_signal)
    assert torque.shape == TX40.control_signal(torque).shape == (6,)
    np.testing.assert_array_equal(torque, TX40.joint_torque(control_signal[np.newaxis])[0])


@given(arrays(np.float64, 6, elements=values), arrays(np.float64, 6, elements=values))
def test_virtual_work(control_signal: FloatArray, joint_velocity: FloatArray) -> None:
    """What the drives give is what the joints take: τᵀq̇ = τ_dᵀ(T q̇)."""
    drive_velocity = TX40.transmission_matrix @ joint_velocity
    at_drives = (TX40.gains * control_signal) @ drive_velocity
    assert TX40.joint_torque(control_signal) @ joint_velocity == pytest.approx(at_drives, rel=1e-12, abs=1e-9)


def test_wrist_coupling_has_the_published_sign() -> None:
    """Motor 6 turns with q5 + q6, so its torque acts on joint 5 too."""
    torque = TX40.joint_torque(np.array([0, 0, 0, 0, 0, 1.0]))
    np.testing.assert_allclose(torque, [0, 0, 0, 0, 6.56, 6.56])


@given(st.integers(-(2**31), 2**31 - 1), st.sampled_from(range(6)))
def test_counts_survive_the_way_to_radians_and_back(counts: int, drive: int) -> None:
    per_unit = TX40.counts_per_output_unit[drive]
    assert round(counts / per_unit * per_unit) == counts


def test_names_and_units() -> None:
    names = robots.link_parameter_names(2)
    assert len(names) == len(set(names)) == 20
    assert names[0] == "M1" and names[10] == "M2" and names[-1] == "ZZ2"
    assert robots.drive_parameter_names(2)[4:] == ("Ia2", "Fv2", "Fc2", "off2")
    units = {symbol: robots.unit_of(symbol, "revolute") for symbol in ("M", "MY", "XZ", "Fv", "Fvm", "Fc")}
    assert units["M"] == "kg" and units["MY"] == "kg·m" and units["XZ"] == "kg·m²"
    assert units["Fv"] == units["Fvm"] == "N·m·s/rad" and units["Fc"] == "N·m"
    assert [robots.unit_of(symbol, "prismatic") for symbol in ("Ia", "Fv", "Fc", "off")] == [
        "kg",
        "N·s/m",
        "N",
        "N",
    ]


def test_the_unit_of_a_joints_torque_is_known_from_a_model_without_its_arm() -> None:
    assert [joint.torque_unit for joint in robots.load("emps").joint] == [torque_unit("prismatic")] == ["N"]
    assert TX40.joint[0].torque_unit == torque_unit("revolute") == "N·m"
    units = {"ZZ1R": "kg·m²", "Fc1": "N·m", "Fv2": "N·s/m", "Iam3": "kg", "Fc5": "km"}
    assert torque_units_of(units, 5) == ("N·m", "N", "N", EITHER_UNIT, EITHER_UNIT)


@pytest.mark.parametrize("symbol", ["Fv1", "Fvx", "Q", "", "3"])
def test_a_symbol_that_is_no_parameter(symbol: str) -> None:
    with pytest.raises(KeyError):
        robots.unit_of(symbol, "revolute")


def test_cad_parameters_are_the_linear_ones() -> None:
    """Their order is the order of Pinocchio's regressor columns: τ = Y(q, q̇, q̈) π."""
    model = robots.rigid_body_model(TX40)
    data = model.createData()
    q, velocity, acceleration = np.random.default_rng(5).uniform(-2, 2, (3, 6))
    regressor = pinocchio.computeJointTorqueRegressor(model, data, q, velocity, acceleration)
    torque = pinocchio.rnea(model, data, q, velocity, acceleration)
    np.testing.assert_allclose(regressor @ robots.cad_parameters(model), torque, atol=1e-12)


def test_gravity_of_robot_toml_is_the_models() -> None:
    tilted = TX40.model_copy(update={"gravity": (1.0, 2.0, 3.0)})
    np.testing.assert_array_equal(robots.rigid_body_model(tilted).gravity.linear, [1.0, 2.0, 3.0])


def test_rigid_body_model_refuses_other_joints() -> None:
    joint = TX40.joint[5].model_copy(update={"name": "elsewhere"})
    other = TX40.model_copy(update={"joint": (*TX40.joint[:5], joint)})
    with pytest.raises(robots.RobotFileError, match="has the moving joints joint_1"):
        robots.rigid_body_model(other)
