"""What a second encoder, at the link, says directly: how far a gear winds under its torque.

The first encoder is ahead of the second by the torque through the gear over the stiffness of the gear,

    q − q₂ = c + (τ − I_a q̈ − F_v q̇ − F_c sign q̇) / k − δ q̇ ,

with the rotor's own torque taken off that of the drive and δ the time between both readings. All of it is
linear in 1/k, so least squares over the low-passed record gives the stiffness without a model of the arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.listing import in_lines, listed
from ident.recording import Recording
from ident.signals import differentiate, low_pass
from ident.statistics.whitening import inflated_deviation
from robots.arrays import FloatArray
from robots.description import Joint, Robot

_SEEN = 5.0
"""Deviations of 1/k from which on a gear is said to wind."""
_GEAR = 0.1
"""Share of a joint's motion; between encoders that are farther apart is more than a gear."""
_ROWS_PER_PERIOD = 4.0
"""Rows per period of the cut-off: closer ones say the same again."""
_SETTLED = 2.0
"""Periods of the cut-off at both ends, in which the filter settles."""
_STANDSTILL = 0.02
"""Of the largest speed: below it the sign of a speed is noise."""


@dataclass(frozen=True)
class Wound:
    """What one joint's encoders say of its gear.

    Attributes:
        joint: from 0.
        compliance, sigma: 1/k and its deviation, rad/(N·m) (or m/N).
        range: of q − q₂, rad (or m).
        share: of the joint's own range.
    """

    joint: int
    compliance: float
    sigma: float
    range: float
    share: float

    @property
    def is_seen(self) -> bool:
        return self.is_of_gear and self.compliance > _SEEN * self.sigma

    @property
    def is_of_gear(self) -> bool:
        """Whether what is between both encoders is so little that a gear can wind by it."""
        return self.share < _GEAR


def wound(robot: Robot, recording: Recording, cutoff_hz: float) -> tuple[Wound, ...]:
    """What both encoders of each joint say of the gear between them; empty without second encoders.

    Args:
        robot: gains and transmission.
        recording: with positions of both encoders.
        cutoff_hz: of the low-pass.
    """
    if recording.second is None:
        return ()
    step = recording.sample_time
    torque = robot.joint_torque(recording.control_signal)
    q, ahead, torque = (
        low_pass(values, cutoff_hz, step, 4)
        for values in (recording.position, recording.position - recording.second, torque)
    )
    speed = differentiate(q, step, 2)
    edge = round(_SETTLED / (cutoff_hz * step))
    rows = slice(edge, len(q) - edge, max(1, round(1.0 / (_ROWS_PER_PERIOD * cutoff_hz * step))))
    push = differentiate(speed, step, 2)
    of_joints = zip(*(values[rows].T for values in (ahead, q, torque, speed, push)), strict=True)
    return tuple(_fitted(joint, *columns) for joint, columns in enumerate(of_joints))


def _fitted(
    joint: int, ahead: FloatArray, q: FloatArray, torque: FloatArray, speed: FloatArray, push: FloatArray
) -> Wound:
    """Least squares of one joint, all (rows,)."""
    sign = np.tanh(speed / max(_STANDSTILL * float(np.abs(speed).max(initial=0.0)), 1e-300))
    columns = np.column_stack([torque, np.ones_like(torque), speed, sign, push])
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(columns / scale, rcond=1e-9)
    found = inverse @ ahead
    left = ahead - columns / scale @ found
    sigma = inflated_deviation(left) * float(np.linalg.norm(inverse[0]))
    apart, moved = float(np.ptp(ahead)), max(float(np.ptp(q)), 1e-300)
    return Wound(joint, float(found[0] / scale[0]), float(sigma / scale[0]), apart, apart / moved)


def words_of_second(robot: Robot, recording: Recording, cutoff_hz: float) -> tuple[str, ...]:
    """A sentence on the gears that both encoders see wind, and one on joints where more is between them."""
    joints = wound(robot, recording, cutoff_hz)
    seen = [one for one in joints if one.is_seen]
    other = [one for one in joints if not one.is_of_gear]
    words = []
    if seen:
        words += [
            f"{recording.name}: second encoders show elastic gears directly, stiffness {some}"
            for some in in_lines([_stiffness(one, robot.joint[one.joint]) for one in seen])
        ]
    elif joints and not other:
        most = max(joints, key=lambda one: one.share)
        words.append(f"{recording.name}: second encoders see no gear wind; {_apart(most, robot)} at most")
    if other:
        apart = listed([_apart(one, robot) for one in other], few=2)
        words.append(
            f"{recording.name}: second encoders move otherwise than the first ones ({apart}): coupled"
            " axes, or another joint's encoder?"
        )
    return tuple(words)


def _apart(one: Wound, robot: Robot) -> str:
    joint = robot.joint[one.joint]
    return f"{joint.name} by {one.range:.2g} {joint.unit}"


def _stiffness(one: Wound, joint: Joint) -> str:
    stiffness, sigma = 1.0 / one.compliance, one.sigma / one.compliance**2
    return f"{joint.name} {stiffness:.3g} ± {sigma:.1g} {joint.torque_unit}/{joint.unit}"
