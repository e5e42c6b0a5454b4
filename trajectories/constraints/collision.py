"""Distance of an arm's links from each other, the floor and obstacles, between samples too (coal).

Between two times a pair of bodies comes closer by at most what its joints can move it: speed of each joint
times the reach from its axis. So the smallest distance of a motion is bracketed by bisection where it
matters, and a motion that is accepted keeps its clearance at every instant.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio

from robots import RobotFileError, rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from robots.rigid_body import collision_bodies
from trajectories.constraints.surroundings import Surroundings
from trajectories.errors import TrajectoryError
from trajectories.motions.motion import Motion, midpoints

FIRST_STEP = 0.02
"""s; intervals before any bisection."""

LOOK = 0.2
"""s between two postures of a quick look."""

SHORTEST_STEP = 2e-4
"""s; an interval that is not split further."""

TOLERANCE = 1e-3
"""m; to which the smallest distance of a motion is found."""

FLOOR_EDGE, FLOOR_DEPTH = 20.0, 0.5


@dataclass(frozen=True)
class Nearest:
    """Where a motion comes closest to touching something.

    Attributes:
        distance: m; negative where the bodies are inside each other.
        at_least: what the distance is proven to stay above over the whole motion, m.
        bodies: the two bodies.
        joint: the last joint that moves one towards the other.
        time: s.
    """

    distance: float
    at_least: float
    bodies: tuple[str, str]
    joint: str
    time: float


class CollisionCheck:
    """Distances of one arm in its surroundings."""

    def __init__(self, robot: Robot, surroundings: Surroundings) -> None:
        """Read the arm's collision bodies from its URDF; meshes are replaced by their convex hulls.

        Raises:
            TrajectoryError: when a mesh that the URDF names cannot be read.
        """
        self.robot, self.surroundings = robot, surroundings
        self._build()

    def __getstate__(self) -> dict[str, object]:
        """coal's objects stay in their process and are built again in another."""
        return {"robot": self.robot, "surroundings": self.surroundings}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._build()

    def _build(self) -> None:
        self._model = rigid_body_model(self.robot)
        self._geometry = _geometry(self.robot, self._model, self.surroundings)
        self._data = self._model.createData()
        self._geometry_data = pinocchio.GeometryData(self._geometry)
        self._sweep = _sweeps(self._model, self._geometry, self.robot)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """What the two bodies of each watched pair belong to: a link of the URDF, the floor, an obstacle."""
        names = [_named(self._model, body) for body in self._geometry.geometryObjects]
        return tuple((names[p.first], names[p.second]) for p in self._geometry.collisionPairs)

    def distances(self, posture: FloatArray) -> FloatArray:
        """Distance of each pair, m, at a posture (n,)."""
        pinocchio.computeDistances(self._model, self._data, self._geometry, self._geometry_data, posture)
        return np.array([result.min_distance for result in self._geometry_data.distanceResults])

    def allows(self, motion: Motion) -> bool:
        """Whether a motion is proven to keep the clearance."""
        nearest = self._nearest(motion, self.surroundings.clearance)
        return nearest is None or nearest.at_least >= self.surroundings.clearance

    def nearest(self, motion: Motion) -> Nearest | None:
        """Where a motion comes closest to touching, to 1 mm; None where nothing is watched."""
        return self._nearest(motion, None)

    def excess(self, motion: Motion) -> float:
        """How much of the clearance is missing, m, from a quick look; 0 where it is kept."""
        if len(self._geometry.collisionPairs) == 0:
            return 0.0
        count = max(8, int(np.ceil(motion.duration / LOOK)))
        postures = motion.at(midpoints(motion.duration, count)).position
        closest = min(float(self.distances(posture).min()) for posture in postures)
        return max(0.0, self.surroundings.clearance - closest)

    def require(self, motion: Motion) -> None:
        """Raise where a motion comes closer than the clearance, as :meth:`require_clear` does."""
        self.require_known(self.nearest(motion))

    def require_known(self, nearest: Nearest | None) -> None:
        """As :meth:`require`, where the nearest of a motion is known.

        Raises:
            TrajectoryError: names the two bodies, the last joint between them, and the time.
        """
        if nearest is not None and min(nearest.distance, nearest.at_least + TOLERANCE) < self._clearance:
            raise self._too_close("the motion", nearest.bodies, nearest.distance, nearest.joint, nearest.time)

    def require_clear_posture(self, posture: FloatArray, what: str) -> None:
        """Raise where a posture (n,) is closer than the clearance to something.

        Args:
            posture: rad (or m).
            what: as the message calls it.

        Raises:
            TrajectoryError: names the posture, the two bodies and the last joint between them.
        """
        if len(self._geometry.collisionPairs) == 0:
            return
        distances = self.distances(posture)
        pair = int(distances.argmin())
        if distances[pair] < self._clearance:
            raise self._too_close(what, self.pairs[pair], float(distances[pair]), self._last_joint(pair))

    @property
    def _clearance(self) -> float:
        return self.surroundings.clearance

    def _too_close(
        self, what: str, bodies: tuple[str, str], distance: float, joint: str, time: float | None = None
    ) -> TrajectoryError:
        first, second = bodies
        reached = (
            f"brings {first} to {1e3 * distance:.1f} mm from {second}"
            if distance >= 0.0
            else f"puts {first} {-1e3 * distance:.1f} mm into {second}"
        )
        return TrajectoryError(
            f"{what} {reached}; allowed: {1e3 * self._clearance:.1f} mm apart",
            constraint="collision",
            joint=joint,
            time=time,
        )

    def _nearest(self, motion: Motion, enough: float | None) -> Nearest | None:
        """Branch and bound over time; with ``enough``, only until it is clear on which side of it."""
        if len(self._geometry.collisionPairs) == 0:
            return None
        count = max(1, int(np.ceil(motion.duration / FIRST_STEP)))
        half = motion.duration / count / 2
        best: tuple[float, int, float] = (float("inf"), 0, 0.0)
        open_intervals: list[tuple[float, float, float]] = []
        fresh = midpoints(motion.duration, count)
        while True:
            distances, bounds = self._intervals(motion, fresh, half)
            for time, row, bound in zip(fresh, distances, bounds, strict=True):
                pair = int(row.argmin())
                best = min(best, (float(row[pair]), pair, float(time)))
                heapq.heappush(open_intervals, (bound, float(time), half))
            lowest, middle, half = heapq.heappop(open_intervals)
            close_enough = best[0] - lowest < TOLERANCE or half < SHORTEST_STEP / 2
            if close_enough or (enough is not None and (lowest >= enough or best[0] < enough)):
                return self._found(best, lowest)
            half /= 2
            fresh = np.array([middle - half, middle + half])

    def _intervals(
        self, motion: Motion, middles: FloatArray, half: float
    ) -> tuple[list[FloatArray], FloatArray]:
        """Distances in the middle of intervals, and what no pair can come below within each."""
        state = motion.at(middles)
        travel = half * np.abs(state.velocity) + half**2 / 2 * np.abs(state.acceleration)
        # The jerk may change within the interval, but not beyond the limits that the motion keeps.
        travel += half**3 / 6 * self.robot.jerk_limits
        distances = [self.distances(posture) for posture in state.position]
        bounds = (np.array(distances) - travel @ self._sweep).min(axis=1)
        return distances, bounds

    def _found(self, best: tuple[float, int, float], lowest: float) -> Nearest:
        distance, pair, time = best
        return Nearest(distance, float(min(lowest, distance)), self.pairs[pair], self._last_joint(pair), time)

    def _last_joint(self, pair: int) -> str:
        """The last joint that moves the bodies of a pair towards each other."""
        moving = np.flatnonzero(self._sweep[:, pair])
        return self.robot.joint[int(moving[-1])].name if moving.size else ""


