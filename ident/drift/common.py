"""Two models whose base parameters differ: what both of them know."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.drift.values import Night
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray

_REPRESENTED = 1e-5
"""A base parameter is known from another base where at most this share of its relation is left over: printed
relations have six digits."""
_UNKNOWN = 1e3
"""Deviation of what a baseline does not know, in sizes of the parameter: no test sees anything there."""
_TERM = re.compile(r"([+−-]?)\s*(?:([0-9.]+(?:e[+-]?[0-9]+)?) )?([A-Za-z][A-Za-z0-9_]*)\s*")


@dataclass(frozen=True)
class Relation:
    """Base parameters as sums of standard ones.

    Attributes:
        names: (b,) of the base parameters.
        standard: (p,) names of the standard parameters.
        matrix: (b, p): base vector = matrix · standard vector.
    """

    names: tuple[str, ...]
    standard: tuple[str, ...]
    matrix: FloatArray

    @classmethod
    def of(cls, base: BaseParameters) -> Relation:
        """The relation of a base."""
        return cls(base.names, base.model.names, base.relation)

    @classmethod
    def read(cls, names: Sequence[str], expressions: Sequence[str]) -> Relation:
        """The relation that was printed as ``BaseParameters.expressions``.

        Raises:
            IdentificationError: an expression that is none.
        """
        rows = [_terms(name, text) for name, text in zip(names, expressions, strict=True)]
        standard = tuple(dict.fromkeys(symbol for row in rows for symbol in row))
        matrix = np.array([[row.get(symbol, 0.0) for symbol in standard] for row in rows])
        return cls(tuple(names), standard, matrix)

    def taking_up(self, names: tuple[str, ...], factors: FloatArray) -> Relation:
        """The relation of a model that takes up other parameters (k,), so much of each: factors (b, k)."""
        if not names:
            return self
        return Relation(self.names, (*self.standard, *names), np.hstack([self.matrix, factors]))


@dataclass(frozen=True)
class CommonBase:
    """What two bases both know: ``names`` (c,), and matrices (c, b) that take each base vector to it."""

    names: tuple[str, ...]
    of_old: FloatArray
    of_new: FloatArray
    lost: tuple[str, ...]
    """Parameters of the old base that the new one cannot tell."""


def determined_by(old: Relation, new: Relation) -> FloatArray | None:
    """(b_new, b_old) that takes the old base vector to the new one; None where the old does not say all."""
    standard = tuple(dict.fromkeys((*old.standard, *new.standard)))
    a, b = _over(old, standard), _over(new, standard)
    mapping = np.linalg.lstsq(a.T, b.T, rcond=None)[0].T
    left = np.linalg.norm(b - mapping @ a, axis=1) / np.linalg.norm(b, axis=1)
    return None if (left > _REPRESENTED).any() else np.asarray(mapping)


def in_terms_of(night: Night, mapping: FloatArray) -> Night:
    """A night in other parameters, mapping (b_new, b_old) times its own."""
    covariance = mapping @ night.covariance @ mapping.T
    return replace(night, values=mapping @ night.values, covariance=(covariance + covariance.T) / 2.0)


def common_base(old: Relation, new: Relation) -> CommonBase:
    """The parameters of the old base that are functions of the new one.

    Both relations are written over the union of the standard parameters. A row of the old relation that lies
    in the row space of the new one is known from both models.
    """
    standard = tuple(dict.fromkeys((*old.standard, *new.standard)))
    a, b = _over(old, standard), _over(new, standard)
    mapping = np.linalg.lstsq(b.T, a.T, rcond=None)[0].T
    left = np.linalg.norm(a - mapping @ b, axis=1) / np.linalg.norm(a, axis=1)
    kept = np.flatnonzero(left < _REPRESENTED)
    mapping[np.abs(mapping) < _REPRESENTED * np.abs(mapping).max()] = 0.0
    return CommonBase(
        tuple(old.names[k] for k in kept),
        np.eye(len(old.names))[kept],
        np.asarray(mapping[kept]),
        tuple(name for k, name in enumerate(old.names) if k not in kept),
    )


def in_base_of(tonight: Night, baseline: Night, common: CommonBase) -> Night:
    """A baseline in the parameters of tonight's model, as far as it knows them.

    What it does not know stands at tonight's value and is as good as undetermined, so that no test sees a
    change there; it teaches nothing of what is usual either.

    Args:
        tonight: in the new base.
        baseline: in the old one.
        common: of the two.

    Raises:
        IdentificationError: they have nothing in common.
    """
    if not common.names:
        raise IdentificationError(f"{baseline.label}: none of its parameters is one of tonight's model")
    into = np.linalg.pinv(common.of_new)
    known = into @ common.of_new
    unknown = np.eye(tonight.values.size) - known
    size = np.maximum(np.abs(tonight.values), np.sqrt(np.diag(tonight.covariance)))
    spread = into @ common.of_old @ baseline.covariance @ common.of_old.T @ into.T
    spread = spread + unknown @ np.diag((_UNKNOWN * size) ** 2) @ unknown.T
    values = into @ common.of_old @ baseline.values + unknown @ tonight.values
    return replace(baseline, values=values, covariance=(spread + spread.T) / 2.0, clean=False)


def _terms(name: str, text: str) -> dict[str, float]:
    """Factor by standard parameter of an expression such as ``ZZ1 + Ia1 − 0.07 MZ3``."""
    found: dict[str, float] = {}
    place = 0
    while place < len(text):
        match = _TERM.match(text, place)
        if match is None or (place > 0 and not match[1]):
            raise IdentificationError(f"parameter {name}: {text}: is no sum of standard parameters")
        factor = float(match[2]) if match[2] else 1.0
        found[match[3]] = -factor if match[1] in ("−", "-") else factor
        place = match.end()
    if not found:
        raise IdentificationError(f"parameter {name}: has no expression in standard parameters")
    return found


def _over(relation: Relation, standard: tuple[str, ...]) -> FloatArray:
    place = {name: column for column, name in enumerate(standard)}
    matrix = np.zeros((relation.matrix.shape[0], len(standard)))
    matrix[:, [place[name] for name in relation.standard]] = relation.matrix
    return matrix
