"""Channels of a log beside positions and torques: measured forces, signals that were added, velocities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio

from daq.importing.import_map import Added, Force, ImportMap, Temperature, Velocity
from daq.importing.log_quantities import LogFiles, position_of_joints
from daq.recording.errors import CaptureError
from ident import Recording
from ident.listing import listed
from ident.preparation.resampling import Uniform
from ident.preparation.velocities import with_velocities
from robots import Robot, rigid_body_model
from robots.arrays import FloatArray

FORCE = 6
"""Three forces and three moments."""

VELOCITY_UNITS = {"rad/s": 1.0, "deg/s": np.pi / 180, "rpm": 2 * np.pi / 60, "m/s": 1.0, "mm/s": 1e-3}


def torque_from_outside(source: LogFiles, force: Force, robot: Robot, position: FloatArray) -> FloatArray:
    """Joint torques Jᵀ F of a measured wrench on the arm, samples × joints.

    Args:
        source: the log.
        force: where the wrench is, and on what it acts.
        robot: the arm.
        position: samples × joints.

    Raises:
        CaptureError: columns that are missing, or a frame that is none of the arm's links.
    """
    if len(force.columns) != FORCE:
        raise CaptureError(
            f"{source.path}: the column map gives {len(force.columns)} columns of force; allowed: {FORCE},"
            " three forces in N and three moments in N·m"
        )
    wrench = source.pick(force.file, force.columns)
    if len(wrench) != len(position):
        raise CaptureError(
            f"{source.path}: quantities differ in length: position {len(position)}, force {len(wrench)}"
            " samples"
        )
    model = rigid_body_model(robot)
    data, frame = model.createData(), _frame(source, force, model)
    axes = pinocchio.LOCAL if force.axes == "frame" else pinocchio.LOCAL_WORLD_ALIGNED
    torque = np.empty_like(position)
    for k, q in enumerate(position):
        jacobian = pinocchio.computeFrameJacobian(model, data, np.ascontiguousarray(q), frame, axes)
        torque[k] = jacobian.T @ wrench[k]
    return torque if force.acts == "on_arm" else -torque


def _frame(source: LogFiles, force: Force, model: pinocchio.Model) -> int:
    bodies = [k for k, f in enumerate(model.frames) if "BODY" in str(f.type) and f.parentJoint > 0]
    if force.frame is None:
        return bodies[-1]
    for k in bodies:
        if model.frames[k].name == force.frame:
            return k
    names = listed([model.frames[k].name for k in bodies], few=20)
    raise CaptureError(f'{source.path}: force.frame: "{force.frame}" is no moving link; allowed: {names}')


def added_signal(source: LogFiles, added: Added, robot: Robot, samples: int) -> FloatArray:
    """Control signal that was added behind the controller, samples × drives.

    Raises:
        CaptureError: columns that are missing, or as many as are no drives.
    """
    values = source.pick(added.file, added.columns) * added.scale
    if values.shape != (samples, robot.n):
        raise CaptureError(
            f"{source.path}: added: {values.shape[1]} columns of {len(values)} samples; allowed: {robot.n} of"
            f" {samples}"
        )
    return values


def temperature_of_drives(source: LogFiles, temperature: Temperature, robot: Robot) -> FloatArray:
    """Samples × drives, °C; of one column that of all.

    Raises:
        CaptureError: columns that are missing, or as many as are no drives.
    """
    values = source.pick(temperature.file, temperature.columns)
    if values.shape[1] not in (1, robot.n):
        raise CaptureError(
            f"{source.path}: the column map gives {values.shape[1]} columns of temperature; allowed: 1 or"
            f" {robot.n}"
        )
    return np.broadcast_to(values, (len(values), robot.n)).copy()


def joint_velocity(source: LogFiles, velocity: Velocity, robot: Robot, samples: int) -> FloatArray:
    """Measured joint velocities, samples × joints, rad/s (or m/s).

    Raises:
        CaptureError: columns that are missing, or as many as are no joints.
    """
    values = source.pick(velocity.file, velocity.columns) * VELOCITY_UNITS[velocity.unit]
    if values.shape != (samples, robot.n):
        raise CaptureError(
            f"{source.path}: velocity: {values.shape[1]} columns of {len(values)} samples; allowed:"
            f" {robot.n} of {samples}"
        )
    if velocity.ratio is not None:
        if len(velocity.ratio) != robot.n:
            raise CaptureError(
                f"{source.path}: velocity.ratio has {len(velocity.ratio)} entries; allowed: {robot.n}"
            )
        values = values / np.array(velocity.ratio)
    if velocity.side == "joint":
        return np.asarray(values)
    return np.asarray(np.linalg.solve(robot.transmission_matrix, values.T).T)


def channels_beside(
    source: LogFiles, columns: ImportMap, robot: Robot, position: FloatArray
) -> dict[str, FloatArray]:
    """Further channels of a log by name, samples × n each."""
    found = {}
    if columns.velocity is not None:
        found["velocity"] = joint_velocity(source, columns.velocity, robot, len(position))
    if columns.force is not None:
        found["outside"] = torque_from_outside(source, columns.force, robot, position)
    if columns.second_encoder is not None:
        found["second"] = position_of_joints(source, columns.second_encoder, robot)
    if columns.temperature is not None:
        found["temperature"] = temperature_of_drives(source, columns.temperature, robot)
    if columns.added is not None:
        found["added"] = added_signal(source, columns.added, robot, len(position))
    return found


def with_beside(even: Uniform, cutoff_hz: float) -> tuple[Recording, tuple[str, ...]]:
    """The recording with its further channels, and what the velocities are good for."""
    found = even.beside
    recording = replace(
        even.recording,
        outside=found.get("outside"),
        added=found.get("added"),
        second=found.get("second"),
        temperature=found.get("temperature"),
    )
    if "velocity" not in even.beside:
        return recording, ()
    name, time = recording.name, recording.time
    both = with_velocities(name, time, recording.position, even.beside["velocity"], cutoff_hz)
    return replace(recording, position=both.position), both.words
