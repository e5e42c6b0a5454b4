"""Speed of a point of the tool, with a bound that holds between samples too.

Every derivative of a rotation by its angle has norm 1, so a point that is ρ_i away from axis i, over the
links in between, has partial derivatives of at most the smallest ρ of the joints that are differentiated
by. Its third derivative in time is then at most
Σ ρ_i |q⃛_i| + 3 (Σ √ρ_i |q̇_i|)(Σ √ρ_i |q̈_i|) + (Σ ∛ρ_i |q̇_i|)³, and a speed known at two instants h apart
rises between them by at most h²/8 of that. A prismatic joint moves the point by 1 per m, and further
derivatives by it are 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio

from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.errors import TrajectoryError
from trajectories.limits import ROUNDING
from trajectories.motions.motion import Motion, MotionState

FINE = 0.001
COARSE = 0.01


@dataclass(frozen=True)
class Tool:
    """The point whose path and speed are watched.

    Attributes:
        frame: link or joint of the URDF; the last link where None.
        offset: of the point in that frame, m.
    """

    frame: str | None = None
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FastestTool:
    """Where the tool is fastest.

    Attributes:
        speed: m/s, a bound that holds between samples.
        time: s.
        limit: m/s; None where none was set.
    """

    speed: float
    time: float
    limit: float | None


class ToolSpeed:
    """Position and speed of a tool's point along motions of one arm; a check where a limit is set."""

    def __init__(self, robot: Robot, tool: Tool | None = None, limit: float | None = None) -> None:
        """Args: the arm, its tool, and the highest speed allowed, m/s; None for no limit.

        Raises:
            TrajectoryError: the limit is not a positive number, or the URDF has no such frame.
        """
        if limit is not None and not 0.0 < limit < float("inf"):
            raise TrajectoryError(f"tool speed is {limit} m/s; allowed: above 0", constraint="tool speed")
        self.robot, self.tool, self.limit = robot, tool or Tool(), limit
        self._build()

    def __getstate__(self) -> dict[str, object]:
        """Pinocchio's objects stay in their process and are built again in another."""
        return {"robot": self.robot, "tool": self.tool, "limit": self.limit}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._build()

    def _build(self) -> None:
        self._model = rigid_body_model(self.robot)
        bodies = [f for f in self._model.frames if f.type == pinocchio.FrameType.BODY]
        name = self.tool.frame or bodies[-1].name
        if not self._model.existFrame(name):
            allowed = ", ".join(frame.name for frame in bodies)
            raise TrajectoryError(
                f"no tool frame {name!r} in the URDF; allowed: {allowed}", constraint="tool"
            )
        placement = pinocchio.SE3(np.eye(3), np.array(self.tool.offset))
        base = self._model.frames[self._model.getFrameId(name)]
        frame = pinocchio.Frame(
            f"{name} with the tool",
            base.parentJoint,
            base.placement * placement,
            pinocchio.FrameType.OP_FRAME,
        )
        self._frame = self._model.addFrame(frame)
        self._data = self._model.createData()
        self._prismatic = np.array([joint.kind == "prismatic" for joint in self.robot.joint])
        self._reach = _reaches(self._model, frame, self.robot)

    @property
    def name(self) -> str:
        """Of the frame."""
        return str(self._model.frames[self._frame].name).removesuffix(" with the tool")

    def path(self, posture: FloatArray) -> FloatArray:
        """Where the point is in the base frame, samples × 3 m, for postures samples × joints."""
        points = np.empty((len(posture), 3))
        for k, q in enumerate(posture):
            pinocchio.framesForwardKinematics(self._model, self._data, q)
            points[k] = self._data.oMf[self._frame].translation
        return points

    def speeds(self, state: MotionState) -> FloatArray:
        """Speed of the point at each state, (samples,) m/s."""
        speeds = np.empty(len(state.position))
        local = pinocchio.ReferenceFrame.LOCAL
        for k, (q, v) in enumerate(zip(state.position, state.velocity, strict=True)):
            pinocchio.forwardKinematics(self._model, self._data, q, v)
            velocity = pinocchio.getFrameVelocity(self._model, self._data, self._frame, local)
            speeds[k] = np.linalg.norm(velocity.linear)
        return speeds

    def fastest(self, motion: Motion, step: float = FINE) -> FastestTool:
        """Where a motion's tool is fastest, bounded between samples.

        Args:
            motion: any motion of this arm.
            step: longest interval between two looks, s.
        """
        breaks = motion.breaks() if step < COARSE else np.empty(0)
        count = max(1, int(np.ceil(motion.duration / step)))
        edges = np.union1d(np.linspace(0.0, motion.duration, count + 1), breaks)
        state = motion.at(edges)
        speeds = self.speeds(state)
        rise = np.diff(edges) ** 2 / 8 * self._third_derivative(motion, state, np.diff(edges))
        bounds = np.maximum(speeds[1:], speeds[:-1]) + rise
        worst = int(np.argmax(bounds))
        return FastestTool(float(bounds[worst]), float(edges[worst]), self.limit)

    def _third_derivative(self, motion: Motion, state: MotionState, length: FloatArray) -> FloatArray:
        """A bound on the point's third derivative within each interval, m/s³."""
        jerk = motion.extremes().jerk
        acceleration = np.maximum(np.abs(state.acceleration[1:]), np.abs(state.acceleration[:-1]))
        acceleration = acceleration + length[:, np.newaxis] / 2 * jerk
        speed = np.maximum(np.abs(state.velocity[1:]), np.abs(state.velocity[:-1]))
        speed = speed + length[:, np.newaxis] / 2 * acceleration
        # By a prismatic joint the derivative is a unit vector, however far away the point is.
        along = np.where(self._prismatic, 1.0, self._reach)
        if self._prismatic.all():
            return np.asarray(jerk @ along + np.zeros(len(length)))
        reach = np.maximum(self._reach, 1.0) if self._prismatic.any() else self._reach
        root, cube = np.sqrt(reach), np.cbrt(reach)
        mixed = 3.0 * (speed @ root) * (acceleration @ root) + (speed @ cube) ** 3
        return np.asarray(jerk @ along + mixed)

    def share(self, motion: Motion) -> float:
        """The fastest over the limit, from a coarse look; 0 without a limit."""
        return 0.0 if self.limit is None else self.fastest(motion, COARSE).speed / self.limit

    def allows(self, motion: Motion) -> bool:
        """Whether the limit is kept; a coarse look first, a fine one where that does not decide."""
        if self.limit is None or self.share(motion) <= 1.0:
            return True
        count = max(2, int(np.ceil(motion.duration / COARSE)))
        if self.speeds(motion.at(np.linspace(0.0, motion.duration, count))).max() > self.limit:
            return False
        return self.fastest(motion).speed <= self.limit

    def excess(self, motion: Motion) -> float:
        """The share of the limit above 1."""
        return max(0.0, self.share(motion) - 1.0)

    def require(self, motion: Motion) -> None:
        """Raise where the limit is broken.

        Raises:
            TrajectoryError: names speed, limit and time, and the joint that adds most to it.
        """
        if self.limit is not None:
            self.require_known(motion, self.fastest(motion))

    def require_known(self, motion: Motion, fastest: FastestTool) -> None:
        """As :meth:`require`, where a motion's fastest is known."""
        if self.limit is not None and fastest.speed > self.limit * (1.0 + ROUNDING):
            raise TrajectoryError(
                f"tool speed of {self.name} reaches {fastest.speed:.4g} m/s; allowed: {self.limit:.4g} m/s",
                constraint="tool speed",
                joint=self._mover(motion, fastest.time),
                time=fastest.time,
            )

    def _mover(self, motion: Motion, time: float) -> str:
        """The joint that moves the point most at a time."""
        state = motion.at(np.array([time]))
        jacobian = pinocchio.computeFrameJacobian(
            self._model, self._data, state.position[0], self._frame, pinocchio.ReferenceFrame.LOCAL
        )
        shares = np.linalg.norm(jacobian[:3], axis=0) * np.abs(state.velocity[0])
        return self.robot.joint[int(np.argmax(shares))].name


def _reaches(model: pinocchio.Model, frame: pinocchio.Frame, robot: Robot) -> FloatArray:
    """(n,) how far the point can be from each joint's axis, m; 0 for a joint that does not carry it."""
    stroke = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
    reaches = np.zeros(model.njoints)
    joint, reach = int(frame.parentJoint), float(np.linalg.norm(frame.placement.translation))
    while joint > 0:
        if robot.joint[joint - 1].kind == "prismatic":
            reach += float(stroke[joint - 1])
        reaches[joint] = reach
        reach += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = int(model.parents[joint])
    return reaches[1:]
