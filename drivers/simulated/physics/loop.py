"""Position loops, encoders and plant in time: controller samples, and plant steps between them.

The law is eq. 4 of the paper, all axes at once, one step every ``sample_time``. With e = set-point −
position, both at the drive output:

- q̇[k] = (q[k] − q[k−N]) / (N·T), then, where a cut-off f is given, the first-order low-pass
  y[k] = y[k−1] + (1 − exp(−2π f T))·(q̇[k] − y[k−1]);
- ``cascade_p_pi``: u = Kp·e + ff·q̇_r − q̇ and v = Kv·(u + Ki·I), I[k] = I[k−1] + T·u[k−1];
- ``pd``: v = Kp·e + Kv·(ff·q̇_r − q̇);  ``pid``: the same + Ki·I with I[k] = I[k−1] + T·e[k−1];
- to v comes what is fed forward: friction_feed_forward·q̇_r + acceleration_feed_forward·q̈_r;
- v is limited to ±saturation; the integral does not grow further into the limit (conditional integration);
- the output of step k reaches the motor at step k + delay_samples.

q̇_r is the slope of the set-point over the present SYNC period, q̈_r the second difference of the targets over
it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.physics import motor, step
from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Arm, Motion, Record
from robots.arrays import BoolArray, FloatArray


class Law(NamedTuple):
    """The control law of n drives as arrays; see ``robots.Controller``."""

    cascade: bool
    sample_time: float
    position_gain: FloatArray
    velocity_gain: FloatArray
    output_per_integral: FloatArray
    feed_forward: FloatArray
    limit: FloatArray
    per_difference: float
    filter_gain: float
    counts: FloatArray
    """(n,) signed encoder counts per rad (or m) at the drive output."""
    steps: int
    """Plant steps per sample."""


class Memory(NamedTuple):
    """What the drives remember from sample to sample."""

    readings: FloatArray
    """(difference samples, n) ring of positions."""
    velocity: FloatArray
    integral: FloatArray
    outputs: FloatArray
    """(delay + 1, n) ring."""
    places: NDArray[np.int64]
    """(4,) where the rings stand: readings, outputs, path, signals."""
    output: FloatArray
    """(n,) control signals at the motors."""
    off: BoolArray
    """(n,) axes without current."""
    counts: FloatArray
    """(n,) encoder reading of this sample."""
    frozen: BoolArray
    """(n,) encoders that repeat their last reading."""
    path: FloatArray
    """(k, n) ring of rotor positions, one per plant step, for a delayed position channel."""
    signals: FloatArray
    """(k, n) ring of control signals, one per sample, for a delayed torque channel."""
    reported_counts: FloatArray
    """(n,) what the position channel of the bus says."""
    reported_signal: FloatArray
    """(n,) what the torque channel of the bus says."""


@inner
def control(
    law: Law,
    memory: Memory,
    set_point: FloatArray,
    slope: FloatArray,
    added: FloatArray,
    position: FloatArray,
) -> None:
    """One sample of the position loops; writes ``memory.output``."""
    oldest, following = memory.places[0], memory.places[1]
    memory.places[0] = (oldest + 1) % len(memory.readings)
    memory.places[1] = (following + 1) % len(memory.outputs)
    for i in range(len(position)):
        difference = (position[i] - memory.readings[oldest, i]) * law.per_difference
        memory.readings[oldest, i] = position[i]
        memory.velocity[i] += law.filter_gain * (difference - memory.velocity[i])
        error = set_point[i] - position[i]
        rate_error = law.feed_forward[i] * slope[i] - memory.velocity[i]
        if law.cascade:
            error = law.position_gain[i] * error + rate_error
            proportional = law.velocity_gain[i] * error
        else:
            proportional = law.position_gain[i] * error + law.velocity_gain[i] * rate_error
        wanted = proportional + law.output_per_integral[i] * memory.integral[i] + added[i]
        output = min(max(wanted, -law.limit[i]), law.limit[i])
        if (wanted - output) * error <= 0.0:
            memory.integral[i] += law.sample_time * error
        memory.outputs[following, i] = output
        memory.output[i] = memory.outputs[memory.places[1], i]


@inner
def sample(
    arm: Arm,
    motion: Motion,
    law: Law,
    memory: Memory,
    set_point: FloatArray,
    slope: FloatArray,
    added: FloatArray,
    error: FloatArray,
) -> None:
    """Reads the encoders and takes one step of the position loops.

    Args:
        arm, motion: the plant.
        law, memory: the drives.
        set_point, slope: (n,) internal set-points and their velocities at the drive outputs.
        added: (n,) control signals fed forward.
        error: (n,) reading errors, in counts.
    """
    n = len(error)
    position = np.empty(n)
    all_off = True
    for i in range(n):
        if not memory.frozen[i]:
            rotor = motion.motors[i]
            here = _read(arm.drives[i], step.reading(rotor.position, rotor.velocity, arm))
            memory.counts[i] = np.rint(here * law.counts[i] + error[i])
        position[i] = memory.counts[i] / law.counts[i]
        all_off = all_off and memory.off[i]
    if not all_off:
        control(law, memory, set_point, slope, added, position)
    for i in range(n):
        if memory.off[i]:
            memory.output[i] = 0.0
    _report(arm, law, memory, error)


@inner
def _read(drive: Record, position: float) -> float:
    """What an encoder reads of a place: its scale may turn about another point than the shaft."""
    if drive.scale_amplitude != 0.0:
        position += drive.scale_amplitude * math.sin(drive.scale_turns * position + drive.scale_phase)
    return position


@inner
def _report(arm: Arm, law: Law, memory: Memory, error: FloatArray) -> None:
    """What the bus gets to see of this sample, each channel with its own delay."""
    signals, path = len(memory.signals), len(memory.path)
    memory.places[3] = (memory.places[3] + 1) % signals
    for i in range(len(error)):
        memory.signals[memory.places[3], i] = memory.output[i]
        late = arm.drives[i].torque_delay / law.sample_time
        memory.reported_signal[i] = _past(memory.signals, memory.places[3], late, i)
        memory.reported_counts[i] = memory.counts[i]
        late = arm.drives[i].position_delay / arm.step_time
        if late > 0.0 and path > 1:
            past = _read(arm.drives[i], _past(memory.path, memory.places[2], late, i))
            memory.reported_counts[i] = np.rint(past * law.counts[i] + error[i])


@inner
def _past(ring: FloatArray, place: int, late: float, i: int) -> float:
    """What a ring held some entries ago, linearly between entries."""
    whole = int(late)
    share = late - whole
    value: float = ring[(place - whole) % len(ring), i]
    if share > 0.0:
        value += share * (ring[(place - whole - 1) % len(ring), i] - value)
    return value


@inner
def plant_steps(
    arm: Arm, motion: Motion, law: Law, memory: Memory, scale: FloatArray, disturbance: FloatArray
) -> int:
    """The plant's steps until the next sample; ``step.FINE`` or what went wrong.

    Args:
        arm, motion: the plant.
        law, memory: the drives.
        scale: (n,) share of the control signal that reaches each current loop.
        disturbance: (steps, 2 n) further torques on rotors and joints, see ``motor.set_torques``.
    """
    n = len(scale)
    command = np.empty(n)
    for i in range(n):
        command[i] = memory.output[i] * scale[i]
    for k in range(law.steps):
        motor.set_torques(
            arm.drives,
            motion.motors,
            arm.ripple,
            arm.crosstalk,
            motion.push,
            command,
            disturbance[k],
            arm.step_time,
        )
        state = step.advance(arm, motion)
        if state != step.FINE:
            return state
        if len(memory.path) > 1:
            memory.places[2] = (memory.places[2] + 1) % len(memory.path)
            for i in range(n):
                rotor = motion.motors[i]
                memory.path[memory.places[2], i] = step.reading(rotor.position, rotor.velocity, arm)
    return step.FINE
