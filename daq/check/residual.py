"""What the model leaves of the torque, beside the nights before: a new effect shows there first."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from daq.catalogue import checks, models
from daq.catalogue.checks import INCREASED
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline, CheckRecord, Model
from daq.check.recorded import TRAJECTORY_SHA256
from daq.keeping.diagnosed_again import DIAGNOSE
from daq.session.recorded_runs import CELSIUS
from robots.arrays import FloatArray

ENOUGH = 5
"""Nights, the baseline's included, that show by how much the residual differs from night to night."""
INCREASE, INCREASE_OF_FEW = 1.3, 2.0
"""Times the largest before; of fewer nights than enough more is asked for."""

LEARNING = 30
"""Nights within which a step that came before there were enough is still looked for, and beside which a
residual that creeps is told."""
CREEP = 1.5
"""Times the largest of the first thirty nights. A residual that grows by a percent a night is never 1.3 times
the largest before; the seasons of a cold hall make at most 1.38 of it (docs/how-to/schedule.md)."""
SPREAD, PRIOR_NIGHTS = 0.1, 5
"""Deviation of the logarithm of a joint's residual from night to night, and nights that this counts as: of
simulated years 0.05 to 0.15, since what friction's model leaves follows the warmth of the gears."""
TEACHES = (TRAJECTORY_SHA256, CELSIUS, "state", INCREASED)
"""What of the details of a night says which motion it drove, how warm it was, and whether it may teach."""
_FALSE_STEPS = 0.05
"""Steps found by chance on an arm without one, over all joints, places and nights."""

ResidualIncrease = tuple[tuple[int, float], ...]
"""Joints, from 1, and how many times as large their residual torque is as on any clean night before."""


def residual_increases(
    catalogue: Catalogue, baseline: Baseline, tonight: Model, trajectory_sha256: str
) -> ResidualIncrease:
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
    torques = models.torques_of_arm(catalogue, baseline.arm_id)
    for record in reversed(checks.of_arm(catalogue, baseline.arm_id, keys=TEACHES)):  # oldest first
        same_motion = record.details.get(TRAJECTORY_SHA256) == trajectory_sha256
        clean = record.baseline_id == baseline.id and found_nothing(record)
        if record.model_id not in (None, tonight.id) and clean and same_motion:
            before.append(torques[int(record.model_id or 0)])
    joints = len(tonight.torque_rms)
    return residual_increase_of(np.array([rms for rms in before if len(rms) == joints]), tonight.torque_rms)


def found_nothing(record: CheckRecord) -> bool:
    """Whether a night may teach what is usual: nothing had moved and no residual had grown."""
    return record.details.get("state") == "unchanged" and not record.details.get(INCREASED)


def residual_increase_of(before: FloatArray, tonight: tuple[float, ...]) -> ResidualIncrease:
    """The same of arrays: (nights, n) before, oldest first, and (n,) tonight."""
    if not len(before):
        return ()
    limit = INCREASE if len(before) >= ENOUGH else INCREASE_OF_FEW
    tiny = np.finfo(float).tiny
    times = np.array(tonight) / np.maximum(before.max(axis=0), tiny)
    steps = np.exp(_early_steps(np.log(np.maximum(np.vstack([before, tonight]), tiny))))
    found = np.where(times > limit, times, np.where(steps > INCREASE, steps, 0.0))
    if len(before) > LEARNING:
        of_first = np.array(tonight) / np.maximum(before[:LEARNING].max(axis=0), tiny)
        found = np.where(of_first > CREEP, np.maximum(found, of_first), found)
    return tuple((joint, float(time)) for joint, time in enumerate(found, start=1) if time > 0.0)


def _early_steps(logs: FloatArray) -> FloatArray:
    """(n,) largest sure step of the logarithm (N, n) among the first nights; zeros where there is none.

    A step that came while a residual had to double to be told has taught the nights since. Those before and
    after it are compared once there are enough after it: Student's t with a variance drawn towards the
    prior, corrected for joints, places and nights that are tried (Bonferroni).
    """
    nights, joints = logs.shape
    found = np.zeros(joints)
    if nights > LEARNING:
        return found
    level = _FALSE_STEPS / (joints * (ENOUGH - 1) * LEARNING)
    df = PRIOR_NIGHTS + nights - 2
    for start in range(1, min(ENOUGH, nights - ENOUGH + 1)):
        old, new = logs[:start], logs[start:]
        apart = new.mean(axis=0) - old.mean(axis=0)
        squares = nights * logs.var(axis=0) - apart**2 * len(old) * len(new) / nights
        variance = (PRIOR_NIGHTS * SPREAD**2 + squares) / df
        sure = apart > stdtrit(df, 1.0 - level) * np.sqrt(variance * (1 / len(old) + 1 / len(new)))
        lasting = logs[-1] - old.mean(axis=0) > np.log(INCREASE)
        found = np.where(sure & lasting, np.maximum(found, apart), found)
    return found


def residual_increase_words(increase: ResidualIncrease) -> list[str]:
    """A warning where the model explains less than it did."""
    if not increase:
        return []
    parts = ", ".join(f"joint {joint} {time:.2g} times as much" for joint, time in increase)
    return [f"the model leaves more of the torque than on the nights before ({parts}): a new effect?"]
