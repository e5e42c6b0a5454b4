"""The estimators by name, as users ask for them and results hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from ident.estimators.biweight import BIWEIGHT
from ident.estimators.fit import LinearFit, Stacked
from ident.estimators.huber import HUBER
from ident.estimators.least_squares import ErrorDeviation


class Named(Protocol):
    """What is said of every estimator."""

    @property
    def name(self) -> str:
        """By which it is asked for, and its key in results and files."""
        ...

    @property
    def words(self) -> str:
        """As people call it."""
        ...

    @property
    def short(self) -> str:
        """As a table's heading."""
        ...


class RowEstimator(Named, Protocol):
    """An estimator that needs nothing but rows; one file of this package, entered in ``ALTERNATIVES``."""

    def fit(self, stacked: Stacked, names: tuple[str, ...], kind: ErrorDeviation = ...) -> LinearFit:
        """β̂ of the rows.

        Args:
            stacked: rows joint by joint, N·m (or N).
            names: (b,) of the base parameters.
            kind: how σ_j is estimated first.

        Raises:
            IdentificationError: the rows do not determine every parameter.
        """
        ...


@dataclass(frozen=True)
class _Own:
    """An estimator that the identification runs itself, since it needs more than rows."""

    name: str
    words: str
    short: str


ALTERNATIVES: Mapping[str, RowEstimator] = {e.name: e for e in (HUBER, BIWEIGHT)}
"""Computed beside least squares where asked for."""

ESTIMATORS: Mapping[str, Named] = {
    e.name: e
    for e in (
        _Own("ls", "least squares", "LS"),
        _Own("iv", "instrumental variables", "IV"),
        *ALTERNATIVES.values(),
        _Own("consistent", "physically consistent fit", "Consistent"),
    )
}
"""All, in the order in which results show them."""

METHODS = ("auto", *ESTIMATORS)
"""What ``--method`` takes; with ``auto`` the verdict of the revised test chooses."""