def _geometry(robot: Robot, model: pinocchio.Model, surroundings: Surroundings) -> pinocchio.GeometryModel:
    """The arm's bodies and the surroundings, with the pairs that are watched."""
    try:
        geometry = collision_bodies(robot, model)
    except RobotFileError as error:
        raise TrajectoryError(str(error), constraint="collision") from error
    for body in geometry.geometryObjects:
        body.geometry = _convex(body.geometry)
    own = len(geometry.geometryObjects)
    boxes = [(o.name, o.centre, o.size, o.turn) for o in surroundings.obstacles]
    if surroundings.floor is not None:
        centre = (0.0, 0.0, surroundings.floor - FLOOR_DEPTH / 2)
        boxes.append(("floor", centre, (FLOOR_EDGE, FLOOR_EDGE, FLOOR_DEPTH), 0.0))
    for name, centre, size, turn in boxes:
        placement = pinocchio.SE3(pinocchio.utils.rotate("z", turn), np.array(centre))
        geometry.addGeometryObject(pinocchio.GeometryObject(name, 0, 0, placement, coal.Box(*size)))
    bodies = list(geometry.geometryObjects)
    for first in range(own):
        rest = range(first + 1 if surroundings.itself else own, len(bodies))
        for second in rest:
            if not _belong_together(model, bodies[first].parentJoint, bodies[second].parentJoint):
                geometry.addCollisionPair(pinocchio.CollisionPair(first, second))
    return geometry


