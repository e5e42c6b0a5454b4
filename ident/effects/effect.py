"""What every effect is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from robots.arrays import FloatArray


@dataclass(frozen=True)
class State:
    """The motion at which torques are asked for: q, q̇, q̈, each samples × joints, rad (or m) and s.

    ``time`` (samples,) is the time since the arm was switched on or the first recording began, s. Effects
    with a history (drift, elasticity, hysteresis) need it and evenly spaced samples in order; all others
    look at each sample alone. ``torque`` is the measured joint torque, samples × joints, where there is one:
    a saturated drive shows only against it.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    time: FloatArray | None = None
    torque: FloatArray | None = None


class Effect(Protocol):
    """One named cause of joint torque, linear in its parameters.

    ``name`` is the identifier of the vocabulary (method.md 6), ``sentence`` says what it is.
    """

    @property
    def name(self) -> str: ...

    @property
    def sentence(self) -> str: ...

    @property
    def parameter_names(self) -> tuple[str, ...]: ...

    @property
    def units(self) -> tuple[str, ...]: ...

    def columns(self, state: State) -> FloatArray:
        """Torque per unit of each parameter: samples × joints × parameters."""
        ...
