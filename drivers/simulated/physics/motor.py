"""From the control signal to the torque at the gear's output: current limit and loop, magnets, windings."""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Arm, Motion
from robots.arrays import FloatArray


@inner
def set_torques(arm: Arm, motion: Motion, command: FloatArray, disturbance: FloatArray) -> None:
    """Writes the torque of each motor for the coming step.

    Args:
        arm, motion: the plant.
        command: control signals that reach the current loops, (n,).
        disturbance: (2 n,) further torques on the rotors, at the gear outputs, then on the joints, N·m.
    """
    n = len(command)
    for i in range(n):
        drive, motor = arm.drives[i], motion.motors[i]
        wanted = min(max(command[i], -drive.current_limit), drive.current_limit)
        if drive.current_lag > 0.0:
            motor.current += -math.expm1(-arm.step_time / drive.current_lag) * (wanted - motor.current)
        else:
            motor.current = wanted
        gain = drive.gain
        if drive.winding_time > 0.0:
            heat = drive.winding_heating * motor.current * motor.current - motor.winding_warmth
            motor.winding_warmth += arm.step_time / drive.winding_time * heat
            gain *= math.exp(drive.gain_per_kelvin * motor.winding_warmth)
        motor.torque = gain * motor.current + drive.torque_offset
    for k in range(len(arm.ripple.drive)):
        motor = motion.motors[arm.ripple.drive[k]]
        wave = math.sin(arm.ripple.order[k] * motor.position + arm.ripple.phase[k])
        along = arm.drives[arm.ripple.drive[k]].gain * motor.current
        motor.torque += (arm.ripple.amplitude[k] + arm.ripple.per_current[k] * along) * wave
    for i in range(n):
        for k in range(n):
            if arm.crosstalk[i, k] != 0.0:
                motion.motors[i].torque += arm.crosstalk[i, k] * arm.drives[k].gain * motion.motors[k].current
    for i in range(n):
        motion.motors[i].torque += disturbance[i]
        motion.push[i] = disturbance[n + i]
