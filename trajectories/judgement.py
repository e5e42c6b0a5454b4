"""The last word on a motion, from whomever it comes: every limit, every distance, and what it will tell."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.constraints.collision import CollisionCheck, Nearest
from trajectories.constraints.surroundings import Surroundings
from trajectories.constraints.tool_speed import FastestTool, Tool, ToolSpeed
from trajectories.constraints.torque import TorqueCheck
from trajectories.constraints.use import Use, broken, kinematic_use, largest_use
from trajectories.errors import TrajectoryError
from trajectories.information.expected import ExpectedValues
from trajectories.information.noise import TorqueNoise
from trajectories.information.prediction import Prediction, Shown, predict, shown
from trajectories.limits import Limits, Margins
from trajectories.motions.motion import Motion
from trajectories.motions.repeats import at_most, pieces
from trajectories.trajectory import sample_times

Pieces = tuple[tuple[float, Motion], ...]

STANDSTILL = 1e-3
"""Share of a joint's velocity limit below which it is at rest."""

_SAMPLES = 100_000
"""Of a motion whose rows are made at once: 0.3 GB for six axes. Further periods show what the last does."""


@dataclass(frozen=True)
class Judgement:
    """What is known of a motion before anything moves.

    Attributes:
        problems: every constraint that it breaks, in the order limits, rest, distance, tool speed.
        uses: use of each limit.
        nearest: where it comes closest to touching something; None where nothing was watched.
        tool: where the tool is fastest.
    """

    problems: tuple[TrajectoryError, ...]
    uses: tuple[Use, ...]
    nearest: Nearest | None
    tool: FastestTool


class Judge:
    """Judges motions of one arm in its surroundings.

    Args:
        robot: the arm.
        limits: that it is held to.
        surroundings: what it may not touch; only itself where not given.
        tool: whose speed is watched; the last link where not given.
        tool_speed: highest allowed, m/s; None for no limit.
    """

    def __init__(
        self,
        robot: Robot,
        limits: Limits | None = None,
        surroundings: Surroundings | None = None,
        tool: Tool | None = None,
        tool_speed: float | None = None,
    ) -> None:
        self.robot = robot
        self.limits = limits or Limits.of(robot, Margins())
        self.torque = TorqueCheck.of(robot, self.limits)
        self.collision = CollisionCheck(robot, surroundings or Surroundings())
        self.tool = ToolSpeed(robot, tool, tool_speed)

    def judge(self, motion: Motion) -> Judgement:
        """Everything that a motion breaks, and how much of each limit it uses."""
        parts = pieces(motion)
        uses = self._uses(parts)
        problems = [*broken(uses, self.limits.names), *self._moving_ends(motion)]
        nearest = self._nearest(parts)
        try:
            self.collision.require_known(nearest)
        except TrajectoryError as error:
            problems.append(error)
        fastest = self._fastest(parts)
        try:
            self.tool.require_known(motion, fastest)
        except TrajectoryError as error:
            problems.append(error)
        return Judgement(tuple(problems), uses, nearest, fastest)

    def _uses(self, parts: Pieces) -> tuple[Use, ...]:
        found = [
            [use.later(start) for use in (*kinematic_use(part, self.limits), *self.torque.use(part))]
            for start, part in parts
        ]
        return tuple(largest_use(uses) for uses in zip(*found, strict=True))

    def _nearest(self, parts: Pieces) -> Nearest | None:
        found = [(start, self.collision.nearest(part)) for start, part in parts]
        known = [replace(near, time=near.time + start) for start, near in found if near is not None]
        if not known:
            return None
        least = min(near.at_least for near in known)
        return replace(min(known, key=lambda near: near.distance), at_least=least)

    def _fastest(self, parts: Pieces) -> FastestTool:
        found = [(start, self.tool.fastest(part)) for start, part in parts]
        start, fastest = max(found, key=lambda one: one[1].speed)
        return replace(fastest, time=fastest.time + start)

    def _moving_ends(self, motion: Motion) -> list[TrajectoryError]:
        """One error for each end of a motion at which the arm is not at rest."""
        errors = []
        for name, time in (("start", 0.0), ("end", motion.duration)):
            speed = np.abs(motion.at(np.array([time])).velocity[0])
            share = speed / self.robot.velocity_limits
            worst = int(np.argmax(share))
            if share[worst] > STANDSTILL:
                errors.append(
                    TrajectoryError(
                        f"velocity at the {name} is {speed[worst]:.6g}; allowed: 0, the arm is at rest there",
                        constraint="rest",
                        joint=self.limits.names[worst],
                        time=time,
                    )
                )
        return errors


def predicted(
    base: BaseParameters,
    motion: Motion,
    cycle_time: float,
    noise: TorqueNoise,
    expected: ExpectedValues | None = None,
) -> Prediction:
    """What identification will make of a motion that is sampled every ``cycle_time`` s.

    Args:
        base: the arm's base parameters.
        motion: any motion.
        cycle_time: s.
        noise: the errors to expect.
        expected: what the parameters are expected to be; the a-priori figures where not given.

    Raises:
        PlanError: the motion is too short to be identified from.
    """
    first, periods = at_most(motion, 2), 2
    while first.duration < min(motion.duration, _SAMPLES * cycle_time):
        periods += 1
        first = at_most(motion, periods)
    known = expected or ExpectedValues.described(base)

    def shown_by(part: Motion) -> Shown:
        time = sample_times(part.duration, cycle_time)
        return shown(base, time, part.at(time).position, noise)

    whole = shown_by(first)
    if first.duration < motion.duration:
        shorter = at_most(motion, periods - 1)
        times = (motion.duration - first.duration) / (first.duration - shorter.duration)
        whole = whole.with_more_of(shown_by(shorter), times)
    return predict(base, whole, noise, known)


@dataclass(frozen=True)
class Conditions:
    """What a motion of one arm has to keep, and what is known of the arm.

    Attributes:
        margins: what is kept free of the limits.
        surroundings: what the arm may not touch; only itself by default.
        tool: whose speed is watched; the last link where None.
        tool_speed: highest allowed, m/s; None for no limit.
        noise: the errors to expect of the rows; 1 % of the torque limits, white, where None.
        expected: what the base parameters are expected to be; the a-priori figures where None.
    """

    margins: Margins = field(default_factory=Margins)
    surroundings: Surroundings = field(default_factory=Surroundings)
    tool: Tool | None = None
    tool_speed: float | None = None
    noise: TorqueNoise | None = None
    expected: ExpectedValues | None = None

    def judge(self, robot: Robot, *, start: FloatArray | None = None) -> Judge:
        """The judge of these conditions; positions are allowed as far as ``start`` (n,) reaches."""
        limits = Limits.of(robot, self.margins)
        limits = limits if start is None else limits.widened(start)
        return Judge(robot, limits, self.surroundings, self.tool, self.tool_speed)
