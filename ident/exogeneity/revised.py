"""The revised Durbin-Wu-Hausman test: three gates in order, and a verdict (METHOD 5.2).

Source: Janot, Vandanjon, Gautier 2016. All gates work on rows whitened across joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from ident.exogeneity.textbook import WhiteRows, single_p_values, trailing_diagonal, wald_f
from ident.results import ColumnCheck, Gate, RevisedTest
from robots.arrays import FloatArray, IntArray

_BIAS_THAT_MATTERS = 0.1
"""Gate 2's noise floor: a column of V̂ that cannot shift any parameter by this many σ is null."""

_INSTRUMENTS = "Π = I: the simulation gives the regressors, X = Z + V"
_RANK = "[X V̂] adds nothing to X above the noise floor"
_EXOGENEITY = "γ = 0: the regressors are uncorrelated with the errors"


@dataclass(frozen=True)
class GateSettings:
    """What the verdict rests on: nominal level, equivalence margin of gate 1, and the rows' whitening."""

    level: float
    margin: float
    covariance: str


def revised_test(
    block: WhiteRows,
    rows: WhiteRows,
    names: tuple[str, ...],
    shift_in_sigma: FloatArray,
    settings: GateSettings,
) -> RevisedTest:
    """Run the gates in order; a gate that is not reached has ``passed`` None.

    Gate 1 asks how far simulated and measured regressors differ in size, so it looks at rows scaled by Ω
    alone; an AR filter would weigh its highest frequencies most. Gates 2 and 3 ask about errors, and
    look at rows on which those are white.

    Args:
        block: y, X and Z whitened by Ω.
        rows: the same whitened along time as well; as many instruments as parameters.
        names: (b,) base parameter names.
        shift_in_sigma: (b,) (β̂_LS − β̂_IV)/σ_LS, for the words of the verdict.
        settings: level, margin, whitening.
    """
    instruments = instruments_gate(block, names, settings)
    if not instruments.passed:
        gates = (instruments, _not_reached("rank", _RANK), _not_reached("exogeneity", _EXOGENEITY))
        return RevisedTest("instruments_invalid", _say_invalid(instruments), settings.covariance, gates)
    rank, kept = rank_gate(rows, names)
    if kept.size == 0:
        gates = (instruments, rank, _not_reached("exogeneity", _EXOGENEITY))
        return RevisedTest(
            "exogenous",
            _say_exogenous("simulation and measurement give the same regressors"),
            settings.covariance,
            gates,
        )
    exogeneity = exogeneity_gate(rows, names, kept, settings)
    gates = (instruments, rank, exogeneity)
    if exogeneity.passed:
        reason = f"p = {exogeneity.p_value:.3g} that they are uncorrelated with the errors"
        return RevisedTest("exogenous", _say_exogenous(reason), settings.covariance, gates)
    return RevisedTest("endogenous", _say_endogenous(names, shift_in_sigma), settings.covariance, gates)


def not_testable(reason: str, covariance: str) -> RevisedTest:
    """The verdict where there are no instruments to test with."""
    gates = (
        _not_reached("instruments", _INSTRUMENTS),
        _not_reached("rank", _RANK),
        _not_reached("exogeneity", _EXOGENEITY),
    )
    return RevisedTest("not_testable", f"Least squares was used untested: {reason}.", covariance, gates)


def instruments_gate(rows: WhiteRows, names: tuple[str, ...], settings: GateSettings) -> Gate:
    """Gate 1: relevance (rank of ZᵀX) and validity (Π̂ against I, column by column and jointly).

    A column fails when it departs both significantly and by more than the margin: in long records any
    departure is significant, so its size ‖Z(π̂_k − e_k)‖/‖x_k‖ decides with it.
    """
    projection, v = rows.first_stage()
    b = rows.x.shape[1]
    departure = rows.z @ (projection - np.eye(b))
    freedom = rows.x.shape[0] - b
    noise = np.sum(v**2, axis=0) / freedom
    spread = np.sum(departure**2, axis=0)
    size = np.sqrt(spread) / np.linalg.norm(rows.x, axis=0)
    exact = noise <= (1e-12 * np.linalg.norm(rows.x, axis=0)) ** 2
    statistics = np.divide(spread / b, noise, out=np.zeros(b), where=~exact)
    p_values = np.where(exact, np.where(size < 1e-9, 1.0, 0.0), f_distribution.sf(statistics, b, freedom))
    checks = tuple(
        ColumnCheck(
            name,
            float(size[k]),
            settings.margin,
            float(p_values[k]),
            bool(size[k] <= settings.margin or p_values[k] >= settings.level),
        )
        for k, name in enumerate(names)
    )
    condition = float(np.linalg.cond(_unit(rows.z).T @ _unit(rows.x)))
    relevant = condition < 1e12
    statistic, df = _joint_departure(departure, v, ~exact, freedom)
    p = float(chi2.sf(statistic, df)) if df else 1.0
    worst = max(checks, key=lambda check: check.size)
    detail = (
        f"largest departure {100 * worst.size:.3g} % of {worst.column} (margin {100 * settings.margin:g} %);"
        f" condition of ZᵀX {condition:.4g}"
    )
    passed = relevant and all(check.passed for check in checks)
    return Gate("instruments", _INSTRUMENTS, passed, statistic, "χ²", (df,), p, detail, checks)


