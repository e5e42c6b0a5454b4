"""Homing mode (CiA 402-2): what one drive is told before it searches its home, and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from drivers.cia402 import objects
from drivers.errors import DriveError
from drivers.setup.mode import set_mode
from drivers.setup.profiles import Profile
from drivers.setup.sdo import SdoAccess
from drivers.setup.told_units import Settings
from drivers.setup.units_check import unknown_velocity_unit, velocity_scale
from robots.description import Robot
from robots.drive_description import LARGEST_HOMING_SPEED

HOMING_SHARE = LARGEST_HOMING_SPEED
LARGEST_METHOD = 37


@dataclass(frozen=True)
class Homing:
    """One search.

    Attributes:
        joint: name of the joint whose drive searches.
        method: 6098h; which ones there are stands in the drive's manual.
        position: what the drive's output reads at its home, rad or m.
        travel: how far the output may move until home is found, rad or m.
        share: of the joint's velocity and acceleration limits, above 0, at most HOMING_SHARE.
        seconds: how long the search may take.
    """

    joint: str
    method: int
    position: float
    travel: float
    share: float = HOMING_SHARE
    seconds: float = 60.0

    @classmethod
    def described(cls, robot: Robot, joint: str) -> Self:
        """The search that the arm's description has for a joint's drive.

        Raises:
            DriveError: there is no such joint, or no search for it.
        """
        for each, drive in zip(robot.joint, robot.drive, strict=True):
            if each.name != joint:
                continue
            if (search := drive.homing) is None:
                raise DriveError(
                    f"joint {joint}: its drive has no search for home; give it [drive.homing] in robot.toml"
                )
            return cls(joint, search.method, search.position, search.travel, search.speed, search.seconds)
        raise DriveError(
            f"no joint {joint!r} to home; allowed: {', '.join(each.name for each in robot.joint)}"
        )

    def axis(self, robot: Robot) -> int:
        """Index of its drive, after a look at all values.

        Raises:
            DriveError: names the value and what is allowed.
        """
        names = [joint.name for joint in robot.joint]
        if self.joint not in names:
            raise DriveError(f"no joint {self.joint!r} to home; allowed: {', '.join(names)}")
        if not -128 <= self.method <= LARGEST_METHOD or self.method == 0:
            raise DriveError(
                f"homing method {self.method}; allowed: 1 to {LARGEST_METHOD}, or a maker's own below 0"
            )
        if not 0 < self.share <= HOMING_SHARE:
            raise DriveError(
                f"homing at {self.share:g} of the limits; allowed: above 0, at most {HOMING_SHARE:g}"
            )
        for name in ("travel", "seconds"):
            if not 0 < getattr(self, name) < np.inf:
                raise DriveError(f"homing: {name} is {getattr(self, name):g}; allowed: above 0")
        if not np.isfinite(self.position):
            raise DriveError(f"homing: position is {self.position:g}; allowed: a finite number")
        return names.index(self.joint)

    def pace(self, robot: Robot) -> tuple[float, float]:
        """Speed and acceleration of the search at the drive's output, rad or m per s and s²."""
        axis, across = self.axis(robot), np.abs(robot.transmission_matrix)
        limits = robot.velocity_limits, robot.acceleration_limits
        speed, acceleration = (self.share * float((across @ limit)[axis]) for limit in limits)
        return speed, acceleration

    def offset(self, robot: Robot) -> int:
        """What the drive reads at its home (607Ch), counts."""
        return round(self.position * float(robot.counts_per_output_unit[self.axis(robot)]))


def prepare_homing(
    sdo: SdoAccess, robot: Robot, homing: Homing, settings: Settings, profile: Profile
) -> None:
    """Method, speeds, acceleration and home offset, each read back; then homing mode. Torque stays off.

    Args:
        sdo: the drive.
        robot: the description.
        homing: the search.
        settings: read from the drive at set-up: what units its velocities have.
        profile: which kind of drive it is.

    Raises:
        DriveError: the drive has no homing mode, an unknown unit of velocity, refuses a value or changes it.
    """
    modes = sdo.read_optional(objects.SUPPORTED_MODES)
    if modes is not None and not modes >> (objects.HOMING - 1) & 1:
        raise DriveError(f"{sdo.drive}: 6502 = 0x{modes:08X} has no homing mode (bit 5)")
    axis = homing.axis(robot)
    if unknown_velocity_unit(robot, axis, settings):
        raise DriveError(
            f"{sdo.drive}: 60A9 = 0x{settings['60A9']:08X} is no unit of velocity that is known here: the "
            "speed of its homing cannot be given; set 60A9 to 0x00B44700 (rev/min)"
        )
    size = abs(float(robot.counts_per_output_unit[axis])) / velocity_scale(robot, axis, settings)
    speed, acceleration = (pace * size for pace in homing.pace(robot))
    sdo.write_checked(objects.HOMING_METHOD, 0, homing.method, 1)
    for subindex in (1, 2):
        sdo.write_checked(objects.HOMING_SPEEDS, subindex, max(1, round(speed)), 4)
    sdo.write_checked(objects.HOMING_ACCELERATION, 0, max(1, round(acceleration)), 4)
    offset = -homing.offset(robot) if profile.home_offset_negated else homing.offset(robot)
    sdo.write_checked(objects.HOME_OFFSET, 0, offset, 4)
    set_mode(sdo, objects.HOMING, shown=not profile.mode_shown_when_enabled)


def end_homing(sdo: SdoAccess, mode: int, profile: Profile) -> None:
    """Back to the mode of set-points.

    Raises:
        DriveError: the drive does not show it.
    """
    set_mode(sdo, mode, shown=not profile.mode_shown_when_enabled)
