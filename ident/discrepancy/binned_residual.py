"""Pictures of a finding as numbers: the residual over the quantity it goes with, and what the effect adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.residual_dependence import ResidualDependence
from robots.arrays import FloatArray

_BINS = 48


@dataclass(frozen=True)
class BinnedResidual:
    """One joint's residual in bins of one quantity, N·m (or N); all arrays (bins,).

    Attributes:
        joint: from 0.
        quantity: what the residual goes with most: position, speed, acceleration, torque, time, direction.
        centre: of the bins, SI.
        before: mean residual without the effect.
        added: mean change of the predicted torque that the effect brings.
        after: mean residual with it.
        spread: standard deviation of the residual after, within the bin.
    """

    joint: int
    quantity: str
    centre: FloatArray
    before: FloatArray
    added: FloatArray
    after: FloatArray
    spread: FloatArray


def binned_residual(
    prepared: Sequence[PreparedRecording],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
    dependences: Sequence[ResidualDependence],
) -> BinnedResidual:
    """The joint whose residual the effect changes most, over the quantity that residual goes with.

    Args:
        prepared: the recordings.
        before, after: per piece residual torque, rows × joints.
        torques: per piece predicted torque before, rows × joints.
        dependences: what the residual before depends on, per joint.
    """
    squares = sum(
        np.where(piece.moving, (b - a) ** 2, 0.0).sum(axis=0)
        for piece, b, a in zip(prepared, before, after, strict=True)
    )
    noise = sum(
        np.where(piece.moving, a**2, 0.0).sum(axis=0) for piece, a in zip(prepared, after, strict=True)
    )
    joint = int(np.argmax(np.asarray(squares) / np.maximum(np.asarray(noise), 1e-300)))
    quantity = max(
        (item for item in dependences[joint].shares if item[0] != "direction"), key=lambda item: item[1]
    )[0]
    return _over(prepared, before, after, torques, joint, quantity)


def binned_residuals(
    prepared: Sequence[PreparedRecording],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
) -> tuple[BinnedResidual, ...]:
    """Every joint's residual over speed, position, torque and time, joint by joint; arguments as above."""
    joints = prepared[0].torque.shape[1]
    return tuple(
        _over(prepared, before, after, torques, joint, quantity)
        for joint in range(joints)
        for quantity in ("speed", "position", "torque", "time")
    )


def _over(
    prepared: Sequence[PreparedRecording],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
    joint: int,
    quantity: str,
) -> BinnedResidual:
    """One joint's residual in bins of one quantity."""

    def pick(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate(
            [part[piece.moving[:, joint], joint] for part, piece in zip(parts, prepared, strict=True)]
        )

    series = pick(
        [_quantity(piece, quantity, torque) for piece, torque in zip(prepared, torques, strict=True)]
    )
    first, last = pick(before), pick(after)
    if not series.size:  # the joint stands still
        return BinnedResidual(joint, quantity, series, first, first, last, last)
    edges = np.unique(np.quantile(series, np.linspace(0, 1, _BINS + 1)))
    bins = np.clip(np.searchsorted(edges, series, side="right") - 1, 0, max(edges.size - 2, 0))
    count = np.maximum(np.bincount(bins), 1)
    mean_after = np.bincount(bins, last) / count
    return BinnedResidual(
        joint=joint,
        quantity=quantity,
        centre=np.bincount(bins, series) / count,
        before=np.bincount(bins, first) / count,
        added=np.bincount(bins, first - last) / count,
        after=mean_after,
        spread=np.sqrt(np.bincount(bins, (last - mean_after[bins]) ** 2) / count),
    )


def _quantity(piece: PreparedRecording, name: str, torque: FloatArray) -> FloatArray:
    """One of the quantities of a residual dependence, rows × joints."""
    if name == "torque":
        return torque
    if name == "time":
        return np.broadcast_to(piece.time[:, np.newaxis], torque.shape)
    field = {"position": "position", "speed": "velocity", "acceleration": "acceleration"}[name]
    return piece.thin(getattr(piece.measured, field))
