"""The arm in MuJoCo: a plant that nobody of this project wrote, with effects of MuJoCo's own hidden in it.

The shipped URDF gives kinematics and links; each drive is a fixed tendon over the joints that it moves, with
armature (rotor inertia), damping and frictionloss, and an actuator on it. MuJoCo's dry friction is a
constraint of its solver, with neither a tanh nor bristles; its integrator, spring, actuator delay and
current-loop filter are its own, too. Only the position loop in the drives is the project's: the arm's
controller as the description gives it, at its sample time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pinocchio

from drivers.simulated import PlantTruth
from drivers.simulated.control_loop import ControlLoop
from ident import Recording
from ident.preparation.set_points import set_points
from robots import Robot
from robots.arrays import FloatArray

STEP = 0.00025
"""s; of MuJoCo's integrator."""


@dataclass(frozen=True)
class Hidden:
    """What the arm has besides; joints and drives count from 0. All of it is absent by default.

    Attributes:
        damping, friction, armature: per drive, added to Fv, Fc and Ia.
        spring: (joint, stiffness N·m/rad, rest position rad).
        payload: (mass kg, x, y, z of its centre in the last link's frame, m).
        gain: (drive, relative error of its torque).
        delay: (drive, s) from control signal to torque.
        lag: (drive, s) time constant of its current loop.
    """

    damping: tuple[float, ...] | None = None
    friction: tuple[float, ...] | None = None
    armature: tuple[float, ...] | None = None
    spring: tuple[int, float, float] | None = None
    payload: tuple[float, float, float, float] | None = None
    gain: tuple[int, float] | None = None
    delay: tuple[int, float] | None = None
    lag: tuple[int, float] | None = None


NOTHING = Hidden()


def build(robot: Robot, truth: PlantTruth, hidden: Hidden = NOTHING) -> mujoco.MjModel:
    """The arm as a MuJoCo model.

    Args:
        robot: description: URDF, transmission, gravity.
        truth: the links' inertials, drives and gains of the arm that is built.
        hidden: what it has besides.
    """
    spec = mujoco.MjSpec.from_file(str(robot.urdf_path))
    spec.option.gravity = robot.gravity
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for geom in spec.geoms:  # links that overlap by design would push each other apart
        geom.contype = geom.conaffinity = 0
    for number, joint in enumerate(robot.joint, start=1):
        moved = spec.joint(joint.name)
        moved.limited = 0
        _set_inertia(moved.parent, truth.link(number))
    if hidden.payload is not None:
        _add_payload(spec.joint(robot.joint[-1].name).parent, hidden.payload)
    if hidden.spring is not None:
        joint, stiffness, rest = hidden.spring
        sprung = spec.joint(robot.joint[joint].name)
        sprung.stiffness, sprung.springref = [stiffness, 0.0, 0.0], rest
    for drive in range(robot.n):
        _add_drive(spec, robot, truth, drive, hidden)
    return spec.compile()


def _set_inertia(body: mujoco.MjsBody, dynamic: FloatArray) -> None:
    """The ten parameters of a link in pinocchio's order."""
    inertia = pinocchio.Inertia.FromDynamicParameters(dynamic)
    body.explicitinertial = True
    body.mass, body.ipos = inertia.mass, inertia.lever
    i = inertia.inertia
    body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


def _add_payload(body: mujoco.MjsBody, payload: tuple[float, float, float, float]) -> None:
    """A massive ball on the last link."""
    mass, *centre = payload
    ball = body.add_body(name="payload", pos=centre)
    ball.explicitinertial = True
    ball.mass, ball.inertia = mass, [1e-3 * mass] * 3