def rank_gate(rows: WhiteRows, names: tuple[str, ...]) -> tuple[Gate, IntArray]:
    """Gate 2: QR of [X V̂]; returns the columns of V̂ above the noise floor of the data.

    |R_kk| is what is new in V̂_k. By Cauchy-Schwarz it can shift parameter k by at most
    √r·|R_kk|/‖x_k⊥‖ of its σ, x_k⊥ being the part of x_k that the other columns do not hold. Below a
    tenth of a σ no test could matter: the column is null.
    """
    _, v = rows.first_stage()
    scale = np.linalg.norm(rows.x, axis=0)
    diagonal = trailing_diagonal(rows.x, v)
    inverse = np.linalg.inv(np.linalg.qr(rows.x / scale, mode="r"))
    own_part = 1.0 / np.linalg.norm(inverse, axis=1)
    floor = _BIAS_THAT_MATTERS * own_part / np.sqrt(rows.x.shape[0])
    above = diagonal > floor
    checks = tuple(
        ColumnCheck(name, float(diagonal[k]), float(floor[k]), None, not above[k])
        for k, name in enumerate(names)
    )
    kept = np.flatnonzero(above)
    detail = f"{kept.size} of {len(names)} columns of V̂ are above the noise floor and go to the F-test"
    largest = float(np.max(diagonal / floor))
    gate = Gate(
        "rank", _RANK, kept.size == 0, largest, "largest |R_kk| over its floor", None, None, detail, checks
    )
    return gate, kept


def exogeneity_gate(rows: WhiteRows, names: tuple[str, ...], kept: IntArray, settings: GateSettings) -> Gate:
    """Gate 3: F-test of γ = 0 on the remaining columns, together and one by one (Holm)."""
    _, v = rows.first_stage()
    statistic, df, p = wald_f(rows.y, rows.x, v[:, kept])
    single = single_p_values(rows.y, rows.x, v[:, kept])
    limits = _holm_limits(single, settings.level)
    checks = tuple(
        ColumnCheck(
            names[k], float(single[i]), float(limits[i]), float(single[i]), bool(single[i] >= limits[i])
        )
        for i, k in enumerate(kept)
    )
    guilty = [check.column for check in checks if not check.passed]
    detail = settings.covariance
    if guilty:
        detail += f"; correlated with the errors: {', '.join(guilty)}"
    return Gate("exogeneity", _EXOGENEITY, p >= settings.level, statistic, "F", df, p, detail, checks)


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


def _joint_departure(
    departure: FloatArray, v: FloatArray, chosen: FloatArray, freedom: int
) -> tuple[float, float]:
    """Wald statistic of Π = I over all columns, given how V̂ varies between them; and its χ² freedom."""
    if not chosen.any():
        return 0.0, 0.0
    scale = np.linalg.norm(v[:, chosen], axis=0)
    between = (v[:, chosen] / scale).T @ (v[:, chosen] / scale) / freedom
    scaled = departure[:, chosen] / scale
    values, directions = np.linalg.eigh(between)
    held = values > 1e-9 * values[-1]
    turned = scaled @ directions[:, held]
    statistic = float(np.sum(np.sum(turned**2, axis=0) / values[held]))
    return statistic, float(held.sum() * departure.shape[1])


def _unit(columns: FloatArray) -> FloatArray:
    return np.asarray(columns / np.linalg.norm(columns, axis=0))


def _not_reached(name: str, null: str) -> Gate:
    return Gate(name, null, None, None, "", None, None, "not reached")  # type: ignore[arg-type]


def _say_invalid(gate: Gate) -> str:
    failed = sorted((c for c in gate.columns if not c.passed), key=lambda c: -c.size)
    if not failed:
        return (
            "Do not trust this model: the simulated motion does not span the measured one."
            " Search for what is missing."
        )
    named = ", ".join(f"{check.column} ({100 * check.size:.2g} %)" for check in failed[:3])
    return (
        f"Do not trust this model yet: the simulated arm does not move as the real one in {len(failed)}"
        f" regressors, most of all {named}. Model or controller is wrong; search for the missing effect."
    )


def _say_exogenous(reason: str) -> str:
    return (
        f"Use the least-squares model: its regressors are exogenous ({reason}),"
        " so it is unbiased and efficient."
    )


def _say_endogenous(names: tuple[str, ...], shift: FloatArray) -> str:
    order = np.argsort(-np.abs(shift))[:3]
    worst = ", ".join(f"{names[k]} by {abs(shift[k]):.1f} σ" for k in order)
    if np.abs(shift).max() < 1.0:
        return (
            "Use the instrumental-variable model. The regressors are correlated with the errors, but hardly:"
            f" least squares shifts no parameter by more than its own σ (most of all {worst})."
        )
    return (
        "Use the instrumental-variable model, or filter better: the regressors are correlated with the"
        f" errors, which shifts least squares, most of all {worst}."
    )
