"""Which parameters a plan is for: all, or those that are named (``payload``, ``friction4``, ``ZZ1R``)."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ident.effects.family import StandardParameter
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray
from trajectories.errors import PlanError
from trajectories.information.matrix import CONDITION_CAP, ROW_RATE, Criterion, Objective
from trajectories.information.prediction import Prediction, inverse_of

GROUPS = {
    "friction": ("Fv", "Fc", "Fvp", "Fvn", "Fcp", "Fcn", "Fvm", "Fcm"),
    "inertia": ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "Ia", "Iam"),
    "gravity": ("M", "MX", "MY", "MZ"),
    "offset": ("off",),
    "joint": (),
}
"""Words for groups of parameters; a joint's number may follow. ``joint`` alone means nothing."""

PAYLOAD = "payload"
PAYLOAD_SYMBOLS = ("M", "MX", "MY", "MZ")

LOOSE_CAP = 10.0 * CONDITION_CAP
"""Cap on the condition number where only some parameters matter: the others must only not get lost."""


def objective_for(
    base: BaseParameters, words: Sequence[str] = (), criterion: Criterion = "determinant"
) -> Objective:
    """The objective that makes some parameters visible.

    Args:
        base: the arm's base parameters.
        words: names of base parameters (``ZZ1R``), or groups with or without a joint's number:
            ``friction``, ``friction4``, ``inertia``, ``gravity``, ``offset``, ``joint4``; or ``payload``
            alone: mass and first moments at the last link of an arm whose links are known, its friction and
            offsets being free. Nothing means all.
        criterion: see :class:`Objective`.

    Raises:
        PlanError: a word means nothing here.
    """
    if not words:
        return Objective(criterion)
    if PAYLOAD in words:
        if len(words) > 1:
            raise PlanError(
                f'"{PAYLOAD}" stands alone, as it takes the links for known; got {", ".join(words)}',
                constraint="parameters",
            )
        return _payload(base, criterion)
    if criterion == "condition":
        raise PlanError(
            "the condition number is of all parameters; with chosen ones allowed: determinant, trace",
            constraint="objective",
        )
    chosen = sorted({index for word in words for index in _indices(base, word)})
    return Objective(criterion, LOOSE_CAP, tuple(chosen))


def payload_directions(base: BaseParameters) -> tuple[FloatArray, tuple[StandardParameter, ...]]:
    """How a payload and the drives' own parameters change the base parameters.

    Returns:
        (b × k) directions and their k parameters, the payload's first: mass and first moments at the last
        link, in the joint frame.
    """
    standard, leading, last = base.model.parameters, base.leading, base.model.robot.n - 1
    drives = GROUPS["friction"] + GROUPS["offset"]
    payload = [k for k, p in enumerate(standard) if p.joint == last and p.is_usual(PAYLOAD_SYMBOLS)]
    own = [k for k, parameter in enumerate(leading) if parameter.is_usual(drives)]
    columns = [*base.relation[:, payload].T, *np.eye(len(leading))[own]]
    return np.column_stack(columns), (*(standard[k] for k in payload), *(leading[k] for k in own))


def _payload(base: BaseParameters, criterion: Criterion) -> Objective:
    directions, _ = payload_directions(base)
    count = len(PAYLOAD_SYMBOLS)
    seen = np.linalg.norm(directions[:, :count], axis=0) > 0.0
    if not seen.all():
        # On an axis that gravity does not load, say, only part of a payload can ever be seen.
        keep = np.concatenate([np.flatnonzero(seen), np.arange(count, directions.shape[1])])
        directions, count = directions[:, keep], int(seen.sum())
    return Objective(criterion, None, tuple(range(count)), directions)


def _indices(base: BaseParameters, word: str) -> list[int]:
    if word in base.names:
        return [base.names.index(word)]
    group = re.fullmatch(r"([a-z]+)(\d*)", word)
    if group is not None and group[1] in GROUPS and (group[1] != "joint" or group[2]):
        symbols, joint = GROUPS[group[1]], group[2]
        found = [
            k
            for k, parameter in enumerate(base.leading)
            if (not symbols or parameter.is_usual(symbols))
            and (not joint or (parameter.joint is not None and parameter.joint + 1 == int(joint)))
        ]
        if found:
            return found
    raise PlanError(
        f'no base parameter is meant by "{word}"; allowed: {", ".join(base.names)}, '
        f"{', '.join(GROUPS)} (each with a joint's number), {PAYLOAD}",
        constraint="parameters",
    )


def payload_sigma(base: BaseParameters, prediction: Prediction) -> dict[StandardParameter, float]:
    """Predicted standard deviation of a payload's mass and first moments, SI, the arm's links being known.

    Returns:
        parameter (``M6`` …) → σ; inf for what the motion does not show.
    """
    directions, parameters = payload_directions(base)
    rows = prediction.information.matrix / (ROW_RATE * prediction.row_time)
    covariance, blind = inverse_of(directions.T @ rows @ directions)
    sigma = np.where(blind, np.inf, np.sqrt(np.maximum(np.diag(covariance), 0.0)))
    return dict(zip(parameters[: len(PAYLOAD_SYMBOLS)], sigma.tolist(), strict=False))
