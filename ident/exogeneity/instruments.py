"""Gate 1 of the revised DWH-test: does the simulation reproduce the robot? Do instruments move regressors?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.exogeneity.agreement import SimulationAgreement, following_checks, torque_checks
from ident.exogeneity.relevance import conditional_f
from ident.exogeneity.sign_flips import sign_flip_test
from ident.exogeneity.tested import TestedRows
from ident.exogeneity.textbook import WhiteRows
from ident.exogeneity.untested import INSTRUMENTS_NULL
from ident.statistics.whitening import Whitening
from ident.verdicts import ColumnCheck, ColumnKind, Gate
from robots.arrays import BoolArray, FloatArray

_EXACT = 1e-9
"""A departure below this share of the column is rounding."""

_WEAK = 10.0
"""First-stage F below which instruments are called weak (Staiger and Stock 1997)."""


@dataclass(frozen=True)
class GateSettings:
    """What the verdict rests on.

    Attributes:
        level: nominal size of every test.
        margin: largest departure of a regressor from its simulation, as a share of its norm.
        torque_margin: largest share of a joint's torque that the simulation may lack as a function of motion.
        following_margin: the same of a drive's following error.
    """

    level: float = 0.05
    margin: float = 0.05
    torque_margin: float = 0.05
    following_margin: float = 0.005


def instruments_gate(
    tested: TestedRows,
    omega: Whitening,
    white: WhiteRows,
    names: tuple[str, ...],
    settings: GateSettings,
    agreement: SimulationAgreement | None = None,
    free: BoolArray | None = None,
) -> Gate:
    """Validity, column by column and jointly, and relevance.

    A check fails when it is both significant and larger than its margin: in long records any departure is
    significant, so its size decides with it. Sizes are of rows weighted by Ω alone; an AR filter would weigh
    their highest frequencies most.

    Args:
        tested: torques, regressors and instruments.
        omega: the paper's Ω.
        white: the rows whitened along time as well.
        names: (b,) base parameter names.
        settings: level and margins.
        agreement: torque and following error of the closed loop, where they are known.
        free: (b,) parameters whose columns may take up a difference of torque; all where None.
    """
    block = tested.whitened(omega)
    projection, _ = block.first_stage()
    size = np.linalg.norm(block.z @ (projection - np.eye(len(names))), axis=0)
    size = size / np.linalg.norm(block.x, axis=0)
    p_values, joint, statistic = _significance(tested, omega)
    checks = tuple(
        _check(name, float(size[k]), settings.margin, float(p_values[k]), settings.level)
        for k, name in enumerate(names)
    )
    shift = _parameter_shift(white, projection)
    weakest, strength = _relevance(block, names)
    worst = max(checks, key=lambda check: check.size)
    parts = [
        f"largest departure {100 * worst.size:.3g} % of {worst.column} (margin {100 * settings.margin:g} %)",
        "in place of the measured columns the simulated ones would shift"
        f" {names[int(np.argmax(shift))]} most, by {shift.max():.2g} σ",
    ]
    if agreement is not None:
        checks += _loop_checks(agreement, tested, settings, free)
        parts += [_largest(checks, "torque"), _largest(checks, "following error")]
    parts.append(
        f"weakest conditional first-stage F {strength:.3g} ({weakest})" if weakest else "X = Z exactly"
    )
    passed = strength >= _WEAK and all(check.passed for check in checks)
    detail = "; ".join(parts)
    distribution = "R² of V̂ on Z, signs turned by blocks of time"
    return Gate("instruments", INSTRUMENTS_NULL, passed, statistic, distribution, None, joint, detail, checks)


def _check(name: str, size: float, margin: float, p: float, level: float) -> ColumnCheck:
    return ColumnCheck(name, size, margin, p, bool(size <= margin or p >= level))


def _significance(tested: TestedRows, omega: Whitening) -> tuple[FloatArray, float, float]:
    """p-value of every column (1 where it is simulated exactly) and of all together; the joint statistic."""
    weight = (tested.used / omega.sigma)[:, :, np.newaxis]
    x, z = tested.regressor * weight, tested.instruments * weight
    v = x - z
    norm = np.sqrt(np.sum(x**2, axis=(0, 1)))
    departs = np.sqrt(np.sum(v**2, axis=(0, 1))) > _EXACT * norm
    p_values = np.ones(departs.size)
    if not departs.any():
        return p_values, 1.0, 0.0
    found = sign_flip_test(v[:, :, departs], z, tested.segment)
    p_values[departs] = found.columns
    return p_values, found.joint, found.statistic


def _parameter_shift(white: WhiteRows, projection: FloatArray) -> FloatArray:
    """|(Π̂ − I)β̂|/σ, (b,): how far parameters would shift if the simulated columns stood for the measured."""
    inverse = np.linalg.inv(white.x.T @ white.x)
    beta = inverse @ (white.x.T @ white.y)
    return np.asarray(np.abs((projection - np.eye(beta.size)) @ beta) / np.sqrt(np.diag(inverse)))


def _relevance(rows: WhiteRows, names: tuple[str, ...]) -> tuple[str, float]:
    """The parameter whose regressor the instruments move least, given the others, and its conditional F."""
    found = conditional_f(rows)
    if not found:
        return "", np.inf
    column = min(found, key=lambda k: found[k].statistic)
    return names[column], float(found[column].statistic)


def _loop_checks(
    agreement: SimulationAgreement, tested: TestedRows, settings: GateSettings, free: BoolArray | None
) -> tuple[ColumnCheck, ...]:
    absorbed = tested.instruments if free is None else tested.instruments[:, :, free]
    torque = torque_checks(
        agreement, absorbed, tested.segment, tested.used, settings.level, settings.torque_margin
    )
    following = following_checks(
        agreement, tested.segment, tested.used, settings.level, settings.following_margin
    )
    return torque + following


def _largest(checks: tuple[ColumnCheck, ...], kind: ColumnKind) -> str:
    of_kind = [check for check in checks if check.kind == kind]
    worst = max(of_kind, key=lambda check: check.size)
    return f"simulation lacks {100 * worst.size:.2g} % of the {worst.column} (margin {100 * worst.limit:g} %)"
