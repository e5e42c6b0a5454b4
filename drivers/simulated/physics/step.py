"""One step of the plant, for the speeds first and then the positions (symplectic Euler).

With w = T q̇ at the gear outputs, drives without compliance move with the joints:

    (M(q) + Tᵀ diag(Ia) T) q̈ = Tᵀ (τ − friction − brake) − loads(q, q̇).

A compliant drive has a rotor of its own, u = ṁ: Ia u̇ = τ − friction − brake − λ g, and the gear's torque g
acts on the joints by Tᵀ; λ = 1 − slope of the transmission error. Viscous friction enters as the mean of
old and new speed, dry friction, brakes and the gear's damping at the new one, so that none of them limits
the step or acts as extra inertia. Each rotor has one speed of its own, which is eliminated before the joints'
speeds are solved for. Where gears are stiff, the rotors, friction and gears take several substeps
while the posture's mass matrix and loads are kept.
"""

from __future__ import annotations

import math

from drivers.simulated.physics import chain, friction, gear, loads
from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Arm, Motion
from robots.arrays import FloatArray

FINE, NOT_POSITIVE_DEFINITE = 0, 1
_STANDSTILL = 1e-4
"""Speed below which engaged brakes hold for good, rad/s or m/s."""


@inner
def posture(arm: Arm, motion: Motion) -> None:
    """Mass matrix and loads of the links and joints at the present state."""
    chain.place(arm.chain, motion.position)
    chain.mass_matrix(arm.chain, motion.mass)
    chain.bias(arm.chain, motion.velocity, motion.loads)
    loads.add_joint_loads(arm, motion)


@inner
def shaft_speed(arm: Arm, motion: Motion, drive: int) -> float:
    """Speed of a gear's output, rad/s."""
    speed = 0.0
    for j in range(len(motion.velocity)):
        speed += arm.transmission[drive, j] * motion.velocity[j]
    return speed


@inner
def shaft_position(arm: Arm, motion: Motion, drive: int) -> float:
    """Position of a gear's output, rad."""
    position = 0.0
    for j in range(len(motion.position)):
        position += arm.transmission[drive, j] * motion.position[j]
    return position


@inner
def _couple_drive(arm: Arm, motion: Motion, i: int, step: float) -> None:
    """Adds one drive to the linear equations for the change of the joints' speeds."""
    drive, motor = arm.drives[i], motion.motors[i]
    speed = shaft_speed(arm, motion, i)
    rotor = motor.velocity if drive.compliant else speed
    if not drive.compliant:
        motor.velocity = speed
    friction.linearise(drive, motor, rotor, motor.position, motion.braked[i], step)
    push = step * (motor.torque - motor.dry - (motor.viscous + motor.slope) * rotor)
    inertia = drive.inertia + step * (0.5 * motor.viscous + motor.slope)
    if drive.compliant:
        shaft = shaft_position(arm, motion, i)
        joining = step * gear.prepare(arm, i, motor, motion.slip[i], shaft, speed)
        push -= step * motor.lever * motor.gear_torque
        whole = inertia + joining * motor.lever * motor.lever
        motor.push, motor.joining = push / whole, joining * motor.lever / whole
        push = step * motor.gear_torque + joining * motor.lever * push / whole
        inertia = joining * inertia / whole
    n = len(motion.velocity)
    for j in range(n):
        along = arm.transmission[i, j]
        if along != 0.0:
            motion.right[j] += along * push
            for k in range(n):
                motion.matrix[j, k] += along * inertia * arm.transmission[i, k]


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
def _substep(arm: Arm, motion: Motion, step: float) -> bool:
    """Speeds and positions by one substep; False where the mass matrix is not positive definite."""
    n = len(motion.velocity)
    for j in range(n):
        motion.right[j] = -step * motion.loads[j]
        for k in range(n):
            motion.matrix[j, k] = motion.mass[j, k]
    for i in range(len(arm.drives)):
        _couple_drive(arm, motion, i, step)
    if not _solve(motion.matrix, motion.right):
        return False
    for j in range(n):
        motion.velocity[j] += motion.right[j]
        motion.position[j] += step * motion.velocity[j]
    for i in range(len(arm.drives)):
        _move_drive(arm, motion, i, step)
    return True


@inner
def _move_drive(arm: Arm, motion: Motion, i: int, step: float) -> None:
    """Rotor, bristle, gear and temperature of one drive after the joints' speeds are known."""
    drive, motor = arm.drives[i], motion.motors[i]
    change = 0.0
    for j in range(len(motion.right)):
        change += arm.transmission[i, j] * motion.right[j]
    if drive.compliant:
        change = motor.push + motor.joining * change
        motor.position += step * (motor.velocity + change)
        error, _ = gear.transmission_error(arm.kinematic, i, motor.position)
        stretch = motor.position - error - shaft_position(arm, motion, i)
        gear.slide(drive, motion.slip[i], motor.stretch, stretch)
        motor.stretch = stretch
        load = motor.gear_torque
    else:
        motor.position = shaft_position(arm, motion, i)
        resisting = motor.dry + motor.slope * (motor.velocity + change) + motor.viscous * motor.velocity
        load = motor.torque - resisting - drive.inertia * change / step
    motor.velocity += change
    motor.last_change = change
    if drive.load_rise != 0.0:
        motor.load += -math.expm1(-step / drive.load_time) * (load - motor.load)
    friction.advance(drive, motor, motor.velocity)
    friction.age(drive, motor, motor.velocity, motion.clock[0], step)


@inner
def settle(arm: Arm, motion: Motion) -> None:
    """Ends all motion once every brake is engaged and nothing moves any more."""
    fastest = 0.0
    for i in range(len(arm.drives)):
        if not motion.braked[i]:
            return
        fastest = max(fastest, abs(motion.motors[i].velocity), abs(shaft_speed(arm, motion, i)))
    if fastest >= _STANDSTILL:
        return
    for i in range(len(arm.drives)):
        motor = motion.motors[i]
        motor.velocity, motor.last_change, motor.bristle = 0.0, 0.0, 0.0
    for j in range(len(motion.velocity)):
        motion.velocity[j] = 0.0
        motion.joints[j].slosh_velocity = 0.0
    motion.at_rest[0] = True


@inner
def advance(arm: Arm, motion: Motion) -> int:
    """Moves the plant by one step under the motors' torques; FINE or NOT_POSITIVE_DEFINITE."""
    if motion.at_rest[0]:
        return FINE
    posture(arm, motion)
    for _ in range(arm.substeps):
        if not _substep(arm, motion, arm.step_time / arm.substeps):
            return NOT_POSITIVE_DEFINITE
    loads.move_sloshing(arm, motion, arm.step_time)
    motion.clock[0] += arm.step_time
    settle(arm, motion)
    return FINE
