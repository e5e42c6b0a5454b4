"""What engines make of exported files."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from ident.effects import State

mujoco = pytest.importorskip("mujoco", reason="MuJoCo has no wheel for this platform")

SHARE = 0.01
"""Of torque in norm, per joint: what issue and docs promise."""


def assert_same(theirs: np.ndarray, ours: np.ndarray, share: float = SHARE) -> None:
    away = np.linalg.norm(theirs - ours, axis=0) / np.linalg.norm(ours, axis=0)
    assert len(ours) > 200
    assert (away < share).all(), away


def inverse_dynamics(path: Path, state: State) -> np.ndarray:
    """MuJoCo's torque (samples, joints) of an MJCF file, with what its actuators take off."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data, found = mujoco.MjData(model), []
    for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    # The actuators take the offset off their control: what a drive has to give is force + offset.
    mujoco.mj_forward(model, data)
    return np.array(found) - data.qfrc_actuator


def torque_in_drake(path: Path, state: State) -> np.ndarray:
    """Torque (samples, joints) of an SDF that Drake has read by libsdformat, Gazebo's own reader.

    Drake has no dry friction at a joint: that of the file is added.
    """
    parsing = pytest.importorskip("pydrake.multibody.parsing", reason="Drake has no wheel for this platform")
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import MultibodyForces

    plant = MultibodyPlant(0.0)
    parsing.Parser(plant).AddModels(str(path))
    plant.Finalize()
    context, found = plant.CreateDefaultContext(), []
    for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True):
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)  # gravity, damping, springs
        found.append(plant.CalcInverseDynamics(context, a, forces))
    friction = [
        float(one.text or "nan") for one in ET.parse(path).iterfind(".//joint/axis/dynamics/friction")
    ]
    return np.array(found) + np.array(friction) * np.sign(state.velocity)


def imported(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module: ModuleType = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
