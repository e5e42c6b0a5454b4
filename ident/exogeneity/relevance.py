"""Do the instruments move the regressors? Partial and conditional F on weighted rows.

Regressors that Z holds exactly, as a constant, are exogenous: they are partialled out first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.exogeneity.hypothesis import HypothesisTest, annihilate, f_test
from ident.exogeneity.textbook import WhiteRows, informative
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class _FirstStage:
    """What exogenous regressors leave of the others (r, k) and of the instruments (r, m − exogenous)."""

    endogenous: IntArray
    x: FloatArray
    z: FloatArray
    freedom: int

    @property
    def excluded(self) -> int:
        return int(self.z.shape[1])


def partial_f(rows: WhiteRows) -> dict[int, HypothesisTest]:
    """First-stage F of the excluded instruments per regressor that is not exogenous, by its column index."""
    stage = _first_stage(rows)
    tests = {}
    for place, column in enumerate(stage.endogenous):
        target = stage.x[:, place]
        left = _sum_of_squares(annihilate(target[:, np.newaxis], stage.z))
        statistic = (target @ target - left) / stage.excluded / (left / stage.freedom)
        null = f"no instrument moves regressor {column}"
        tests[int(column)] = f_test("first-stage F", null, float(statistic), stage.excluded, stage.freedom)
    return tests


def conditional_f(rows: WhiteRows) -> dict[int, HypothesisTest]:
    """Sanderson-Windmeijer F per regressor: is it moved once the others are accounted for? (2016)

    Where only one regressor is not exogenous it is the first-stage F.
    """
    stage = _first_stage(rows)
    count = stage.endogenous.size
    if count == 0:
        return {}
    v = annihilate(stage.x, stage.z)
    explained = stage.x - v
    scale = np.linalg.norm(stage.x, axis=0)
    inverse = np.linalg.inv((explained / scale).T @ (explained / scale))
    left = (v / scale).T @ (v / scale)
    df = stage.excluded - count + 1
    tests = {}
    for place, column in enumerate(stage.endogenous):
        # x_k less what two-stage least squares on the other regressors makes of it, in units of the columns.
        combination = inverse[:, place] / inverse[place, place]
        noise = float(combination @ left @ combination) / stage.freedom
        statistic = 1.0 / float(inverse[place, place]) / df / noise
        null = f"regressor {column} is not identified beside the others"
        tests[int(column)] = f_test("Sanderson-Windmeijer conditional F", null, statistic, df, stage.freedom)
    return tests


def _first_stage(rows: WhiteRows) -> _FirstStage:
    endogenous = informative(rows.x, rows.first_stage()[1])
    exogenous = np.delete(rows.x, endogenous, axis=1)
    freedom = rows.y.size - rows.z.shape[1]
    if exogenous.shape[1] == 0:
        return _FirstStage(endogenous, rows.x, rows.z, freedom)
    left = annihilate(rows.z, exogenous)
    span, _, _ = np.linalg.svd(left, full_matrices=False)
    basis = span[:, : rows.z.shape[1] - exogenous.shape[1]]
    return _FirstStage(endogenous, annihilate(rows.x[:, endogenous], exogenous), basis, freedom)


def _sum_of_squares(values: FloatArray) -> float:
    return float(np.sum(values**2))
