"""A motion of which rates of torques can be made."""

from __future__ import annotations

from ident.effects.family import State
from ident.signals import low_pass_where_sampled
from robots.description import Robot

_CALM = 0.6
"""Of the cut-off of the positions' filter: what is left to motion of which a rate of torque is made."""


def calm_motion(robot: Robot, state: State) -> State:
    """The motion through a filter with a lower cut-off than that of the positions.

    A torque's rate has the rate of accelerations in it, and in that noise of positions is larger than the
    motion long before the cut-off: a column of noise is given too small a factor, and loses against another
    that has less of it. Where the samples are too few or too far apart the motion stays as it is.
    """
    settings = robot.identification
    position, velocity, acceleration = (
        low_pass_where_sampled(part, state.time, _CALM * settings.cutoff_hz, settings.filter_order)
        for part in (state.position, state.velocity, state.acceleration)
    )
    return State(position, velocity, acceleration, state.time, state.torque)
