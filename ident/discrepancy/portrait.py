"""Pictures of a finding as numbers: the residual over the quantity it goes with, and what the effect adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.scene import Scene
from ident.discrepancy.where import Habitat
from robots.arrays import FloatArray

_BINS = 48


@dataclass(frozen=True)
class Portrait:
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


def portrait(
    scenes: Sequence[Scene],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
    habitats: Sequence[Habitat],
) -> Portrait:
    """The joint whose residual the effect changes most, over the quantity that residual goes with.

    Args:
        scenes: the recordings.
        before, after: per scene residual torque, rows × joints.
        torques: per scene predicted torque before, rows × joints.
        habitats: where the residual before lives, per joint.
    """
    squares = sum(
        np.where(scene.moving, (b - a) ** 2, 0.0).sum(axis=0)
        for scene, b, a in zip(scenes, before, after, strict=True)
    )
    noise = sum(np.where(scene.moving, a**2, 0.0).sum(axis=0) for scene, a in zip(scenes, after, strict=True))
    joint = int(np.argmax(np.asarray(squares) / np.maximum(np.asarray(noise), 1e-300)))
    quantity = max(
        (item for item in habitats[joint].shares if item[0] != "direction"), key=lambda item: item[1]
    )[0]
    return _over(scenes, before, after, torques, joint, quantity)


def portraits(
    scenes: Sequence[Scene],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
) -> tuple[Portrait, ...]:
    """Every joint's residual over speed, position, torque and time, joint by joint; arguments as above."""
    joints = scenes[0].torque.shape[1]
    return tuple(
        _over(scenes, before, after, torques, joint, quantity)
        for joint in range(joints)
        for quantity in ("speed", "position", "torque", "time")
    )


def _over(
    scenes: Sequence[Scene],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    torques: Sequence[FloatArray],
    joint: int,
    quantity: str,
) -> Portrait:
    """One joint's residual in bins of one quantity."""

    def pick(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate(
            [part[scene.moving[:, joint], joint] for part, scene in zip(parts, scenes, strict=True)]
        )

    series = pick([_quantity(scene, quantity, torque) for scene, torque in zip(scenes, torques, strict=True)])
    first, last = pick(before), pick(after)
    if not series.size:  # the joint stands still
        return Portrait(joint, quantity, series, first, first, last, last)
    edges = np.unique(np.quantile(series, np.linspace(0, 1, _BINS + 1)))
    bins = np.clip(np.searchsorted(edges, series, side="right") - 1, 0, max(edges.size - 2, 0))
    count = np.maximum(np.bincount(bins), 1)
    mean_after = np.bincount(bins, last) / count
    return Portrait(
        joint=joint,
        quantity=quantity,
        centre=np.bincount(bins, series) / count,
        before=np.bincount(bins, first) / count,
        added=np.bincount(bins, first - last) / count,
        after=mean_after,
        spread=np.sqrt(np.bincount(bins, (last - mean_after[bins]) ** 2) / count),
    )


def _quantity(scene: Scene, name: str, torque: FloatArray) -> FloatArray:
    """One of the quantities of a habitat, rows × joints."""
    if name == "torque":
        return torque
    if name == "time":
        return np.broadcast_to(scene.time[:, np.newaxis], torque.shape)
    field = {"position": "position", "speed": "velocity", "acceleration": "acceleration"}[name]
    return scene.thin(getattr(scene.measured, field))
