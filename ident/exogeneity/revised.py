"""The revised Durbin-Wu-Hausman test: three gates in order, and a verdict (method.md 5.2).

Source: Janot, Vandanjon, Gautier 2016. All gates work on rows weighted across joints; gates 2 and 3, which
ask about errors, on rows that are white along time as well.
"""

from __future__ import annotations

import numpy as np

from ident.exogeneity.agreement import SimulationAgreement
from ident.exogeneity.instruments import GateSettings, instruments_gate
from ident.exogeneity.rank import rank_gate
from ident.exogeneity.tested import TestedRows
from ident.exogeneity.textbook import WhiteRows, single_p_values, wald_f
from ident.exogeneity.untested import EXOGENEITY_NULL, RANK_NULL, not_reached
from ident.listing import listed
from ident.verdicts import ColumnCheck, Gate, RevisedTest
from robots.arrays import FloatArray, IntArray


def revised_test(
    tested: TestedRows,
    names: tuple[str, ...],
    shift_in_sigma: FloatArray,
    settings: GateSettings,
    agreement: SimulationAgreement | None = None,
) -> RevisedTest:
    """Run the gates in order; a gate that is not reached has ``passed`` None.

    Args:
        tested: torques, regressors and instruments, as many of these as parameters.
        names: (b,) base parameter names.
        shift_in_sigma: (b,) (β̂_LS − β̂_IV)/σ_LS, for the words of the verdict.
        settings: level and margins.
        agreement: torque and following error of the closed loop; without it gate 1 looks at Π alone.
    """
    whitening = tested.errors()
    rows, words = tested.whitened(whitening), whitening.describe()
    instruments = instruments_gate(tested, tested.omega(), rows, names, settings, agreement)
    if not instruments.passed:
        gates = (instruments, not_reached("rank", RANK_NULL), not_reached("exogeneity", EXOGENEITY_NULL))
        return RevisedTest("instruments_invalid", _say_invalid(instruments), words, gates)
    rank, kept = rank_gate(rows, names)
    if kept.size == 0:
        gates = (instruments, rank, not_reached("exogeneity", EXOGENEITY_NULL))
        reason = "simulation and measurement give the same regressors"
        return RevisedTest("exogenous", _say_exogenous(reason), words, gates)
    exogeneity = exogeneity_gate(rows, names, kept, settings.level, words)
    gates = (instruments, rank, exogeneity)
    if exogeneity.passed:
        reason = f"p = {exogeneity.p_value:.3g} that they are uncorrelated with the errors"
        return RevisedTest("exogenous", _say_exogenous(reason), words, gates)
    return RevisedTest("endogenous", _say_endogenous(names, shift_in_sigma), words, gates)


def exogeneity_gate(
    rows: WhiteRows, names: tuple[str, ...], kept: IntArray, level: float, errors: str
) -> Gate:
    """Gate 3: F-test of γ = 0 on the remaining columns, together and one by one (Holm).

    Args:
        rows: white.
        names: (b,) base parameter names.
        kept: columns of V̂ above the noise floor.
        level: nominal size.
        errors: in words, how the rows became white.
    """
    _, v = rows.first_stage()
    statistic, df, p = wald_f(rows.y, rows.x, v[:, kept])
    single = single_p_values(rows.y, rows.x, v[:, kept])
    limits = _holm_limits(single, level)
    checks = tuple(
        ColumnCheck(
            names[k], float(single[i]), float(limits[i]), float(single[i]), bool(single[i] >= limits[i])
        )
        for i, k in enumerate(kept)
    )
    guilty = [check.column for check in checks if not check.passed]
    detail = errors
    if guilty:
        detail += f"; correlated with the errors: {listed(guilty)}"
    return Gate("exogeneity", EXOGENEITY_NULL, p >= level, statistic, "F", df, p, detail, checks)


def _holm_limits(p_values: FloatArray, level: float) -> FloatArray:
    """The limit that each p-value has to stay above for its null to stand, by Holm's step-down rule."""
    order = np.argsort(p_values)
    limits = np.empty(p_values.size)
    for rank, k in enumerate(order):
        limits[k] = level / (p_values.size - rank)
    first_kept = next((rank for rank, k in enumerate(order) if p_values[k] >= limits[k]), p_values.size)
    for k in order[first_kept:]:
        limits[k] = min(limits[k], p_values[k])
    return limits


def _say_invalid(gate: Gate) -> str:
    failed = sorted((c for c in gate.columns if not c.passed), key=lambda c: -c.size / c.limit)
    if not failed:
        return (
            "Do not trust this model: the simulated motion does not span the measured one, so nothing can be"
            " tested with it. Record a more exciting trajectory, or search for what is missing."
        )
    loop = [c for c in failed if c.kind == "following error"]
    torque = [c for c in failed if c.kind == "torque"]
    columns = [c for c in failed if c not in loop and c not in torque]
    reasons = []
    if torque:
        reasons.append(f"the simulated arm needs another {_shares(torque)}: an effect is missing")
    if loop:
        reasons.append(
            f"the simulated loop has another {_shares(loop)}: its controller or its model is wrong"
        )
    if columns:
        reasons.append(
            f"the simulated arm does not move as the real one in {len(columns)} regressors, most of all"
            f" {_shares(columns)}"
        )
    advice = "check the controller's figures" if loop and not torque else "search for the missing effect"
    first, *others = reasons
    also = "".join(f" {reason[0].upper()}{reason[1:]}." for reason in others)
    return f"Do not trust this model yet: {first}.{also} Instruments are invalid; {advice}."


def _shares(checks: list[ColumnCheck]) -> str:
    """The largest two: a sentence is to fit into two lines of a terminal."""
    return ", ".join(f"{check.column} ({100 * check.size:.2g} %)" for check in checks[:2])


def _say_exogenous(reason: str) -> str:
    return (
        f"Use the least-squares model: its regressors are exogenous ({reason}),"
        " so it is unbiased and efficient."
    )


def _say_endogenous(names: tuple[str, ...], shift: FloatArray) -> str:
    order = np.argsort(-np.abs(shift))[:2]
    worst = ", ".join(f"{names[k]} by {abs(shift[k]):.1f} σ" for k in order)
    if np.abs(shift).max() < 1.0:
        return (
            "Use the instrumental-variable model. The regressors are correlated with the errors, but hardly:"
            f" least squares shifts no parameter by more than its own σ (most of all {worst})."
        )
    return (
        "Use the instrumental-variable model, or filter better. The regressors are correlated with the"
        f" errors, which shifts least squares, most of all {worst}."
    )
