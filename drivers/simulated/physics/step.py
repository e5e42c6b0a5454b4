"""One step of the plant, for the speeds first and then the positions (leapfrog: Störmer, Verlet).

Speeds are those of the instants between steps, positions those of the middles of steps: the state holds each
position half a step ahead of its speed. So a torque that is held over a step moves the arm exactly, and loads
act as in the middle of the step. What an encoder reads at an instant lies half a step of the speed there
before (``reading``); a reading without that is half a step early.

With w = T q̇ at the gear outputs, drives without compliance move with the joints:

    (M(q) + Tᵀ diag(Ia) T) q̈ = Tᵀ (τ − friction − brake) − loads(q, q̇).

A compliant drive has a rotor of its own, u = ṁ: Ia u̇ = τ − friction − brake − λ g, and the gear's torque g
acts on the joints by Tᵀ; λ = 1 − slope of the transmission error. Viscous friction enters as the mean of
old and new speed, dry friction, brakes and the gear's damping at the new one, so that none of them limits
the step or acts as extra inertia. Each rotor has one speed of its own, which is eliminated before the joints'
speeds are solved for. Where gears are stiff, the rotors, friction and gears take several substeps
while the posture's mass matrix and loads are kept.

Compiled code pays for every array that a call hands over: functions that run in each step take the few
arrays they need, or are written out where they are called.
"""

from __future__ import annotations

import math

from drivers.simulated.physics import base, chain, friction, gear, loads
from drivers.simulated.physics.compile import inlined, inner
from drivers.simulated.physics.records import Arm, Harmonics, Motion, Record, Records
from robots.arrays import BoolArray, FloatArray

FINE, NOT_POSITIVE_DEFINITE = 0, 1
_STANDSTILL = 1e-4
"""Speed below which engaged brakes hold for good, rad/s or m/s."""


@inlined
def reading(position: float, velocity: float, arm: Arm) -> float:
    """The position at the instant of the velocity, from that in the middle of the coming step."""
    return position - 0.5 * arm.step_time / arm.substeps * velocity


@inlined
def posture(arm: Arm, motion: Motion) -> None:
    """Mass matrix and loads of the links and joints in the middle of the coming step."""
    for j in range(len(motion.velocity)):
        motion.coming[j] = motion.velocity[j] + 0.5 * motion.right[j]
    chain.place(arm.chain, motion.position)
    chain.mass_matrix(arm.chain, motion.mass)
    chain.bias(arm.chain, motion.coming, motion.loads)
    if len(arm.base.stiffness) > 0:
        base.posture(arm.base, motion.rocking, motion.position, motion.coming, motion.mass, motion.loads)
    loads.add_joint_loads(
        arm.joints, motion.joints, motion.position, motion.velocity, motion.push, motion.loads
    )
    if arm.plane.stiffness > 0.0:
        loads.add_tool_contact(arm, motion)


@inlined
def _along(transmission: FloatArray, drive: int, joints: FloatArray) -> float:
    """Position or speed of a gear's output for those of the joints."""
    value = 0.0
    for j in range(len(joints)):
        value += transmission[drive, j] * joints[j]
    return value


@inner
def _push(drive: Record, motor: Record, braked: bool, step: float) -> tuple[float, float]:
    """What one step does to a rotor by itself: N·m·s, and the inertia that it acts on."""
    friction.linearise(drive, motor, motor.velocity, motor.position, braked, step)
    resisting = motor.dry + (motor.viscous + motor.slope) * motor.velocity
    inertia = drive.inertia + step * (0.5 * motor.viscous + motor.slope)
    return step * (motor.torque - resisting - motor.drag), inertia


@inner
def _through_gear(
    drive: Record, motor: Record, push: float, inertia: float, joining: float, step: float
) -> tuple[float, float]:
    """Eliminates the speed of a compliant drive's rotor: push and inertia that the joints see.

    Args:
        drive, motor: the drive; ``push`` and ``joining`` of the rotor are written for later.
        push: on the rotor, N·m·s.
        inertia: of the rotor.
        joining: the gear's damping times the step.
        step: s.
    """
    push -= step * motor.lever * motor.gear_torque
    whole = inertia + joining * motor.lever * motor.lever
    motor.push, motor.joining = push / whole, joining * motor.lever / whole
    return step * motor.gear_torque + motor.joining * push, joining * inertia / whole


@inner
def _couple_drives(
    drives: Records,
    motors: Records,
    transmission: FloatArray,
    kinematic: Harmonics,
    slip: FloatArray,
    braked: BoolArray,
    position: FloatArray,
    velocity: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
    step: float,
) -> None:
    """Adds the drives to the linear equations ``matrix · change of the joints' speeds = right``."""
    n = len(velocity)
    for i in range(len(drives)):
        drive, motor = drives[i], motors[i]
        speed = _along(transmission, i, velocity)
        shaft = _along(transmission, i, position)
        if not drive.compliant:
            motor.velocity, motor.position = speed, shaft
        push, inertia = _push(drive, motor, braked[i], step)
        if drive.compliant:
            damping = gear.prepare(drive, i, motor, slip[i], kinematic, shaft, speed)
            push, inertia = _through_gear(drive, motor, push, inertia, step * damping, step)
        for j in range(n):
            share = transmission[i, j]
            if share != 0.0:
                right[j] += share * push
                for k in range(n):
                    matrix[j, k] += share * inertia * transmission[i, k]


