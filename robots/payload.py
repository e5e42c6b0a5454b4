"""A known payload: a body that is screwed to a link, and what it adds to the standard parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio

from robots.arrays import FloatArray
from robots.description import Robot
from robots.errors import UserError
from robots.pseudo_inertia import LINK_SIZE, impossible_links
from robots.rigid_body import rigid_body_model


class PayloadError(UserError, ValueError):
    """A payload that does not fit the arm; the text is one line for the user."""


@dataclass(frozen=True)
class Payload:
    """A rigid body in a frame of the arm.

    Attributes:
        mass: kg.
        center: (3,) centre of mass in ``frame``, m.
        inertia: (6,) ixx ixy iyy ixz iyz izz about the centre of mass along the axes of ``frame``, kg·m².
        frame: a link of the URDF that moves, or is fixed to one that does, as a flange; empty: the last link.
        relative_uncertainty: standard uncertainty of the mass, as a share; it is that of every drive gain.
    """

    mass: float
    center: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]
    frame: str = ""
    relative_uncertainty: float = 0.0

    def parameters(self, robot: Robot) -> FloatArray:
        """What it adds to the standard parameters of the links, (10·n,).

        Raises:
            PayloadError: the frame is none of the arm, does not move, or no body has such an inertia.
        """
        model = rigid_body_model(robot)
        joint, placement = self._place(robot, model)
        xx, xy, yy, xz, yz, zz = self.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        impossible = PayloadError(
            f"payload: no body has the mass {self.mass:g} kg and the inertia {list(self.inertia)};"
            " allowed: a mass above 0, and principal moments none larger than the sum of the others"
        )
        try:
            body = pinocchio.Inertia(self.mass, np.array(self.center), tensor)
        except (RuntimeError, ValueError) as error:  # no tensor of a body at all
            raise impossible from error
        ten = np.asarray(placement.act(body).toDynamicParameters(), dtype=np.float64)
        if not self.mass > 0.0 or impossible_links(ten[np.newaxis]):
            raise impossible
        added = np.zeros(LINK_SIZE * robot.n)
        added[LINK_SIZE * (joint - 1) : LINK_SIZE * joint] = ten
        return added

    def _place(self, robot: Robot, model: pinocchio.Model) -> tuple[int, pinocchio.SE3]:
        """The joint that moves it, and its frame seen from that joint's."""
        if not self.frame:
            return robot.n, pinocchio.SE3.Identity()
        bodies = {f.name: f for f in model.frames if "BODY" in str(f.type) and f.parentJoint > 0}
        if self.frame not in bodies:
            raise PayloadError(
                f'payload: "{self.frame}" is not a moving link of {robot.urdf_path.name};'
                f" allowed: {', '.join(bodies)}"
            )
        frame = bodies[self.frame]
        return int(frame.parentJoint), frame.placement
