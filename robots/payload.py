"""A known payload: a body that is screwed to a link, and what it adds to the standard parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio

from robots.arrays import FloatArray
from robots.carried import Load
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
        center: (3,) centre of mass in ``frame``, m; None where it is not known.
        inertia: (6,) ixx ixy iyy ixz iyz izz about the centre of mass along the axes of ``frame``, kg·m²;
            None where it is not known, as wherever the centre is not.
        frame: a link of the URDF that moves, or is fixed to one that does, as a flange; empty: the last link.
        relative_uncertainty: standard uncertainty of the mass, as a share; it is that of every drive gain.
    """

    mass: float
    center: tuple[float, float, float] | None = None
    inertia: tuple[float, float, float, float, float, float] | None = None
    frame: str = ""
    relative_uncertainty: float = 0.0

    def load(self, robot: Robot, name: str = "payload") -> Load:
        """What it adds to the link that carries it, as far as it is known.

        Raises:
            PayloadError: the frame is none of the arm, does not move, or no body has such an inertia.
        """
        model = rigid_body_model(robot)
        joint, placement = self._place(robot, model)
        if self.center is None or self.inertia is None:
            unknown = tuple(range(1 if self.center is None else 4, LINK_SIZE))
            ten = np.zeros(LINK_SIZE)
            ten[0] = self.mass
            if self.center is not None:
                # A point: what the centre makes of the inertia is known, the rest of it is not.
                point = pinocchio.Inertia(self.mass, np.array(self.center), np.zeros((3, 3)))
                ten = np.asarray(placement.act(point).toDynamicParameters(), dtype=np.float64)
            return Load(name, joint - 1, ten, unknown)
        return Load(name, joint - 1, self._ten(placement, self.center, self.inertia))

    def _ten(
        self, placement: pinocchio.SE3, center: tuple[float, ...], inertia: tuple[float, ...]
    ) -> FloatArray:
        """(10,) standard parameters about the frame of the link that carries it."""
        xx, xy, yy, xz, yz, zz = inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        impossible = PayloadError(
            f"payload: no body has the mass {self.mass:g} kg and the inertia {list(inertia)};"
            " allowed: a mass above 0, and principal moments none larger than the sum of the others"
        )
        try:
            body = pinocchio.Inertia(self.mass, np.array(center), tensor)
        except (RuntimeError, ValueError) as error:  # no tensor of a body at all
            raise impossible from error
        ten = np.asarray(placement.act(body).toDynamicParameters(), dtype=np.float64)
        if not self.mass > 0.0 or impossible_links(ten[np.newaxis]):
            raise impossible
        return ten

    def parameters(self, robot: Robot) -> FloatArray:
        """What is known of it adds to the standard parameters of the links, (10·n,).

        Raises:
            PayloadError: as :meth:`load`.
        """
        return self.load(robot).links(robot.n).ravel()

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
