"""The parameter table of the report: estimates by joint, with σ, truth and a small picture of each."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from markupsafe import Markup

from daq.report.gates import POORLY_SEEN_PERCENT
from daq.report.pictures import forest_row
from daq.text.numbers import NOTHING, percent, significant, with_sigma
from ident.estimators import ESTIMATORS
from ident.results import Estimate, Identification, Parameter

_FAR_SIGMAS = 3.0


@dataclass(frozen=True)
class ParameterRow:
    name: str
    expression: str
    unit: str
    value: str
    sigma: str
    percent_sigma: str
    half: str
    remark: str
    iv_value: str
    iv_sigma: str
    iv_half: str
    truth: str
    error: str
    far: bool
    iv_error: str
    iv_far: bool
    third_value: str
    third_shift: str
    picture: Markup
    exact: str


@dataclass(frozen=True)
class ParameterGroup:
    heading: str
    rows: tuple[ParameterRow, ...]


@dataclass(frozen=True)
class TruthSummary:
    """How many estimates lie within 3 σ of the truth, and the farthest of them."""

    method: str
    compared: int
    within_three: int
    farthest: str


def parameter_groups(
    identification: Identification, truth: dict[str, float] | None, joint_names: tuple[str, ...]
) -> tuple[ParameterGroup, ...]:
    """Rows in the order of the estimate, gathered by joint; parameters of no one joint come last."""
    iv = _by_name(identification.instrumental.parameters if identification.instrumental else ())
    other = third_estimate(identification)
    third = _by_name(other.parameters if other else ())
    gathered: dict[int, list[ParameterRow]] = {}
    for parameter in identification.least_squares.parameters:
        joint = parameter.leading.joint
        known = truth.get(parameter.name) if truth is not None else None
        row = _row(parameter, iv.get(parameter.name), third.get(parameter.name), known)
        gathered.setdefault(len(joint_names) if joint is None else joint, []).append(row)
    headings = [joint_heading(j, name) for j, name in enumerate(joint_names)] + ["Arm"]
    return tuple(ParameterGroup(headings[j], tuple(gathered[j])) for j in sorted(gathered))


def third_estimate(identification: Identification) -> Estimate | None:
    """The estimate that was asked for besides least squares and IV; None where there is none."""
    others = (e for e in identification.estimates if e.method not in ("ls", "iv"))
    return next(others, None)


def joint_heading(joint: int, name: str) -> str:
    """``Joint 2`` with the joint's own name where that says more."""
    plain = f"Joint {joint + 1}"
    same = re.sub(r"[\s_-]", "", name).lower() in {f"joint{joint + 1}", f"j{joint + 1}", str(joint + 1)}
    return plain if same else f"{plain}: {name}"


def truth_summaries(
    identification: Identification, truth: dict[str, float] | None
) -> tuple[TruthSummary, ...]:
    """One line per estimator: how its values compare with the known truth."""
    if truth is None:
        return ()
    found = []
    for estimate in identification.estimates:
        errors = [
            (abs((p.value - truth[p.name]) / p.sigma), p.name)
            for p in estimate.parameters
            if p.name in truth and p.sigma > 0 and math.isfinite(p.sigma) and math.isfinite(p.value)
        ]
        if not errors:
            continue
        largest, name = max(errors)
        found.append(
            TruthSummary(
                ESTIMATORS[estimate.method].short,
                len(errors),
                sum(error <= _FAR_SIGMAS for error, _ in errors),
                f"{name}, {significant(largest, 2)} σ",
            )
        )
    return tuple(found)


def _by_name(parameters: tuple[Parameter, ...]) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in parameters}


def _in_sigmas(parameter: Parameter | None, truth: float | None) -> float | None:
    if parameter is None or truth is None or not parameter.sigma > 0 or math.isinf(parameter.sigma):
        return None
    return (parameter.value - truth) / parameter.sigma


def _in_sigmas_of(parameter: Parameter, other: Parameter | None) -> float | None:
    """How far another estimate lies from this one, in this one's σ."""
    if other is None or not parameter.sigma > 0 or math.isinf(parameter.sigma):
        return None
    return (other.value - parameter.value) / parameter.sigma


def _sigmas_text(error: float | None) -> str:
    if error is None or not math.isfinite(error):
        return significant(error)
    if abs(error) >= 100.0:
        return significant(error, 3, signed=True)
    text = f"{error:+.1f}"
    return "0.0" if float(text) == 0.0 else text.replace("-", "−")


def _row(
    parameter: Parameter, iv: Parameter | None, third: Parameter | None, truth: float | None
) -> ParameterRow:
    value, sigma, half, truth_text = with_sigma(parameter.value, parameter.sigma, parameter.half_width, truth)
    iv_value, iv_sigma, iv_half = ("", "", "")
    if iv is not None:
        iv_value, iv_sigma, iv_half = with_sigma(iv.value, iv.sigma, iv.half_width)
    error, iv_error = _in_sigmas(parameter, truth), _in_sigmas(iv, truth)
    return ParameterRow(
        name=parameter.name,
        expression="" if parameter.expression == parameter.name else parameter.expression,
        unit=parameter.unit,
        value=value,
        sigma=sigma,
        percent_sigma=percent(parameter.percent_sigma),
        half=half if parameter.half_width is not None else NOTHING,
        remark=_remark(parameter),
        iv_value=iv_value,
        iv_sigma=iv_sigma,
        iv_half=iv_half,
        truth=truth_text,
        error=_sigmas_text(error),
        far=error is not None and abs(error) > _FAR_SIGMAS,
        iv_error=_sigmas_text(iv_error) if iv is not None else "",
        iv_far=iv_error is not None and abs(iv_error) > _FAR_SIGMAS,
        third_value=with_sigma(third.value, parameter.sigma)[0] if third is not None else "",
        third_shift=_sigmas_text(_in_sigmas_of(parameter, third)) if third is not None else "",
        picture=_picture(parameter, iv, third, truth),
        exact=repr(float(parameter.value)),
    )


def _remark(parameter: Parameter) -> str:
    if not math.isfinite(parameter.value):
        return "no estimate"
    return "" if parameter.percent_sigma <= POORLY_SEEN_PERCENT else "poorly seen"


def _picture(
    parameter: Parameter, iv: Parameter | None, third: Parameter | None, truth: float | None
) -> Markup:
    sigma = parameter.sigma
    if not (sigma > 0 and math.isfinite(sigma) and math.isfinite(parameter.value)):
        return Markup("")
    iv_offset = (iv.value - parameter.value) / sigma if iv is not None else None
    iv_half = 2.0 * iv.sigma / sigma if iv is not None else 0.0
    truth_offset = (truth - parameter.value) / sigma if truth is not None else None
    return forest_row(iv_offset, iv_half, truth_offset, _in_sigmas_of(parameter, third))
