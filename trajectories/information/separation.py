"""How well rows tell candidates apart that would explain the same misfit.

Two candidates are two sets of columns A and B beside the columns W of the model. What the model's refit
would swallow is partialled out (Frisch–Waugh–Lovell); of the rest, S_{A|B} = AᵀMA − AᵀMB (BᵀMB)⁻¹ BᵀMA, with
M the projection off W, is what A shows that B cannot imitate. −log det S_{A|B} is the D_s criterion of
optimal design (Atkinson and Donev 1992, ch. 11), used here in both directions: a motion that makes both
small separates the pair, whichever of the two is true. The canonical correlations between A and B after
W (Hotelling 1936) say the same without units: 1 where no size of effect could be told apart.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray, IntArray
from trajectories.information.matrix import NONE

_RIDGE = 1e-10
"""Share of a column's information that is added to it, so that what is not seen is not divided by."""

DEPENDENT = 1e-5
"""A column of unit norm with a smaller part left beside the others is one of them in disguise."""

_MEAN_SHARE = 0.1
"""Weight of the mean over all pairs beside the worst pair, so that the others improve too."""


@dataclass(frozen=True)
class Separation:
    """How well one pair is told apart.

    Attributes:
        first, second: names of the candidates.
        correlation: largest canonical correlation, after partialling out the model, of what either has beside
            the other with all that the other has, 0 to 1; 1 where no size of effect can be told apart.
        first_sigma, second_sigma: standard deviation of each candidate's parameters with the other candidate
            and the model free beside it, in the parameters' units; inf for what is not told apart.
    """

    first: str
    second: str
    correlation: float
    first_sigma: tuple[float, ...]
    second_sigma: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class CandidateColumns:
    """Where the columns of model and candidates are in one stacked regressor of K columns.

    Attributes:
        names: of the candidates.
        model: how many columns come first that belong to the model.
        columns: per candidate, the indices of its columns that the model does not have.
        own: per ordered pair (i, j), the indices of i's columns that neither the model nor j has.
        known: (b × b) information on the model's parameters from before; zero where there is none.
        scale: (K,) what the columns are divided by.
    """

    names: tuple[str, ...]
    model: int
    columns: tuple[IntArray, ...]
    own: dict[tuple[int, int], IntArray]
    known: FloatArray
    scale: FloatArray

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Every two candidates once."""
        return tuple(itertools.combinations(range(len(self.names)), 2))

    def after_model(self, matrix: FloatArray) -> FloatArray:
        """Information on the candidates' columns with the model's partialled out, (K−b × K−b)."""
        b = self.model
        model = matrix[:b, :b] + self.known
        model = model + np.diag(_RIDGE * np.maximum(np.diag(model), np.diag(model).max() * _RIDGE))
        cross = matrix[:b, b:]
        return np.asarray(matrix[b:, b:] - cross.T @ np.linalg.solve(model, cross))

    def beside(self, rest: FloatArray, first: int, second: int) -> FloatArray:
        """S of the first candidate's own columns beside the second's, of :meth:`after_model`'s matrix."""
        a, c = self.own[first, second] - self.model, self.columns[second] - self.model
        if c.size == 0:
            return rest[np.ix_(a, a)]
        other = rest[np.ix_(c, c)]
        other = other + np.diag(_RIDGE * np.diag(other) + np.finfo(float).tiny)
        cross = rest[np.ix_(c, a)]
        return np.asarray(rest[np.ix_(a, a)] - cross.T @ np.linalg.solve(other, cross))


