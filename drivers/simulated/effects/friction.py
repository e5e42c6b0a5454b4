"""Friction other than the constant figures of the arm."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.effects.entry import DriveEntry, Finite, NonNegative, Positive, Share


class ViscousFriction(DriveEntry):
    sentence: ClassVar[str] = "more (or less) viscous friction than the arm was drawn with"
    change: Share = Field(description="relative change of Fv")

    def fill(self, drive: np.void) -> None:
        drive["viscous"] *= 1.0 + self.change


class CoulombFriction(DriveEntry):
    sentence: ClassVar[str] = "more (or less) Coulomb friction than the arm was drawn with"
    change: Share = Field(description="relative change of Fc")

    def fill(self, drive: np.void) -> None:
        drive["coulomb"] *= 1.0 + self.change


class AsymmetricFriction(DriveEntry):
    sentence: ClassVar[str] = "friction that differs with the direction: levels (1 ± c)·Fc and (1 ± v)·Fv"
    coulomb: float = Field(default=0.0, gt=-0.95, lt=0.95, description="c")
    viscous: float = Field(default=0.0, gt=-0.95, lt=0.95, description="v")

    def fill(self, drive: np.void) -> None:
        drive["coulomb_asymmetry"] = self.coulomb
        drive["viscous_asymmetry"] = self.viscous


class StribeckFriction(DriveEntry):
    sentence: ClassVar[str] = "level Fc·(1 + rise·exp(−|q̇/speed|^exponent))"
    rise: Share = Field(description="at low speed, relative to Fc")
    speed: Positive = Field(description="Stribeck speed, rad/s or m/s")
    exponent: float = Field(default=1.0, ge=0.5, le=4.0, description="1 is Tustin's form, 2 is Gauss'")

    def fill(self, drive: np.void) -> None:
        drive["stribeck_rise"] = self.rise
        drive["stribeck_speed"] = self.speed
        drive["stribeck_exponent"] = self.exponent


class StaticFriction(DriveEntry):
    sentence: ClassVar[str] = "stiction: a higher level near standstill and a long pre-sliding displacement"
    rise: NonNegative = Field(description="breakaway level above Fc, relative to Fc")
    speed: Positive = Field(default=0.003, description="speed at which the rise is nearly gone, rad/s")
    displacement: Positive | None = Field(
        default=None, description="pre-sliding displacement, rad or m; the arm's own where absent"
    )

    def fill(self, drive: np.void) -> None:
        drive["static_rise"] = self.rise
        drive["static_speed"] = self.speed
        if self.displacement is not None:
            drive["bristle_width"] = self.displacement


class NonlinearViscousFriction(DriveEntry):
    sentence: ClassVar[str] = "Fv·q̇·(1 − share + share·|q̇/reference|^(exponent − 1)) + cubic·q̇³"
    share: float = Field(default=0.0, ge=-1.0, le=1.0, description="share of Fv that follows the power law")
    exponent: float = Field(default=0.5, ge=0.0, le=4.0, description="below 1 sub-linear, 1 linear")
    reference: Positive = Field(default=1.0, description="speed at which the torque is the linear one, rad/s")
    cubic: NonNegative = Field(default=0.0, description="N·m·(s/rad)³")

    def fill(self, drive: np.void) -> None:
        drive["power_share"] = self.share
        drive["power_exponent"] = self.exponent
        drive["power_speed"] = self.reference
        drive["cubic_viscous"] = self.cubic


class LoadDependentFriction(DriveEntry):
    sentence: ClassVar[str] = "the level grows with the torque through the gear: Fc + coefficient·|load|"
    coefficient: NonNegative = Field(description="N·m of friction per N·m through the gear")
    time_constant: Positive = Field(default=0.005, description="the lubricant's, of the load, s")

    def fill(self, drive: np.void) -> None:
        _add_of_load(drive, self.coefficient, self.coefficient, self.time_constant)


class LoadQuadraticFriction(DriveEntry):
    sentence: ClassVar[str] = "the level grows with the square of the torque: Fc + coefficient·load²"
    coefficient: NonNegative = Field(description="N·m of friction per (N·m)² through the gear")
    time_constant: Positive = Field(default=0.005, description="the lubricant's, of the load, s")

    def fill(self, drive: np.void) -> None:
        unit = drive["coulomb"] if drive["coulomb"] > 0 else np.inf
        drive["load_time"] = self.time_constant
        drive["load_square"] += self.coefficient / unit


class DirectionalEfficiency(DriveEntry):
    sentence: ClassVar[str] = "a gear that takes other shares of the load while it drives it and while driven"
    driving: NonNegative = Field(description="share of the load that it takes while it drives it, 1/η − 1")
    driven: NonNegative = Field(description="share of the load that it takes while driven by it, 1 − η")
    time_constant: Positive = Field(default=0.005, description="the lubricant's, of the load, s")

    def fill(self, drive: np.void) -> None:
        _add_of_load(drive, self.driving, self.driven, self.time_constant)


class PositionDependentFriction(DriveEntry):
    sentence: ClassVar[str] = "a level that varies with the drive's position: a wave, or one tight spot"
    wave: float = Field(default=0.0, gt=-0.95, lt=0.95, description="height of the wave relative to Fc")
    order: Positive = Field(default=1.0, description="waves per 2π of the drive output (per 2π m)")
    phase: Finite = Field(default=0.0, description="position of the crest times order, rad")
    spot: Share = Field(default=0.0, description="height of the spot relative to Fc")
    spot_centre: Finite = Field(default=0.0, description="rad or m")
    spot_width: Positive = Field(default=0.2, description="standard deviation of the spot, rad or m")

    def fill(self, drive: np.void) -> None:
        drive["wave_height"] = self.wave
        drive["wave_order"] = self.order
        drive["wave_phase"] = self.phase
        drive["spot_height"] = self.spot
        drive["spot_centre"] = self.spot_centre
        drive["spot_width"] = self.spot_width


class DriftingFriction(DriveEntry):
    sentence: ClassVar[str] = "friction that changes while the gear warms up, cools or follows the room"
    viscous_per_kelvin: float = Field(default=-0.012, ge=-0.2, le=0.2, description="relative, 1/K")
    coulomb_per_kelvin: float = Field(default=-0.003, ge=-0.2, le=0.2, description="relative, 1/K")
    start: Finite = Field(
        default=0.0, description="gear above the temperature of the figures at the start, K"
    )
    ambient: Finite = Field(default=0.0, description="surroundings above the same, K")
    ambient_rate: Finite = Field(default=0.0, description="drift of the surroundings, K/s")
    heating: NonNegative = Field(default=0.3, description="final warmth per power of friction, K/W")
    time_constant: Positive = Field(default=60.0, description="of warming and cooling, s")

    def fill(self, drive: np.void) -> None:
        drive["start_warmth"] = self.start
        drive["ambient_warmth"] = self.ambient
        drive["ambient_rate"] = self.ambient_rate
        drive["heating"] = self.heating
        drive["warming_time"] = self.time_constant
        drive["coulomb_per_kelvin"] = self.coulomb_per_kelvin
        drive["viscous_per_kelvin"] = self.viscous_per_kelvin


class TemperatureViscousFriction(DriveEntry):
    sentence: ClassVar[str] = (
        "oil that gets thinner as the gear warms, beside dry friction that does not change"
    )
    per_kelvin: float = Field(default=-0.015, ge=-0.2, le=0.0, description="relative change of Fv, 1/K")
    start: Finite = Field(default=0.0, description="oil above the temperature of the figures at the start, K")
    ambient: Finite = Field(default=0.0, description="surroundings above the same, K")
    heating: NonNegative = Field(default=0.3, description="final warmth per power of friction, K/W")
    time_constant: Positive = Field(default=60.0, description="of warming and cooling, s")

    def fill(self, drive: np.void) -> None:
        drive["viscous_per_kelvin"] += self.per_kelvin
        drive["start_warmth"] = self.start
        drive["ambient_warmth"] = self.ambient
        drive["heating"] = self.heating
        drive["warming_time"] = self.time_constant


def _add_of_load(drive: np.void, driving: float, driven: float, time: float) -> None:
    """Friction in N·m per N·m of load, which the level counts in units of the Coulomb torque."""
    unit = drive["coulomb"] if drive["coulomb"] > 0 else np.inf
    drive["load_time"] = time
    drive["load_rise"] += driving / unit
    drive["driven_rise"] += driven / unit
