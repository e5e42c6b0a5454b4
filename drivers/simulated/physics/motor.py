"""From the control signal to the torque at the gear's output: current limit and loop, magnets, windings."""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Harmonics, Record, Records
from robots.arrays import FloatArray


@inner
def set_torques(
    drives: Records,
    motors: Records,
    ripple: Harmonics,
    crosstalk: FloatArray,
    push: FloatArray,
    command: FloatArray,
    disturbance: FloatArray,
    step: float,
) -> None:
    """Writes the torque of each motor for the coming step.

    Args:
        drives, motors: figures and states of the drives.
        ripple: of the motors.
        crosstalk: (n, n) share of each drive's torque that turns up at another one.
        push: (n,) torques of the surroundings on the joints, written.
        command: control signals that reach the current loops, (n,).
        disturbance: (2 n,) further torques on the rotors, at the gear outputs, then on the joints, N·m.
        step: s.
    """
    n = len(command)
    for i in range(n):
        motors[i].torque = _torque(drives[i], motors[i], command[i], step) + disturbance[i]
        push[i] = disturbance[n + i]
    for k in range(len(ripple.drive)):
        drive, motor = drives[ripple.drive[k]], motors[ripple.drive[k]]
        wave = math.sin(ripple.order[k] * motor.position + ripple.phase[k])
        motor.torque += (ripple.amplitude[k] + ripple.per_current[k] * drive.gain * motor.current) * wave
    for i in range(n):
        for k in range(n):
            if crosstalk[i, k] != 0.0:
                motors[i].torque += crosstalk[i, k] * drives[k].gain * motors[k].current


@inner
def _torque(drive: Record, motor: Record, command: float, step: float) -> float:
    """Torque of one motor at the gear's output, N·m; its current and its winding's warmth go on by a step."""
    if drive.command_threshold > 0.0:
        command = math.copysign(max(abs(command) - drive.command_threshold, 0.0), command)
    wanted = min(max(command, -drive.current_limit), drive.current_limit)
    if drive.current_lag > 0.0:
        motor.current += -math.expm1(-step / drive.current_lag) * (wanted - motor.current)
    else:
        motor.current = wanted
    gain: float = drive.gain
    if drive.winding_time > 0.0:
        heat = drive.winding_heating * motor.current * motor.current - motor.winding_warmth
        motor.winding_warmth += step / drive.winding_time * heat
        gain *= math.exp(drive.gain_per_kelvin * motor.winding_warmth)
    if drive.iron_loss > 0.0:
        share = motor.current / drive.iron_current
        gain /= 1.0 + drive.iron_loss * share * share
    torque: float = gain * motor.current + drive.torque_offset
    return torque
