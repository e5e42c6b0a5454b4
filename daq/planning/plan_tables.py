"""The tables of a plan's page: each joint's use of each limit, each parameter as it will be seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from daq.planning.plan_result import PlanResult
from daq.report.pictures import dot_row
from daq.text.numbers import percent, significant
from trajectories import Prediction

POOR = 30.0
"""%σ above which a parameter is poorly seen, as in the report of an identification."""


SCALE = (0.01, 1000.0)
"""Range of the %σ picture."""


@dataclass(frozen=True)
class ParameterRow:
    """One base parameter as it will be seen."""

    name: str
    unit: str
    value: str
    sigma: str
    percent: str
    poor: bool
    picture: Markup


@dataclass(frozen=True)
class UseRow:
    """One joint's use of one limit."""

    joint: str
    percent: str
    value: str
    limit: str
    time: str
    beyond: bool
    picture: Markup


def use_rows(result: PlanResult) -> list[tuple[str, list[UseRow]]]:
    groups = []
    for use in result.judgement.uses:
        rows = []
        for k, joint in enumerate(result.robot.joint):
            share = float(use.share[k])
            beyond = share > 1.0 + 1e-4
            rows.append(
                UseRow(
                    joint=joint.name,
                    percent=percent(100 * share),
                    value=significant(float(use.value[k])),
                    limit=significant(float(use.limit[k])),
                    time=f"{use.time[k]:.2f} s",
                    beyond=beyond,
                    picture=dot_row(share, 1.0, (0.0, 1.25), logarithmic=False, beyond=beyond),
                )
            )
        groups.append((use.constraint, rows))
    return groups


def parameter_rows(prediction: Prediction) -> list[ParameterRow]:
    rows = []
    columns = (
        prediction.names,
        prediction.units,
        prediction.values,
        prediction.sigma,
        prediction.percent_sigma,
    )
    for name, unit, value, sigma, share in zip(*columns, strict=True):
        poor = bool(share > POOR) and bool(value)
        shown = float(share) if np.isfinite(share) else SCALE[1]
        rows.append(
            ParameterRow(
                name=name,
                unit=unit,
                value=significant(float(value)),
                sigma=significant(float(sigma)) if np.isfinite(sigma) else "not seen",
                percent=percent(float(share)) if value else "expected 0",
                poor=poor,
                picture=dot_row(shown if value else np.nan, POOR, SCALE, logarithmic=True, beyond=poor),
            )
        )
    return rows
