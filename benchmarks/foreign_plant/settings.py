"""How a log is made: motion, controller, timing, noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Motion = Literal["waypoints", "fourier", "multisine"]
Law = Literal["p_pi", "pd", "pd_torque"]
Friction = Literal["tanh", "stick"]


@dataclass(frozen=True)
class Settings:
    """Everything about a log but the arm and what is hidden in it.

    Attributes:
        motion: smooth ways between random postures, slow Fourier series, or ways with tones to 28 Hz.
        law: P-PI cascade with velocity feed-forward and filtered velocity; PD with feed-forward of velocity,
            acceleration and friction; PD with the whole torque of the nominal arm fed forward.
        friction: Coulomb friction as tanh(v / 5 mrad/s), or MuJoCo's constraint, which sticks.
        periods, period: how often the motion repeats, and its length, s; 1 for a log that repeats nothing.
        rate: of controller and log, Hz.
        step: of MuJoCo's integration, s.
        feed_forward: share of the reference's velocity that is fed forward.
        gain_error: relative error of the drive gains in ``robot.toml`` (all too large by it, or none).
        noise: factor of all noise.
    """

    motion: Motion = "waypoints"
    law: Law = "p_pi"
    friction: Friction = "tanh"
    periods: int = 3
    period: float = 10.0
    rate: float = 1000.0
    step: float = 5e-5
    feed_forward: float = 1.0
    gain_error: float = 0.0
    noise: float = 1.0

    @property
    def steps(self) -> int:
        """Integration steps per controller sample."""
        return round(1.0 / (self.rate * self.step))
