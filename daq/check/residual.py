"""What the model leaves of the torque, beside the nights before: a new effect shows there first."""

from __future__ import annotations

import numpy as np

from daq.catalogue import checks, models
from daq.catalogue.checks import GROWN_JOINTS
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline, CheckRecord, Model
from daq.check.recorded import TRAJECTORY_SHA256
from daq.keeping.diagnosed_again import DIAGNOSE
from robots.arrays import FloatArray

ENOUGH = 5
"""Nights, the baseline's included, that show by how much the residual differs from night to night."""
GROWN, GROWN_OF_FEW = 1.3, 2.0
"""Times the largest before; of fewer nights than enough more is asked for."""

Grown = tuple[tuple[int, float], ...]
"""Joints, from 1, and how many times as large their residual torque is as on any clean night before."""


def grown_residuals(
    catalogue: Catalogue, baseline: Baseline, tonight: Model, trajectory_sha256: str
) -> Grown:
    """Joints whose residual torque is larger than on every clean night before.

    Args:
        catalogue: where the nights are.
        baseline: that counts.
        tonight: the model of this check.
        trajectory_sha256: of the motion; nights of another one are not compared.
    """
    accepted = models.get(catalogue, baseline.model_id)
    # What a diagnosis leaves it tells of the rows where joints move, on recordings that were not fitted.
    before = [] if accepted.settings.get("command") == DIAGNOSE else [accepted.torque_rms]
    for record in checks.of_arm(catalogue, baseline.arm_id):
        same_motion = record.details.get(TRAJECTORY_SHA256) == trajectory_sha256
        clean = record.baseline_id == baseline.id and found_nothing(record)
        if record.model_id not in (None, tonight.id) and clean and same_motion:
            before.append(models.get(catalogue, int(record.model_id or 0)).torque_rms)
    joints = len(tonight.torque_rms)
    return grown_of(np.array([rms for rms in before if len(rms) == joints]), tonight.torque_rms)


def found_nothing(record: CheckRecord) -> bool:
    """Whether a night may teach what is usual: nothing had moved and no residual had grown."""
    return record.details.get("state") == "unchanged" and not record.details.get(GROWN_JOINTS)


def grown_of(before: FloatArray, tonight: tuple[float, ...]) -> Grown:
    """The same of arrays: (nights, n) before, and (n,) tonight."""
    if not len(before):
        return ()
    limit = GROWN if len(before) >= ENOUGH else GROWN_OF_FEW
    times = np.array(tonight) / np.maximum(before.max(axis=0), np.finfo(float).tiny)
    return tuple((joint, float(time)) for joint, time in enumerate(times, start=1) if time > limit)


def grown_words(grown: Grown) -> list[str]:
    """A warning where the model explains less than it did."""
    if not grown:
        return []
    parts = ", ".join(f"joint {joint} {time:.2g} times as much" for joint, time in grown)
    return [f"the model leaves more of the torque than on any night before ({parts}): a new effect?"]