def _named(model: pinocchio.Model, body: pinocchio.GeometryObject) -> str:
    """The link that carries a body; the body's own name where it stands in the surroundings."""
    return str(model.frames[body.parentFrame].name) if body.parentFrame > 0 else str(body.name)


def _convex(shape: coal.CollisionGeometry) -> coal.CollisionGeometry:
    if not isinstance(shape, coal.BVHModelBase):
        return shape
    shape.buildConvexRepresentation(False)
    return shape.convex


def _belong_together(model: pinocchio.Model, first: int, second: int) -> bool:
    """Whether two bodies are on one link, on neighbours, or on links whose axes meet in one point.

    Links around a common point, as those of a wrist, are in each other's way by construction.
    """
    low, high = sorted((first, second))
    between = _joints_between(model, low, high)
    if between is None:
        return False
    return len(between) <= 1 or (low > 0 and _length(model, between) < 1e-9)


def _joints_between(model: pinocchio.Model, low: int, high: int) -> list[int] | None:
    """Joints from below ``low`` (exclusive) to ``high``; None where one does not carry the other."""
    path = []
    while high > low:
        path.append(high)
        high = model.parents[high]
    return path if high == low else None


def _length(model: pinocchio.Model, joints: list[int]) -> float:
    """Length of the way through joint origins, m."""
    return float(sum(np.linalg.norm(model.jointPlacements[joint].translation) for joint in joints))


def _sweeps(model: pinocchio.Model, geometry: pinocchio.GeometryModel, robot: Robot) -> FloatArray:
    """joints × pairs: how far a pair can come closer per rad (or m) of each joint."""
    stroke = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
    prismatic = np.array([joint.kind == "prismatic" for joint in robot.joint])
    sweeps = np.zeros((model.njoints, len(geometry.collisionPairs)))
    for pair, watched in enumerate(geometry.collisionPairs):
        bodies = [geometry.geometryObjects[k] for k in (watched.first, watched.second)]
        carried = [set(_joints_between(model, 0, body.parentJoint) or []) for body in bodies]
        for body, others in zip(bodies, reversed(carried), strict=True):
            path = _joints_between(model, 0, body.parentJoint) or []
            # From the body towards the base: the reach from a joint's axis grows by every link in between.
            reach = _radius(body)
            for joint in path:
                if joint not in others:
                    sweeps[joint, pair] += 1.0 if prismatic[joint - 1] else reach
                reach += float(np.linalg.norm(model.jointPlacements[joint].translation))
                reach += float(stroke[joint - 1]) if prismatic[joint - 1] else 0.0
    return sweeps[1:]


def _radius(body: pinocchio.GeometryObject) -> float:
    """Largest distance of a body's points from the origin of the joint that carries it, m."""
    body.geometry.computeLocalAABB()
    centre = body.placement.act(np.asarray(body.geometry.aabb_center))
    return float(np.linalg.norm(centre) + body.geometry.aabb_radius)
