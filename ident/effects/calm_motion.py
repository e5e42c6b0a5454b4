"""A motion of which rates of torques can be made."""

from __future__ import annotations

from ident.effects.effect import State
from ident.signals import low_pass
from robots.description import Robot

_CALM = 0.6
"""Of the cut-off of the positions' filter: what is left to motion of which a rate of torque is made."""


def calm_motion(robot: Robot, state: State) -> State:
    """The motion through a filter with a lower cut-off than that of the positions.

    A torque's rate has the rate of accelerations in it, and in that noise of positions is larger than the
    motion long before the cut-off: a column of noise is given too small a factor, and loses against another
    that has less of it. Where the samples are too few or too far apart the motion stays as it is.
    """
    settings, time = robot.identification, state.time
    if time is None or time.shape[0] <= 3 * settings.filter_order:
        return state
    step, cutoff = float(time[1] - time[0]), _CALM * settings.cutoff_hz
    if cutoff * step >= 0.5:
        return state
    position, velocity, acceleration = (
        low_pass(part, cutoff, step, settings.filter_order)
        for part in (state.position, state.velocity, state.acceleration)
    )
    return State(position, velocity, acceleration, time, state.torque)
