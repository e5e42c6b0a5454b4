"""What hangs on the arm, pulls at it, or stands in its way."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.effects.entry import Entry, Finite, JointEntry, NonNegative, Positive

Vector = tuple[Finite, Finite, Finite]
Tilt = Annotated[float, Field(ge=-0.6, le=0.6)]


class Payload(Entry):
    sentence: ClassVar[str] = "a rigid body on the last link"
    mass: Positive = Field(description="kg")
    centre: Vector = Field(default=(0.0, 0.0, 0.0), description="centre of mass in the last link's frame, m")
    inertia: tuple[NonNegative, NonNegative, NonNegative] = Field(
        default=(0.0, 0.0, 0.0), description="moments about axes through its centre, along the link's, kg·m²"
    )


class GravitySpring(JointEntry):
    sentence: ClassVar[str] = "a spring between two anchors beside a joint, and/or a plain torsion spring"
    stiffness: NonNegative = Field(default=0.0, description="of the spring between the anchors, N/m")
    length: NonNegative = Field(default=0.0, description="free length of the spring, m")
    fixed_radius: Positive = Field(default=0.2, description="from the axis to the fixed anchor, m")
    moving_radius: Positive = Field(default=0.08, description="from the axis to the moving anchor, m")
    angle: Finite = Field(default=0.0, description="joint position at which both anchors are in line, rad")
    torsion: NonNegative = Field(default=0.0, description="stiffness of the torsion spring, N·m/rad")
    centre: Finite = Field(default=0.0, description="joint position at which it is at rest, rad")

    def fill(self, joint: np.void) -> None:
        joint["torsion_stiffness"] = self.torsion
        joint["torsion_centre"] = self.centre
        joint["spring_stiffness"] = self.stiffness
        joint["spring_length"] = self.length
        joint["spring_fixed_radius"] = self.fixed_radius
        joint["spring_angle"] = self.angle
        joint["spring_moving_radius"] = self.moving_radius


class BaseTilt(Entry):
    sentence: ClassVar[str] = "the base does not stand as described: turned about its x axis, then about y"
    roll: Tilt = Field(default=0.0, description="rad")
    pitch: Tilt = Field(default=0.0, description="rad")


class BaseCompliance(Entry):
    sentence: ClassVar[str] = (
        "a foot that gives way: the whole arm rocks about the base's x axis, y axis, or both"
    )
    roll: Positive | None = Field(default=None, description="stiffness about x, N·m/rad; firm where absent")
    pitch: Positive | None = Field(default=None, description="stiffness about y, N·m/rad; firm where absent")
    plate: NonNegative = Field(default=0.5, description="moment of inertia of the foot itself, kg·m²")


class CableSpring(JointEntry):
    sentence: ClassVar[str] = "a cable or dress pack that pulls back, stiffer the further it is bent"
    stiffness: NonNegative = Field(default=0.0, description="N·m/rad")
    cubic: NonNegative = Field(default=0.0, description="N·m/rad³")
    centre: Finite = Field(default=0.0, description="joint position at which it does not pull, rad")

    def fill(self, joint: np.void) -> None:
        joint["cable_stiffness"] = self.stiffness
        joint["cable_cubic"] = self.cubic
        joint["cable_centre"] = self.centre


class DressPackHysteresis(JointEntry):
    sentence: ClassVar[str] = "a bundle that pulls back, and whose strands slide on each other as it bends"
    slip: Positive = Field(description="torque of the strands when all of them slide, N·m")
    bend: Positive = Field(default=0.3, description="way over which they come to slide, rad")
    stiffness: NonNegative = Field(default=0.0, description="of the single strands, N·m/rad")
    centre: Finite = Field(default=0.0, description="joint position at which they do not pull, rad")

    def fill(self, joint: np.void) -> None:
        joint["pack_slip"] = self.slip
        joint["pack_bend"] = self.bend
        joint["pack_stiffness"] = self.stiffness
        joint["pack_centre"] = self.centre


class Contact(JointEntry):
    sentence: ClassVar[str] = "a wall at a joint: a stiff spring and damper that only push"
    upper: Finite | None = Field(default=None, description="position from which the wall pushes down, rad")
    lower: Finite | None = Field(default=None, description="position below which it pushes up, rad")
    stiffness: Positive = Field(default=300.0, description="N·m/rad")
    damping: NonNegative = Field(default=1.0, description="N·m·s/rad")

    def fill(self, joint: np.void) -> None:
        joint["wall_stiffness"] = self.stiffness
        joint["wall_damping"] = self.damping
        if self.upper is not None:
            joint["wall_upper"] = self.upper
        if self.lower is not None:
            joint["wall_lower"] = self.lower


class ToolContact(Entry):
    sentence: ClassVar[str] = "a plane that the tool runs into: n·p ≥ distance in the base frame"
    normal: Vector = Field(description="out of the obstacle, of any length but 0")
    distance: Finite = Field(description="of the plane from the base's origin along the normal, m")
    stiffness: Positive = Field(default=5000.0, description="N/m")
    damping: NonNegative = Field(default=20.0, description="N·s/m")
    point: Vector = Field(default=(0.0, 0.0, 0.1), description="the tool in the last link's frame, m")


class Vibration(JointEntry):
    sentence: ClassVar[str] = "a machine next door: a sinusoidal torque of fixed frequency"
    outside_vocabulary: ClassVar[bool] = True
    repeats: ClassVar[bool] = True
    amplitude: Positive = Field(description="N·m")
    frequency: Positive = Field(description="Hz, in no relation to the motion")
    phase: Finite = Field(default=0.0, description="rad")


class Slosh(JointEntry):
    sentence: ClassVar[str] = "a mass that swings on the link by a soft spring, as liquid does"
    outside_vocabulary: ClassVar[bool] = True
    inertia: Positive = Field(description="kg·m² about the joint")
    frequency: Positive = Field(le=50.0, description="of the mass on the link held still, Hz")
    damping: NonNegative = Field(default=0.03, description="ratio to critical damping")

    def fill(self, joint: np.void) -> None:
        rate = 2.0 * np.pi * self.frequency
        joint["slosh_inertia"] = self.inertia
        joint["slosh_stiffness"] = self.inertia * rate**2
        joint["slosh_damping"] = 2.0 * self.damping * self.inertia * rate


class TorqueBursts(JointEntry):
    sentence: ClassVar[str] = "a torque that wanders by a random walk, in bursts"
    outside_vocabulary: ClassVar[bool] = True
    deviation: Positive = Field(description="standard deviation at the end of a burst, N·m")
    duration: Positive = Field(default=1.0, description="of a burst, s")
    rate: Positive = Field(default=0.3, le=10.0, description="mean number of bursts per second")


class Dither(JointEntry):
    sentence: ClassVar[str] = "a square wave of torque of fixed frequency"
    outside_vocabulary: ClassVar[bool] = True
    amplitude: Positive = Field(description="N·m")
    frequency: Positive = Field(default=37.0, description="Hz")
