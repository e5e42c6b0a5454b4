"""What a drive's control law can look like, besides its gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Law = Literal["pd", "pid", "cascade_p_pi", "free"]
Interpolation = Literal["linear", "spline", "hold"]


@dataclass(frozen=True)
class Timing:
    """How the loop reads and writes: common to all drives.

    Attributes:
        interpolation: of the set-points between two SYNCs.
        difference: q̇ is (q[k] − q[k−N]) / (N · sample_time).
        cutoff_hz: first-order low-pass on that velocity; None for none.
        delay: controller samples from reading to output.
    """

    interpolation: Interpolation
    difference: int
    cutoff_hz: float | None
    delay: int

    def words(self) -> str:
        low_pass = (
            "no velocity filter" if self.cutoff_hz is None else f"velocity filter {self.cutoff_hz:.3g} Hz"
        )
        return (
            f"set-points {self.interpolation}, velocity over {self.difference} samples, {low_pass},"
            f" delay of {self.delay} samples"
        )


@dataclass(frozen=True)
class Form:
    """Which terms the law has.

    Attributes:
        law: ``free`` has every column with a gain of its own; it serves to find the timing.
        velocity_feed_forward: whether the set-point's velocity enters.
        acceleration_feed_forward: whether its acceleration is added to the output.
    """

    law: Law
    velocity_feed_forward: bool
    acceleration_feed_forward: bool

    @property
    def count(self) -> int:
        """Number of gains; of two forms that do as well the one with fewer is taken."""
        base = {"pd": 2, "pid": 4, "cascade_p_pi": 4, "free": 6}[self.law]
        return base + self.velocity_feed_forward + self.acceleration_feed_forward

    def words(self) -> str:
        name = {
            "pd": "P position, P velocity (or PD)",
            "pid": "PID",
            "cascade_p_pi": "cascade P-PI",
            "free": "any",
        }
        fed = [
            word
            for word, there in (
                ("velocity", self.velocity_feed_forward),
                ("acceleration", self.acceleration_feed_forward),
            )
            if there
        ]
        return name[self.law] + (f" with feed-forward of {' and '.join(fed)}" if fed else "")


FREE = Form("free", velocity_feed_forward=True, acceleration_feed_forward=True)
FORMS = tuple(
    Form(law, velocity, acceleration)
    for law in ("pd", "pid", "cascade_p_pi")
    for velocity in (False, True)
    for acceleration in (False, True)
)
