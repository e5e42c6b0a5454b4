"""The coordinates of an arm in which some drives do not move rigidly with the joints.

The joints q come first, then one output angle θ per elastic (or loose) gear. What belongs to the drive
(rotor inertia, viscous and dry friction over the drive's speed, offset, the motor's torque and the encoder)
moves over to θ; the gear is a spring over θ − t·q, with t the drive's row of the transmission.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ident.effects.simulated import GearSpring
from ident.errors import IdentificationError
from robots.arrays import FloatArray
from robots.description import Robot

_SAME_DIRECTION = 1e-9

_CONTACT_TURN, _CONTACT_DAMPING = 0.5, 0.1
"""Of teeth that nobody gave a compliance: angle in rad of their oscillation per integration step, and share
of the critical damping."""


@dataclass(frozen=True)
class Gear:
    """One drive's gear: stiffness and damping while its teeth touch, and its play."""

    drive: int
    inertia: float
    stiffness: float
    damping: float
    gap: float
    offset_at_link: float
    cubic: float = 0.0


@dataclass(frozen=True)
class Coordinates:
    """m = n + len(gears) coordinates.

    Attributes:
        robot: the arm.
        gears: in the order of their coordinates.
    """

    robot: Robot
    gears: tuple[Gear, ...]

    @property
    def count(self) -> int:
        return self.robot.n + len(self.gears)

    def _row(self, gear: Gear) -> FloatArray:
        return np.asarray(self.robot.transmission_matrix[gear.drive])

    @property
    def transmission(self) -> FloatArray:
        """(n, m) what the encoders see, at the drive outputs."""
        matrix = np.zeros((self.robot.n, self.count))
        matrix[:, : self.robot.n] = self.robot.transmission_matrix
        for index, gear in enumerate(self.gears, start=self.robot.n):
            matrix[gear.drive] = 0.0
            matrix[gear.drive, index] = 1.0
        return matrix

    def split(self, matrix: FloatArray) -> FloatArray:
        """(m, m) of a symmetric (n, n): each gear's drive takes its share of it along."""
        inverse = np.linalg.inv(self.robot.transmission_matrix)
        at_drives = inverse.T @ matrix @ inverse
        whole = np.zeros((self.count, self.count))
        whole[: self.robot.n, : self.robot.n] = matrix
        for index, gear in enumerate(self.gears, start=self.robot.n):
            row, share = self._row(gear), at_drives[gear.drive, gear.drive]
            whole[: self.robot.n, : self.robot.n] -= share * np.outer(row, row)
            whole[index, index] = share
        return whole

    def split_torque(self, torque: FloatArray) -> FloatArray:
        """(m,) of a constant torque (n,): what acts at a gear's drive moves over."""
        at_drives = np.linalg.solve(self.robot.transmission_matrix.T, torque)
        for gear in self.gears:
            at_drives[gear.drive] *= 1.0 - gear.offset_at_link
        whole = np.concatenate([torque, at_drives[[gear.drive for gear in self.gears]]])
        for gear in self.gears:
            whole[: self.robot.n] -= at_drives[gear.drive] * self._row(gear)
        return np.asarray(whole)

    def lift(self, row: FloatArray) -> FloatArray:
        """(m,) of a row over the joints, unchanged."""
        return np.concatenate([row, np.zeros(len(self.gears))])

    def at_drive(self, *rows: FloatArray) -> tuple[FloatArray, ...] | None:
        """(m,) each: the rows over a gear's drive instead, where all are along its row; else None."""
        for index, gear in enumerate(self.gears, start=self.robot.n):
            own = self._row(gear)
            shares = [float(row @ own) / float(own @ own) for row in rows]
            if all(
                np.abs(row - share * own).max() <= _SAME_DIRECTION * (np.abs(row).max() + 1e-300)
                for row, share in zip(rows, shares, strict=True)
            ):
                return tuple(share * np.eye(self.count)[index] for share in shares)
        return None

    def across(self, gear: int) -> FloatArray:
        """(m,) row of the deflection θ − t·q of a gear, counted in ``gears``."""
        row = self.lift(-self._row(self.gears[gear]))
        row[self.robot.n + gear] = 1.0
        return row

    def start(self, position: FloatArray, velocity: FloatArray, load: FloatArray) -> FloatArray:
        """(2, m) coordinates and velocities from measured ones (n,): each gear bent by its load.

        Args:
            position, velocity: of the joints, as the encoders say.
            load: (n,) torque of the links on the joints.
        """
        matrix = self.robot.transmission_matrix
        at_drives = np.linalg.solve(matrix.T, load)
        bent = np.zeros(self.robot.n)
        for gear in self.gears:
            torque = at_drives[gear.drive]
            bent[gear.drive] = torque / gear.stiffness + np.sign(torque) * 0.5 * gear.gap
        drives = [gear.drive for gear in self.gears]
        return np.array(
            [
                np.concatenate([position - np.linalg.solve(matrix, bent), (matrix @ position)[drives]]),
                np.concatenate([velocity, (matrix @ velocity)[drives]]),
            ]
        )


def coordinates_of(robot: Robot, inertia: FloatArray, springs: Iterable[GearSpring], h: float) -> Coordinates:
    """The coordinates that springs make necessary.

    Args:
        robot: the arm.
        inertia: (n, n) of the drives, at the joints.
        springs: of gears; several on one drive are in series.
        h: integration step, s.

    Raises:
        IdentificationError: a drive with an elastic gear has no inertia of its own.
    """
    gears = []
    springs = tuple(springs)
    inverse = np.linalg.inv(robot.transmission_matrix)
    at_drives = np.diag(inverse.T @ inertia @ inverse)
    for drive in sorted({spring.drive for spring in springs}):
        own = [spring for spring in springs if spring.drive == drive]
        rotor = float(at_drives[drive])
        if rotor <= 0.0:
            raise IdentificationError(
                f"the rotor inertia of drive {drive + 1} is {rotor:.4g}, so its elastic gear cannot be"
                " simulated; allowed: greater than 0"
            )
        compliance = sum(spring.compliance for spring in own)
        gap = sum(spring.gap for spring in own)
        damping = sum(spring.damping for spring in own)
        at_link = max(spring.offset_at_link for spring in own)
        if compliance < 0.0 or gap < 0.0:
            raise IdentificationError(
                f"the gear of drive {drive + 1} has a compliance of {compliance:.4g} and a gap of {gap:.4g};"
                " allowed: not negative"
            )
        turn = _CONTACT_TURN / h
        stiffest = rotor * turn**2
        if compliance * stiffest < 1.0:
            compliance = 1.0 / stiffest
            damping = max(damping, 2.0 * _CONTACT_DAMPING * rotor * turn)
        cubic = max(spring.cubic for spring in own)
        gears.append(Gear(drive, rotor, 1.0 / compliance, damping, gap, at_link, cubic))
    return Coordinates(robot, tuple(gears))
