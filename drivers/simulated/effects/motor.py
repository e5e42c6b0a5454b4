"""Motors, current loops and the channels of the bus."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.effects.entry import DriveEntry, Finite, NonNegative, Positive, Share


class DriveGainError(DriveEntry):
    sentence: ClassVar[str] = "a drive gain that differs from the described one"
    change: Share = Field(description="relative change of g_τ")

    def fill(self, drive: np.void) -> None:
        drive["gain"] *= 1.0 + self.change


class CurrentOffset(DriveEntry):
    sentence: ClassVar[str] = "a current that flows although none is asked for and none is reported"
    torque: Finite = Field(description="N·m at the drive output")

    def fill(self, drive: np.void) -> None:
        drive["torque_offset"] = self.torque


class TorqueRipple(DriveEntry):
    sentence: ClassVar[str] = (
        "torque that varies with the motor angle, with current (ripple) or without (cogging)"
    )
    repeats: ClassVar[bool] = True
    amplitude: NonNegative = Field(default=0.0, description="cogging, N·m at the drive output")
    per_current: float = Field(default=0.0, ge=0.0, le=0.5, description="share of the motor's torque")
    order: Positive = Field(default=6.0, description="waves per motor revolution")
    phase: Finite = Field(default=0.0, description="rad")


class Saturation(DriveEntry):
    sentence: ClassVar[str] = (
        "the current stops growing below the described limit; the channel shows what was asked"
    )
    limit: Positive = Field(description="control signal beyond which the torque no longer grows")

    def fill(self, drive: np.void) -> None:
        drive["current_limit"] = self.limit


class TorqueConstantDroop(DriveEntry):
    sentence: ClassVar[str] = "iron that saturates: the current makes less torque the larger it is"
    loss: Share = Field(description="r of gain/(1 + r·(i/current)²)")
    current: Positive = Field(description="control signal at which the gain is down by 1 + loss")

    def fill(self, drive: np.void) -> None:
        drive["iron_loss"] = self.loss
        drive["iron_current"] = self.current


class CommandDeadZone(DriveEntry):
    sentence: ClassVar[str] = "control signals up to a size do nothing, larger ones lack that much"
    width: Positive = Field(description="on either side of zero, control-signal units")

    def fill(self, drive: np.void) -> None:
        drive["command_threshold"] = self.width


class EncoderEccentricity(DriveEntry):
    sentence: ClassVar[str] = (
        "a scale that turns about another point than its shaft: it reads a sine too much"
    )
    amplitude: Positive = Field(description="rad at the drive output")
    turns: Positive = Field(default=1.0, description="rad of the encoder per rad of the drive output")
    phase: Finite = Field(default=0.0, description="rad")

    def fill(self, drive: np.void) -> None:
        drive["scale_amplitude"] = self.amplitude
        drive["scale_turns"] = self.turns
        drive["scale_phase"] = self.phase


class RotorInertia(DriveEntry):
    sentence: ClassVar[str] = "rotor inertia other than the arm was drawn with"
    change: Finite = Field(description="kg·m² at the drive output, added to Ia")

    def fill(self, drive: np.void) -> None:
        drive["inertia"] += self.change


class CurrentLoopLag(DriveEntry):
    sentence: ClassVar[str] = "the current follows the control signal with a first-order lag"
    time_constant: Positive = Field(le=0.1, description="s")

    def fill(self, drive: np.void) -> None:
        drive["current_lag"] = self.time_constant


class TimeDelay(DriveEntry):
    sentence: ClassVar[str] = "channels of the bus that show the past; the position loop sees the present"
    position: float = Field(default=0.0, ge=0.0, le=0.1, description="age of the position, s")
    torque: float = Field(default=0.0, ge=0.0, le=0.1, description="age of the control signal, s")

    def fill(self, drive: np.void) -> None:
        drive["position_delay"] = self.position
        drive["torque_delay"] = self.torque


class ThermalGainDrift(DriveEntry):
    sentence: ClassVar[str] = "magnets weaken as the winding's losses warm them"
    outside_vocabulary: ClassVar[bool] = True
    per_kelvin: float = Field(default=-0.002, ge=-0.05, le=0.05, description="relative change of g_τ, 1/K")
    heating: Positive = Field(description="final warmth per square of the control signal, K")
    time_constant: Positive = Field(default=20.0, description="s")

    def fill(self, drive: np.void) -> None:
        drive["gain_per_kelvin"] = self.per_kelvin
        drive["winding_heating"] = self.heating
        drive["winding_time"] = self.time_constant


class MissedSamples(DriveEntry):
    sentence: ClassVar[str] = "now and then a control signal does not reach the current loop"
    outside_vocabulary: ClassVar[bool] = True
    rate: float = Field(gt=0.0, le=200.0, description="mean number of misses per second")
    samples: int = Field(default=2, ge=1, le=100, description="controller samples that each miss lasts")


class TorqueCrosstalk(DriveEntry):
    sentence: ClassVar[str] = "a share of one drive's torque turns up at another"
    outside_vocabulary: ClassVar[bool] = True
    repeats: ClassVar[bool] = True
    source: int = Field(ge=1, le=64, description="number of the drive that it comes from")
    share: Share = Field(description="of that drive's torque, at the drive outputs")

    def axes(self) -> tuple[int, ...]:
        return (self.drive, self.source)


class DraggingBrake(DriveEntry):
    sentence: ClassVar[str] = "a brake that rubs during a part of each period of time"
    rise: Share = Field(description="dry friction while it rubs, relative to Fc")
    period: Positive = Field(default=2.7, description="s")
    share: float = Field(default=0.4, gt=0.0, lt=1.0, description="of the period in which it rubs")

    def fill(self, drive: np.void) -> None:
        drive["drag_rise"] = self.rise
        drive["drag_period"] = self.period
        drive["drag_share"] = self.share
