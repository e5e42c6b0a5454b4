"""How samples become rows: the settings of an arm's identification in ``robot.toml``."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from robots.errors import ValueNotAllowed
from robots.fields import Frozen, whole_number

Rows = Annotated[int, Field(ge=0, le=10_000_000)]


def flags(value: object) -> object:
    """Refuse what is neither a flag nor a list of flags, in one sentence for both."""
    parts = value if isinstance(value, (list, tuple)) else [value]
    if not all(isinstance(part, bool) for part in parts):
        raise ValueNotAllowed(
            (), "is neither true nor false", "true or false, or a list of these, one per joint"
        )
    return value


Flags = Annotated[bool | tuple[bool, ...], BeforeValidator(flags)]


class Identification(Frozen):
    """How samples become rows: the settings of method.md 2, per arm."""

    cutoff_hz: float = Field(ge=1e-3, le=1e6, description="zero-phase Butterworth cut-off for q")
    filter_order: int = Field(default=4, ge=1, le=8)
    decimation: int = Field(default=1, ge=1, le=10_000, description="keep one row in so many")
    decimation_filter: Literal["chebyshev", "fir"] = Field(
        default="fir",
        description="fir reaches four rows and no farther; chebyshev is MATLAB's decimate, which rings",
    )
    derivative_accuracy: Annotated[Literal[2, 4, 6, 8], BeforeValidator(whole_number)] = Field(
        default=2, description="order of the central differences; 2 is the paper's"
    )
    trim_samples: tuple[Rows, Rows] = Field(
        default=(50, 50), description="dropped at the start and at the end after filtering"
    )
    control_signal_lag: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="s from the reading of v_τ to its torque; half a controller sample for a held output",
    )
    alignment: Literal["given", "estimate"] = Field(
        default="given", description="estimate: the lag is found in the data, starting from the given one"
    )
    torque_filter: Literal["positions", "none"] = Field(
        default="positions",
        description="low-pass of the torque: that of the positions, so that both sides of the model see one"
        " filter; or none, as some published figures were made",
    )
    control_signal_reading: Literal["averaged", "sampled"] = Field(
        default="averaged",
        description="sampled: v_τ at the instant of the position; what it does until the next is added",
    )
    friction: Literal["symmetric", "asymmetric"] = Field(
        default="symmetric", description="one Fv and Fc per joint, or one of each per direction"
    )
    friction_sign: Literal["sign", "tanh"] = "tanh"
    friction_width: float = Field(
        default=0.02, ge=0, le=10, description="rad/s or m/s; the speed at which tanh(q̇/width) saturates"
    )
    minimum_speed: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="share of a joint's velocity limit; rows in which it moves slower are left out",
    )
    standstill_margin: float = Field(
        default=0.0,
        ge=0,
        le=100,
        description="s; rows this near in time to one below minimum_speed are left out too",
    )
    offset: Flags = Field(
        default=True,
        description="one torque offset per joint, or which joints have one: none that turns one way only",
    )
    rotor_inertia: bool = Field(
        default=True, description="false where torque sensors at the links do not feel the rotors"
    )
    covariance: Literal["iid", "block", "ar", "hc", "hac", "cluster", "bootstrap"] = Field(
        default="ar",
        description="of the estimates, by name: what is assumed of the errors; block is the paper's",
    )
    error_deviation: Literal["unbiased", "sample"] = Field(
        default="unbiased",
        description="σ_j of a residual: over rows less parameters, or the sample deviation (rows less one)",
    )
    instrument_margin: float = Field(
        default=0.05, ge=1e-6, le=1, description="equivalence margin of gate 1, as a share of a column's norm"
    )
    torque_margin: float = Field(
        default=0.05,
        ge=1e-6,
        le=1,
        description="share of a joint's torque that the simulation may lack as a function of motion",
    )
    following_error_margin: float = Field(
        default=0.005,
        ge=1e-6,
        le=1,
        description="share of a drive's following error that the simulation may lack as a function of motion",
    )

    @model_validator(mode="after")
    def _tanh_needs_a_width(self) -> Self:
        if self.friction_sign == "tanh" and self.friction_width == 0:
            raise ValueNotAllowed(
                ("friction_width",), 'does not go with friction_sign "tanh"', "a number, greater than 0"
            )
        return self
