"""Gears that give way, and drives that turn with several joints."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from drivers.simulated.effects.entry import Axis, DriveEntry, Entry, Finite, NonNegative, Positive


class JointElasticity(DriveEntry):
    sentence: ClassVar[str] = (
        "two masses, rotor and output, with a spring and damper between (encoder on the rotor)"
    )
    stiffness: Positive = Field(description="N·m/rad at the drive output")
    damping: NonNegative | None = Field(
        default=None, description="N·m·s/rad; 3 % of critical damping where absent"
    )
    cubic: NonNegative = Field(default=0.0, description="stiffening, N·m/rad³")


class StiffeningElasticity(JointElasticity):
    sentence: ClassVar[str] = "as joint_elasticity, with a gear that stiffens as it is bent"
    cubic: Positive = Field(description="stiffening, N·m/rad³")


class Backlash(DriveEntry):
    sentence: ClassVar[str] = (
        "a dead zone between rotor and output, with stiff damped contact on either flank"
    )
    width: Positive = Field(description="of the whole dead zone, rad at the drive output")
    stiffness: Positive | None = Field(
        default=None, description="of the contact, N·m/rad; a 150 Hz resonance where absent"
    )
    damping: NonNegative | None = Field(default=None, description="N·m·s/rad; 20 % of critical where absent")


class Hysteresis(DriveEntry):
    sentence: ClassVar[str] = (
        "Maxwell-slip elements: torque that builds up over the way after each reversal, or a lagging wind-up"
    )
    torque: Positive = Field(description="that the elements carry when all of them slide, N·m")
    displacement: Positive = Field(description="way after which the last element slides, rad")
    between: Literal["rotor_and_housing", "rotor_and_output"] = Field(
        default="rotor_and_housing", description="what the elements join"
    )
    stiffness: Positive | None = Field(
        default=None,
        description="of the gear's spring beside them, N·m/rad, between rotor and output; a 150 Hz "
        "resonance where absent",
    )
    damping: NonNegative | None = Field(
        default=None, description="N·m·s/rad, of that spring; 3 % of critical where absent"
    )


class GearRipple(DriveEntry):
    sentence: ClassVar[str] = "transmission error: output = rotor − amplitude·sin(order·motor angle + phase)"
    repeats: ClassVar[bool] = True
    amplitude: Positive = Field(description="rad at the drive output")
    order: Positive = Field(default=2.0, description="waves per motor revolution (2 on strain-wave gears)")
    phase: Finite = Field(default=0.0, description="rad")
    stiffness: Positive | None = Field(
        default=None, description="of the gear, N·m/rad; a 150 Hz resonance where absent"
    )


class WristCoupling(Entry):
    sentence: ClassVar[str] = (
        "a shaft that turns with a sum of joint speeds and has inertia and friction, as inside a wrist"
    )
    repeats: ClassVar[bool] = True
    joints: tuple[Axis, Axis] = Field(description="the two joints, from 1")
    ratios: tuple[Finite, Finite] = Field(
        default=(1.0, 1.0), description="turns of the shaft per turn of each"
    )
    inertia: NonNegative = Field(default=0.0, description="kg·m²")
    viscous: NonNegative = Field(default=0.0, description="N·m·s/rad")
    coulomb: NonNegative = Field(default=0.0, description="N·m")

    def axes(self) -> tuple[int, ...]:
        return self.joints


class Transmission(Entry):
    sentence: ClassVar[str] = "a drive that turns with a joint by another ratio than described"
    repeats: ClassVar[bool] = True
    drive: Axis = Field(description="number of the drive, from 1")
    joint: Axis = Field(description="number of the joint, from 1")
    ratio: Finite = Field(description="drive output per joint position, instead of the described entry")

    def axes(self) -> tuple[int, ...]:
        return tuple(sorted({self.drive, self.joint}))
