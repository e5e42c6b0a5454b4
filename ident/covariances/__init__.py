"""Covariances of linear estimates, by name.

Each kind says how errors may vary and be correlated. All of them give (ZᵀX)⁻¹ S (XᵀZ)⁻¹ on rows weighted by
Ω^-½ and differ in S, the covariance of Zᵀε.
"""

from __future__ import annotations

from typing import Protocol

from ident.covariances.autoregressive import Autoregressive
from ident.covariances.bootstrap import BlockBootstrap
from ident.covariances.cluster import Cluster
from ident.covariances.hac import BartlettHac
from ident.covariances.independent import Block, Independent, White
from ident.covariances.problem import EstimatedRows, estimated_rows, estimated_stack
from ident.errors import IdentificationError
from robots.arrays import FloatArray


class Covariance(Protocol):
    """One assumption on the errors."""

    @property
    def name(self) -> str: ...

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        """S, (b, b)."""
        ...

    def describe(self, rows: EstimatedRows) -> str:
        """The assumption in words, with what was chosen from the data."""
        ...


_KINDS: dict[str, Covariance] = {
    kind.name: kind
    for kind in (
        Independent(),
        Block(),
        Autoregressive(),
        White(),
        BartlettHac(),
        Cluster(),
        BlockBootstrap(),
    )
}


def covariance_kinds() -> tuple[str, ...]:
    """The names that :func:`covariance_named` knows."""
    return tuple(_KINDS)


def covariance_named(name: str) -> Covariance:
    """The covariance of that name with its usual settings.

    Raises:
        IdentificationError: there is none of that name.
    """
    if name not in _KINDS:
        raise IdentificationError(f'covariance "{name}"; allowed: {", ".join(_KINDS)}')
    return _KINDS[name]


def covariance_of(rows: EstimatedRows, kind: Covariance) -> FloatArray:
    """Covariance (b, b) of the estimate whose rows and residuals are given."""
    return rows.sandwich(kind.score_covariance(rows))


__all__ = [
    "Autoregressive",
    "BartlettHac",
    "Block",
    "BlockBootstrap",
    "Cluster",
    "Covariance",
    "EstimatedRows",
    "Independent",
    "White",
    "covariance_kinds",
    "covariance_named",
    "covariance_of",
    "estimated_rows",
    "estimated_stack",
]