@dataclass(frozen=True, eq=False)
class SeparationObjective:
    """The score of the worst pair of candidates, from the information matrix of all columns (K × K).

    Columns of two candidates have no common unit, so each pair is compared with itself: ``reference`` has,
    per ordered pair, the score of the motion that is to be bettered. Below 0 every pair is told apart better.
    """

    candidates: CandidateColumns
    reference: tuple[float, ...] = ()

    def against(self, matrix: FloatArray) -> SeparationObjective:
        """The same, compared with a motion's information matrix; a pair that it does not show counts as 0."""
        scores = self._scores(matrix)
        return replace(self, reference=tuple(score if score < NONE else 0.0 for score in scores))

    def score(self, matrix: FloatArray, unless_above: float = NONE) -> float:
        """The mean log variance of what the worst pair is told apart by; smaller is better."""
        scores = self._scores(matrix)
        if max(scores) >= NONE:
            return NONE
        compared = np.subtract(scores, self.reference) if self.reference else np.array(scores)
        return float(compared.max() + _MEAN_SHARE * compared.mean())

    def _scores(self, matrix: FloatArray) -> list[float]:
        """Per ordered pair with columns of its own."""
        scale = self.candidates.scale
        rest = self.candidates.after_model(matrix / np.outer(scale, scale))
        return [
            self._one_way(rest, one, other)
            for pair in self.candidates.pairs
            for one, other in (pair, pair[::-1])
            if self.candidates.own[one, other].size
        ]

    def _one_way(self, rest: FloatArray, first: int, second: int) -> float:
        own = self.candidates.beside(rest, first, second)
        sign, value = np.linalg.slogdet(own)
        return float(-value / len(own)) if sign > 0 and np.isfinite(value) else NONE


def separations(matrix: FloatArray, candidates: CandidateColumns) -> tuple[Separation, ...]:
    """How well each pair is told apart by rows whose information matrix (K × K) is given.

    Args:
        matrix: of all columns, rows weighted by σ; one row for each that identification will use.
        candidates: where whose columns are.
    """
    scale = candidates.scale
    rest = candidates.after_model(matrix / np.outer(scale, scale))
    result = []
    for i, j in candidates.pairs:
        sigmas = [_sigmas(rest, candidates, one, other) for one, other in ((i, j), (j, i))]
        correlation = _of_what_is_own(rest, candidates, i, j)
        result.append(Separation(candidates.names[i], candidates.names[j], correlation, *sigmas))
    return tuple(result)


def _of_what_is_own(rest: FloatArray, candidates: CandidateColumns, one: int, other: int) -> float:
    """Largest correlation of what either candidate has and the other has not with all that the other has.

    Of a spring that stiffens and a straight one the straight part is the same by definition: the cubic one
    tells them apart.
    """
    values = [
        _correlation(rest, candidates.own[a, b] - candidates.model, candidates.columns[b] - candidates.model)
        for a, b in ((one, other), (other, one))
        if candidates.own[a, b].size
    ]
    return max(values, default=1.0)


def _sigmas(rest: FloatArray, candidates: CandidateColumns, one: int, other: int) -> tuple[float, ...]:
    columns, own = candidates.columns[one], candidates.own[one, other]
    sigma = np.full(columns.size, np.inf)
    if own.size:
        beside = candidates.beside(rest, one, other)
        values, vectors = np.linalg.eigh(beside)
        if values[0] > 0.0:
            variance = (vectors**2 / values).sum(axis=1)
            sigma[np.isin(columns, own)] = np.sqrt(variance) / candidates.scale[own]
    return tuple(sigma.tolist())


def _correlation(rest: FloatArray, a: IntArray, c: IntArray) -> float:
    """The largest canonical correlation between two groups of columns."""
    if a.size == 0 or c.size == 0:
        return 0.0
    first, second = (_root_inverse(rest[np.ix_(k, k)]) for k in (a, c))
    values = np.linalg.svd(first @ rest[np.ix_(a, c)] @ second, compute_uv=False)
    return float(min(1.0, values[0]))


def _root_inverse(matrix: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(matrix)
    seen = values > DEPENDENT**2 * max(values[-1], 0.0)
    return np.asarray((vectors[:, seen] / np.sqrt(values[seen])) @ vectors[:, seen].T)
