"""The foot of an arm as two joints more before its own: turns about x and y of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio

from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from robots.identity_cache import IdentityCache

AXES = 2

_MOMENTS = [4, 6, 9]
"""XX, YY and ZZ among ten standard parameters."""

_LEAST = 1e-6
"""kg·m², of the described links."""

_AT_HOME: IdentityCache[FloatArray] = IdentityCache()


@dataclass(frozen=True)
class FootSpring:
    """A foot that gives way.

    Attributes:
        compliance: about x and y of the base, rad/(N·m); 0 where it is firm.
        damping: N·m·s/rad beside each spring.
        inertia: of the foot itself about any axis, kg·m².
    """

    compliance: tuple[float, float]
    damping: tuple[float, float]
    inertia: float = 0.0


def on_a_foot(model: pinocchio.Model) -> pinocchio.Model:
    """The links behind two joints more, which carry nothing themselves."""
    foot, still = pinocchio.Model(), pinocchio.SE3.Identity()
    first = foot.addJoint(0, pinocchio.JointModelRX(), still, "foot_x")
    second = foot.addJoint(first, pinocchio.JointModelRY(), still, "foot_y")
    frame = foot.addFrame(pinocchio.Frame("foot", second, still, pinocchio.FrameType.OP_FRAME))
    whole = pinocchio.appendModel(foot, model, frame, still)
    whole.gravity = model.gravity
    return whole


def links_on_a_foot(links: FloatArray, inertia: float = 0.0) -> FloatArray:
    """(2 + n, 10) standard parameters of links (n, 10) behind a foot that has some inertia of its own."""
    foot = np.zeros((AXES, 10))
    foot[-1, _MOMENTS] = inertia
    return np.ascontiguousarray(np.vstack([foot, links]))


def inertia_on_foot(robot: Robot) -> FloatArray:
    """(2,) of the described links about x and y of the base, in the home position, kg·m²."""
    return _AT_HOME.of(robot, lambda: _inertia_on_foot(robot))


def _inertia_on_foot(robot: Robot) -> FloatArray:
    whole = on_a_foot(rigid_body_model(robot))
    mass = pinocchio.crba(whole, whole.createData(), np.array([0.0] * AXES + list(robot.home)))
    return np.asarray(np.maximum(np.diag(mass)[:AXES], _LEAST))