@inner
def _solve(matrix: FloatArray, right: FloatArray) -> bool:
    """Solves in place by Cholesky's decomposition; False where the matrix is not positive definite."""
    n = len(right)
    for j in range(n):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        if not pivot > 0.0:
            return False
        root = math.sqrt(pivot)
        matrix[j, j] = root
        for i in range(j + 1, n):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = value / root
        value = right[j]
        for k in range(j):
            value -= matrix[j, k] * right[k]
        right[j] = value / root
    for back in range(n):
        j = n - 1 - back
        value = right[j]
        for k in range(j + 1, n):
            value -= matrix[k, j] * right[k]
        right[j] = value / matrix[j, j]
    return True


@inner
def _move_drives(
    drives: Records,
    motors: Records,
    transmission: FloatArray,
    kinematic: Harmonics,
    slip: FloatArray,
    dragged: FloatArray,
    position: FloatArray,
    right: FloatArray,
    step: float,
) -> None:
    """Rotors, bristles and gears after the changes of the joints' speeds, ``right``, are known."""
    for i in range(len(drives)):
        drive, motor = drives[i], motors[i]
        before = motor.position
        change = _along(transmission, i, right)
        shaft = _along(transmission, i, position)
        if drive.compliant:
            change = motor.push + motor.joining * change
            motor.position += step * (motor.velocity + change)
            gear.wind(drive, i, motor, slip[i], kinematic, shaft)
        else:
            motor.position = shaft
            resisting = motor.dry + motor.slope * (motor.velocity + change) + motor.viscous * motor.velocity
            motor.gear_torque = motor.torque - resisting - motor.drag - drive.inertia * change / step
        if drive.drag_stiffness > 0.0:
            mean = gear.slide(dragged[i], motor.position - before, drive.drag_stretch)
            motor.drag = drive.drag_stiffness * mean
        motor.velocity += change
        motor.last_change = change
        friction.advance(drive, motor, motor.velocity)


@inlined
def _substep(arm: Arm, motion: Motion, step: float) -> bool:
    """Speeds and positions by one substep; False where the mass matrix is not positive definite."""
    n = len(motion.velocity)
    for j in range(n):
        motion.right[j] = -step * motion.loads[j]
        for k in range(n):
            motion.matrix[j, k] = motion.mass[j, k]
    if len(arm.base.stiffness) > 0:
        base.eliminate(arm.base, motion.rocking, motion.matrix, motion.right, step)
    _couple_drives(
        arm.drives,
        motion.motors,
        arm.transmission,
        arm.kinematic,
        motion.slip,
        motion.braked,
        motion.position,
        motion.velocity,
        motion.matrix,
        motion.right,
        step,
    )
    fine = _solve(motion.matrix, motion.right)
    if fine:
        for j in range(n):
            motion.velocity[j] += motion.right[j]
            motion.position[j] += step * motion.velocity[j]
        if len(arm.base.stiffness) > 0:
            base.follow(arm.base, motion.rocking, motion.right, step)
        _move_drives(
            arm.drives,
            motion.motors,
            arm.transmission,
            arm.kinematic,
            motion.slip,
            motion.dragged,
            motion.position,
            motion.right,
            step,
        )
    return fine


@inner
def _age(drives: Records, motors: Records, clock: FloatArray, step: float) -> None:
    """Loads, temperatures and whatever else changes slowly, by one step."""
    for i in range(len(drives)):
        drive, motor = drives[i], motors[i]
        if drive.load_rise != 0.0 or drive.driven_rise != 0.0 or drive.load_square != 0.0:
            motor.load += -math.expm1(-step / drive.load_time) * (motor.gear_torque - motor.load)
        friction.age(drive, motor, motor.velocity, clock[0], step)
    clock[0] += step


@inner
def settled(drives: Records, motors: Records, transmission: FloatArray, velocity: FloatArray) -> bool:
    """Whether rotors and gear outputs stand still."""
    fastest = 0.0
    for i in range(len(drives)):
        fastest = max(fastest, abs(motors[i].velocity), abs(_along(transmission, i, velocity)))
    return fastest < _STANDSTILL


@inner
def _rest(motors: Records, joints: Records, velocity: FloatArray, right: FloatArray) -> None:
    """Ends all motion."""
    for i in range(len(motors)):
        motor = motors[i]
        motor.velocity, motor.last_change, motor.bristle = 0.0, 0.0, 0.0
    for j in range(len(velocity)):
        velocity[j], right[j] = 0.0, 0.0
        joints[j].slosh_velocity = 0.0


@inlined
def advance(arm: Arm, motion: Motion) -> int:
    """Moves the plant by one step under the motors' torques; FINE or NOT_POSITIVE_DEFINITE."""
    state = FINE
    if not motion.at_rest[0]:
        posture(arm, motion)
        for _ in range(arm.substeps):
            if state == FINE and not _substep(arm, motion, arm.step_time / arm.substeps):
                state = NOT_POSITIVE_DEFINITE
        loads.bend_packs(arm.joints, motion.joints, motion.velocity, arm.step_time)
        loads.move_sloshing(arm.joints, motion.joints, motion.position, motion.velocity, arm.step_time)
        _age(arm.drives, motion.motors, motion.clock, arm.step_time)
        if motion.braked.all() and settled(arm.drives, motion.motors, arm.transmission, motion.velocity):
            _rest(motion.motors, motion.joints, motion.velocity, motion.right)
            motion.rocking[1:] = 0.0
            motion.at_rest[0] = True
    return state
