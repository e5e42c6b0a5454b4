"""What one drive of an arm is: counts, gear, gain, identity, and how it comes to know its position."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from robots.errors import ValueNotAllowed
from robots.fields import Frozen, Omittable, missing, whole_number

INT32_MAX = 2**31 - 1

LARGEST_HOMING_SPEED = 0.05
"""Largest share of a joint's velocity and acceleration limits in a search for home."""


class ControlSignal(Frozen):
    """The CANopen object that carries the control signal v_τ, and the value of one count of it."""

    index: int = Field(default=0x6077, ge=0x1000, le=0xFFFF)
    subindex: int = Field(default=0, ge=0, le=255)
    per_count: float = Field(ge=1e-9, le=1e6, description="control-signal units per count of the object")
    sign: Annotated[Literal[-1, 1], BeforeValidator(whole_number)] | None = Field(
        default=None,
        description="-1 where a positive value pushes against the drive output; absent: as the position",
    )


class DriveDynamics(Frozen):
    """What a data sheet or an earlier identification says of one drive, at the drive output.

    It is a *prior*: planning checks torques with it and the identification compares with it.
    """

    inertia: float = Field(ge=0, le=1e5, description="rotor and gear inertia Ia, kg·m² or kg")
    viscous: float = Field(ge=0, le=1e6, description="Fv, N·m·s/rad or N·s/m")
    coulomb: float = Field(ge=0, le=1e5, description="Fc, N·m or N")


UInt32 = Annotated[int, Field(ge=0, le=2**32 - 1)]


class Identity(Frozen):
    """What the drive's identity object (1018h) must say; only the entries given are compared."""

    vendor: UInt32 | None = Field(default=None, description="1018:01")
    product: UInt32 | None = Field(default=None, description="1018:02")
    revision: UInt32 | None = Field(default=None, description="1018:03")
    serial: UInt32 | None = Field(default=None, description="1018:04")


class Brake(Frozen):
    """How long the holding brake takes, so that nothing moves against it or falls before it holds."""

    release: float = Field(default=0.0, ge=0, le=10, description="s from torque on to an open brake")
    engage: float = Field(default=0.0, ge=0, le=10, description="s from the command to a brake that holds")


class TemperatureObject(Frozen):
    """The object in which a drive says how warm it is; none is standard."""

    index: int = Field(ge=0x1000, le=0xFFFF)
    subindex: int = Field(default=0, ge=0, le=255)
    per_count: float = Field(default=1.0, ge=1e-6, le=1e3, description="°C per count of the object")


class VelocityObject(Frozen):
    """The object in which a drive says how fast it is; 606Ch is the profile's."""

    index: int = Field(default=0x606C, ge=0x1000, le=0xFFFF)
    subindex: int = Field(default=0, ge=0, le=255)
    counts_per_second: float = Field(
        default=1.0,
        ge=1e-6,
        le=1e9,
        description="position units (6064h) per second in one unit of the object",
    )


class HomingSearch(Frozen):
    """How the drive searches its home by itself, in homing mode; `armhil home` has it do so."""

    method: int = Field(ge=-128, le=37, description="6098h; the drive's manual says which ones it has; not 0")
    position: float = Field(ge=-100, le=100, description="what the drive output reads at home, rad or m")
    travel: float = Field(
        ge=1e-6, le=200, description="how far the drive output may move until home is found, rad or m"
    )
    speed: float = Field(
        default=LARGEST_HOMING_SPEED,
        ge=1e-4,
        le=LARGEST_HOMING_SPEED,
        description="share of the joint's velocity and acceleration limits",
    )
    seconds: float = Field(default=60.0, ge=0.1, le=3600, description="how long the search may take")

    @model_validator(mode="after")
    def _a_method_is_a_number_of_one(self) -> Self:
        if self.method == 0:
            raise ValueNotAllowed(("method",), "is no method", "1 to 37, or a maker's own from -128 to -1")
        return self


class Drive(Omittable):
    """One CiA 402 drive. Its output is the gear's output shaft, in rad (or m)."""

    node_id: int = Field(ge=1, le=127)
    encoder_counts: int | None = Field(
        default=None,
        ge=1,
        le=INT32_MAX,
        description="counts of the encoder per motor revolution, after quadrature (608F)",
    )
    gear: float = Field(ge=1e-3, le=1e5, description="motor revolutions per output revolution (or per metre)")
    sign: Annotated[Literal[-1, 1], BeforeValidator(whole_number)] = Field(
        default=1, description="-1 where the motor turns against the drive output"
    )
    control_signal: ControlSignal
    gain: float = Field(
        ge=1e-6, le=1e6, description="drive gain g_τ: N·m (or N) at the output per unit of v_τ"
    )
    gain_relative_uncertainty: float = Field(ge=0, le=1, description="standard uncertainty of g_τ / g_τ")
    dynamics: DriveDynamics
    counts_per_output_turn: float | None = Field(
        default=None,
        ge=1e-3,
        le=INT32_MAX,
        description="units of the position objects (6064h, 607Ah) per turn of the drive output, or per metre",
    )
    identity: Identity = Identity()
    eds: str | None = Field(
        default=None, min_length=1, description="EDS or DCF of the drive, relative to robot.toml"
    )
    profile: str | None = Field(
        default=None, min_length=1, description="kind of drive; by its identity (1018) where absent"
    )
    position_reference: Literal["absolute", "homing"] = Field(
        default="absolute", description="homing: the position is lost with the supply and must be attested"
    )
    homing: HomingSearch | None = Field(
        default=None, description="how the drive searches its home; none where absent"
    )
    brake: Brake = Brake()
    temperature: TemperatureObject | None = Field(
        default=None, description="where the drive has its temperature; none where absent"
    )
    velocity: VelocityObject | None = Field(
        default=None, description="where the drive has its velocity; not recorded where absent"
    )

    @model_validator(mode="after")
    def _has_a_unit_of_position(self) -> Self:
        if self.encoder_counts is None and self.counts_per_output_turn is None:
            raise ValueNotAllowed(
                ("encoder_counts",), "is missing", "encoder_counts, or counts_per_output_turn, or both"
            )
        return self

    @classmethod
    def of_log(cls) -> Drive:
        """A drive of which nothing is known but its torque: the control signal is that torque."""
        nothing = DriveDynamics(inertia=0.0, viscous=0.0, coulomb=0.0)
        return cls.model_construct(gain=1.0, gain_relative_uncertainty=0.0, dynamics=nothing)

    @property
    def control_signal_per_count(self) -> float:
        """Control-signal units per count of its object, signed, in the sense of the drive output.

        A motor that turns against the output counts position and torque against it, both: so the sign is that
        of the position, unless the drive turns that of the position alone (607E, bit 7).
        """
        return (self.control_signal.sign or self.sign) * self.control_signal.per_count

    @property
    def output_counts(self) -> float:
        """Units of the position objects per turn (or metre) of the drive output, without sign.

        ``counts_per_output_turn`` where the description has it; else the drive counts its encoder.
        """
        if self.counts_per_output_turn is not None:
            return self.counts_per_output_turn
        if self.encoder_counts is None:
            raise missing("drive", "counts_per_output_turn")
        return self.encoder_counts * self.gear
