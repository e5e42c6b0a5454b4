"""What a residual depends on: how much of it goes with position, speed, torque, time or direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.prepared_recording import PreparedRecording
from ident.parameters.base import BaseParameters
from ident.statistics.correlation_ratio import correlation_ratio
from robots.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class ResidualDependence:
    """One joint's residual against what it could depend on.

    ``shares`` maps each quantity to the share of the residual's variance that its course over that
    quantity explains (correlation ratio), less what chance would give; both are zero of a joint that stands
    still.
    """

    joint: int
    rms: float
    shares: tuple[tuple[str, float], ...]

    @property
    def strongest(self) -> tuple[str, float]:
        return max(self.shares, key=lambda item: item[1])

    def sentence(self) -> str:
        """In words, the joint counted from 1."""
        if self.rms == 0.0:
            return f"joint {self.joint + 1}: no row in which it moves"
        quantity, share = self.strongest
        if share < 0.1:
            return f"joint {self.joint + 1}: rms {self.rms:.3g}, with no single quantity"
        return f"joint {self.joint + 1}: rms {self.rms:.3g}, {100 * share:.0f} % of it goes with {quantity}"


def dependences_beside(
    base: BaseParameters, beta: FloatArray, prepared: Sequence[PreparedRecording]
) -> tuple[ResidualDependence, ...]:
    """Per joint, what the residual of a model with parameters β (b,) depends on."""
    residuals = [piece.residual(base, beta) for piece in prepared]
    torques = [piece.columns(base) @ beta for piece in prepared]
    return residual_dependences(prepared, residuals, torques)


def residual_dependences(
    prepared: Sequence[PreparedRecording], residuals: Sequence[FloatArray], torques: Sequence[FloatArray]
) -> tuple[ResidualDependence, ...]:
    """Per joint, what the residual depends on.

    Args:
        prepared: the recordings.
        residuals: per piece rows × joints, N·m (or N).
        torques: per piece predicted torque, rows × joints.
    """
    joints = residuals[0].shape[1]
    found = []
    for joint in range(joints):
        values, quantities = _series(prepared, residuals, torques, joint)
        shares = tuple((name, correlation_ratio(series, values)) for name, series in quantities.items())
        rms = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
        found.append(ResidualDependence(joint, rms, shares))
    return tuple(found)


def _series(
    prepared: Sequence[PreparedRecording],
    residuals: Sequence[FloatArray],
    torques: Sequence[FloatArray],
    joint: int,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    keep: list[BoolArray] = [piece.moving[:, joint] for piece in prepared]

    def pick(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([part[mask] for part, mask in zip(parts, keep, strict=True)])

    def state(name: str) -> FloatArray:
        return pick([piece.thin(getattr(piece.measured, name))[:, joint] for piece in prepared])

    velocity = state("velocity")
    quantities = {
        "position": state("position"),
        "speed": velocity,
        "acceleration": state("acceleration"),
        "torque": pick([torque[:, joint] for torque in torques]),
        "time": pick([piece.time for piece in prepared]),
        "direction": np.sign(velocity),
    }
    return pick([residual[:, joint] for residual in residuals]), quantities
