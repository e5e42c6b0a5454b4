"""IDIM-LS: ordinary least squares per joint for Ω, then weighted least squares over all (eq. 7)."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ident.errors import IdentificationError
from ident.estimators.fit import LinearFit, Stacked
from ident.listing import listed
from ident.statistics.triangle import triangle_beside
from robots.arrays import FloatArray

ErrorDeviation = Literal["unbiased", "sample"]

_DEPENDENT = 1e-10
"""Singular values below this share of the largest are no information."""


def joint_deviations(stacked: Stacked, kind: ErrorDeviation = "unbiased") -> FloatArray:
    """σ_j of each joint from the OLS of its own subsystem, (n,).

    Args:
        stacked: rows joint by joint.
        kind: ``unbiased`` divides by rows less the subsystem's parameters, ``sample`` by rows less one.

    Raises:
        IdentificationError: a joint has fewer rows than parameters, or its torque is constant zero.
    """
    sigma = np.empty(stacked.joints)
    blocks = zip(stacked.split(stacked.x), stacked.split(stacked.y), strict=True)
    for joint, (x, y) in enumerate(blocks):
        seen, (r, shares) = x.any(axis=0), triangle_beside(x, y)
        beta = np.zeros(x.shape[1])
        beta[seen], _, rank, _ = np.linalg.lstsq(r[:, seen], shares, rcond=_DEPENDENT)
        freedom = y.size - (int(rank) if kind == "unbiased" else 1)
        if y.size <= rank:
            raise IdentificationError(
                f"joint {joint + 1}: {y.size} rows for {rank} parameters; record for longer"
            )
        residual = y - x @ beta
        sigma[joint] = np.sqrt(residual @ residual / freedom)
        if sigma[joint] == 0.0:
            raise IdentificationError(
                f"joint {joint + 1}: the torque is fitted without any error; is its control signal recorded?"
            )
    return sigma


def weighted_least_squares(
    stacked: Stacked, names: tuple[str, ...], kind: ErrorDeviation = "unbiased"
) -> LinearFit:
    """β̂ = (XᵀΩ⁻¹X)⁻¹XᵀΩ⁻¹y and its covariance (XᵀΩ⁻¹X)⁻¹ (eq. 7), Ω from each joint's own OLS.

    Args:
        stacked: rows joint by joint.
        names: (b,) base parameter names, to say which cannot be seen.
        kind: how σ_j is estimated, see :func:`joint_deviations`.

    Raises:
        IdentificationError: the rows do not determine every parameter; the message names those.
    """
    sigma = joint_deviations(stacked, kind)
    weights = stacked.spread(1.0 / sigma)
    r, shares = triangle_beside(stacked.x, stacked.y * weights, weights)
    require_full_rank(r, names)  # the triangle has the singular values and directions of the rows
    beta = np.asarray(np.linalg.solve(r, shares), dtype=np.float64)
    inverse = np.linalg.inv(r)
    return LinearFit(beta, inverse @ inverse.T, sigma, float(np.linalg.cond(r)))


def require_full_rank(x: FloatArray, names: tuple[str, ...]) -> None:
    """Refuse columns that the data do not tell apart.

    Raises:
        IdentificationError: names the parameters that the motion does not excite.
    """
    scale = np.linalg.norm(x, axis=0)
    silent = [name for name, size in zip(names, scale, strict=True) if size == 0.0]
    if silent:
        raise IdentificationError(
            f"the motion does not excite {listed(silent)}; move the joints they belong to"
        )
    _, values, directions = np.linalg.svd(x / scale, full_matrices=False)
    blind = values < _DEPENDENT * values[0]
    if blind.any():
        share = np.abs(directions[blind]).max(axis=0)
        mixed = [name for name, part in zip(names, share, strict=True) if part > 0.1]
        raise IdentificationError(
            f"the motion does not tell apart {listed(mixed)}; record a more exciting trajectory"
        )
