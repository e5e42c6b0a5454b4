"""The position loop inside the drives, as a robot.toml describes it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from robots.errors import ValueNotAllowed
from robots.fields import Omittable

Gain = Annotated[float, Field(ge=1e-9, le=1e9)]
GainOrNone = Annotated[float, Field(ge=0, le=1e9)]
Share = Annotated[float, Field(ge=0, le=2)]


class Controller(Omittable):
    """The position loop inside the drives (eq. 4 of the paper); gains have one entry per drive.

    ``cascade_p_pi``: v = velocity_gain · (position_gain·e + feed_forward·q̇_r − q̇) + its integral,
    ``pd``:           v = position_gain·e + velocity_gain·(feed_forward·q̇_r − q̇),
    ``pid``:          the same with integral_gain · ∫e.
    e is reference minus position at the drive output; v is the control signal v_τ. To each of them comes
    friction_feed_forward · q̇_r + acceleration_feed_forward · q̈_r, before the limit.
    """

    type: Literal["cascade_p_pi", "pd", "pid"]
    sample_time: float = Field(ge=1e-6, le=0.1, description="s")
    position_gain: tuple[Gain, ...]
    velocity_gain: tuple[Gain, ...]
    integral_gain: tuple[GainOrNone, ...] = Field(
        description="1/s on the velocity error for cascade_p_pi; v_τ per (rad·s) for pid; 0 for pd"
    )
    velocity_feed_forward: tuple[Share, ...]
    friction_feed_forward: tuple[GainOrNone, ...] | None = Field(
        default=None, description="v_τ per rad/s of the set-point's velocity, added to the output"
    )
    acceleration_feed_forward: tuple[GainOrNone, ...] | None = Field(
        default=None, description="v_τ per rad/s² of the set-point's acceleration, added to the output"
    )
    velocity_difference_samples: int = Field(
        default=1,
        ge=1,
        le=64,
        description="q̇ is (q[k] − q[k−N]) / (N · sample_time); 2 is the two-point mean's difference",
    )
    velocity_cutoff_hz: float | None = Field(
        default=None, ge=0.1, le=1e6, description="first-order low-pass on that velocity; none where absent"
    )
    delay_samples: int = Field(default=0, ge=0, le=64, description="samples from reading to output")
    saturation: tuple[Gain, ...] = Field(description="|v_τ| limit")
    interpolation: Literal["linear", "spline", "hold"] = Field(
        default="linear",
        description="how the drive fills the time between two SYNCs; hold jumps to the target",
    )

    @model_validator(mode="after")
    def _pd_has_no_integral(self) -> Self:
        if self.type == "pd" and any(self.integral_gain):
            raise ValueNotAllowed(("integral_gain",), 'does not go with type "pd"', "0 for each drive")
        return self