def _add_drive(spec: mujoco.MjSpec, robot: Robot, truth: PlantTruth, drive: int, hidden: Hidden) -> None:
    """The output of one drive as a tendon over the joints that it moves, and its motor."""
    name = f"drive_{drive + 1}"
    tendon = spec.add_tendon(name=name)
    for joint, turns in zip(robot.joint, robot.transmission_matrix[drive], strict=True):
        if turns:
            tendon.wrap_joint(joint.name, turns)

    def figure(symbol: str, more: tuple[float, ...] | None) -> float:
        return float(truth.per_drive(symbol)[drive]) + (0.0 if more is None else more[drive])

    tendon.armature = figure("Ia", hidden.armature)
    tendon.damping = [figure("Fv", hidden.damping), 0.0, 0.0]
    tendon.frictionloss = figure("Fc", hidden.friction)
    # Dry friction as stiff as the solver allows; by default it gives way for 20 ms at each reversal.
    tendon.solref_friction = [2.0 * STEP, 1.0]
    tendon.solimp_friction = [0.99, 0.9999, 0.001, 0.5, 2.0]
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_TENDON)
    motor.set_to_motor()
    wrong = hidden.gain[1] if hidden.gain is not None and hidden.gain[0] == drive else 0.0
    motor.gear[0] = truth.gain[drive] * (1.0 + wrong)
    if hidden.lag is not None and hidden.lag[0] == drive:
        motor.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        motor.dynprm[0] = hidden.lag[1]
    if hidden.delay is not None and hidden.delay[0] == drive:
        motor.delay = hidden.delay[1]
        motor.nsample = round(hidden.delay[1] / STEP) + 2


def record(
    robot: Robot,
    truth: PlantTruth,
    reference: FloatArray,
    hidden: Hidden = NOTHING,
    *,
    periods: int = 2,
    seed: int = 0,
    name: str = "mujoco",
) -> Recording:
    """Stream a reference to the arm, from rest at its first point, and record as a master would.

    Args:
        robot: the description; its controller closes the loop.
        truth: the arm; its noise levels too.
        reference: (N, n) joint positions, one row per SYNC; begins and ends at rest.
        hidden: what the arm has besides.
        periods: how often the reference is repeated.
        seed: of the noise.
        name: of the recording.
    """
    model = build(robot, truth, hidden)
    data = mujoco.MjData(model)
    rows = np.tile(reference, (periods, 1))
    drives = robot.transmission_matrix
    per_sample = round(robot.bus.cycle_time / robot.controller.sample_time)
    points, speeds = set_points(robot, rows @ drives.T, robot.bus.cycle_time, per_sample)
    counts = robot.counts_per_output_unit
    loop = ControlLoop(robot.controller, counts)
    data.qpos[:] = rows[0]
    offset = truth.per_drive("off")
    mujoco.mj_forward(model, data)
    holding = np.linalg.solve(drives.T, data.qfrc_bias + offset) / np.array(truth.gain)
    everything = np.ones(robot.n, dtype=np.bool_)
    loop.reset(everything, drives @ rows[0], holding)
    data.qfrc_applied[:] = -offset
    noise = np.random.default_rng(seed)
    steps = round(robot.controller.sample_time / STEP)
    found = np.empty((2, len(rows), robot.n))
    for sample in range(len(points)):
        reading = np.rint((drives @ data.qpos + noise.normal(0.0, truth.encoder_noise)) * counts) / counts
        signal = loop.step(points[sample], speeds[sample], reading)
        if sample % per_sample == 0:
            found[:, sample // per_sample] = reading, signal
        for _ in range(steps):
            # Process torque: new at each step of the plant, as the description of the arm has it.
            data.qfrc_applied[:] = drives.T @ noise.normal(0.0, truth.torque_noise) - offset
            data.ctrl[:] = signal
            mujoco.mj_step(model, data)
    position = found[0] @ np.linalg.inv(drives).T
    resolution = np.array([drive.control_signal.per_count for drive in robot.drive])
    recorded = np.rint(found[1] / resolution) * resolution
    return Recording(name, np.arange(len(rows)) * robot.bus.cycle_time, rows, position, recorded)


def on(robot: Robot, drive: int, value: float) -> tuple[float, ...]:
    """One figure per drive that is zero but for one drive (from 0)."""
    return tuple(value if other == drive else 0.0 for other in range(robot.n))


def without_noise(truth: PlantTruth) -> PlantTruth:
    """The same arm without noise, for checks of the physics."""
    nothing = (0.0,) * len(truth.gain)
    return replace(truth, torque_noise=nothing, encoder_noise=nothing)
