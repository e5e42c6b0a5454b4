"""The convex program of the physically consistent fit, for cvxpy and Clarabel."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.errors import IdentificationError
from ident.estimators.consistent_scales import Scalars
from robots.arrays import FloatArray
from robots.extras import install_command
from robots.pseudo_inertia import LINK_SIZE, link_map, pseudo_inertia

_SOLVED = ("optimal", "optimal_inaccurate")
_IMPOSSIBLE = ("infeasible", "infeasible_inaccurate")

_GAP = 1e-7
"""Duality gap at which the solver stops: in units of σ² it moves nothing."""

_THINNEST = 0.01
"""m; a prior body is taken to be at least this thick, so that a point mass can serve as one."""


@dataclass(frozen=True)
class Program:
    """Minimise ‖matrix · p − target‖² + weight · (distance from the prior).

    Attributes:
        matrix: (b, p).
        target: (b,).
        roots: per link a root L (4, 4) of the prior's pseudo-inertia L Lᵀ.
        scalars: the standard parameters after those of the links.
        weight: 1/ρ².
        exact: matrix · p = target is a constraint, and the distance from the prior alone is minimised.
    """

    matrix: FloatArray
    target: FloatArray
    roots: tuple[FloatArray, ...]
    scalars: Scalars
    weight: float
    exact: bool = False


def solve(program: Program) -> tuple[FloatArray, FloatArray] | None:
    """The standard vector (p,), and per link the smallest eigenvalue relative to the prior, (n,).

    None where ``exact`` is asked for and cannot be.

    Raises:
        IdentificationError: cvxpy or Clarabel is not installed, or the solver fails.
    """
    cp = _cvxpy()
    links = LINK_SIZE * len(program.roots)
    shapes = [cp.Variable((4, 4), symmetric=True) for _ in program.roots]
    cost: Any = 0.0
    predicted: Any = -program.target
    for k, (root, shape) in enumerate(zip(program.roots, shapes, strict=True)):
        columns = program.matrix[:, LINK_SIZE * k : LINK_SIZE * (k + 1)]
        predicted = predicted + (columns @ _link_of_shape(root)) @ cp.vec(shape, order="C")
        cost = cost + 2.0 * (cp.trace(shape) - cp.log_det(shape))
    constraints: list[Any] = []
    scalars = program.scalars
    steps = cp.Variable(len(scalars.names)) if scalars.names else None
    if steps is not None:
        predicted = predicted + program.matrix[:, links:] @ (
            scalars.prior + cp.multiply(scalars.scale, steps)
        )
        cost = cost + cp.sum_squares(steps[np.flatnonzero(scalars.pulled)])
        constraints = _limits(cp, scalars, steps)
    if program.exact:
        problem = cp.Problem(cp.Minimize(cost), [*constraints, predicted == 0])
    else:
        problem = cp.Problem(cp.Minimize(cp.sum_squares(predicted) + program.weight * cost), constraints)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cp.CLARABEL, tol_gap_abs=_GAP, tol_gap_rel=_GAP)
    except cp.SolverError as error:
        raise IdentificationError(f"the physically consistent fit has not been solved: {error}") from None
    if program.exact and problem.status in _IMPOSSIBLE:
        return None
    if problem.status not in _SOLVED:
        raise IdentificationError(f"the physically consistent fit has no solution: {problem.status}")
    found = [_link_of_shape(root) @ s.value.ravel() for root, s in zip(program.roots, shapes, strict=True)]
    if steps is not None:
        values = scalars.prior + scalars.scale * steps.value
        found.append(np.clip(values, scalars.lower, scalars.upper))
    margins = np.array([np.linalg.eigvalsh(shape.value)[0] for shape in shapes])
    return np.concatenate(found), margins


def require_solver() -> None:
    """Refuse before the work instead of after it.

    Raises:
        IdentificationError: cvxpy or Clarabel is not installed.
    """
    _cvxpy()


def _limits(cp: Any, scalars: Scalars, steps: Any) -> list[Any]:
    low, high = np.isfinite(scalars.lower), np.isfinite(scalars.upper)
    lower = (scalars.lower[low] - scalars.prior[low]) / scalars.scale[low]
    upper = (scalars.upper[high] - scalars.prior[high]) / scalars.scale[high]
    limits = [steps[np.flatnonzero(low)] >= lower] if low.any() else []
    limits += [steps[np.flatnonzero(high)] <= upper] if high.any() else []
    for _, matrices in scalars.positive:
        size = matrices.shape[1]
        unit = float(np.abs(np.einsum("k,kij->ij", scalars.prior, matrices)).max()) or 1.0
        flat = matrices.reshape(len(scalars.names), -1).T / unit
        matrix = cp.reshape(flat @ scalars.prior + (flat * scalars.scale) @ steps, (size, size), order="C")
        limits.append(0.5 * (matrix + matrix.T) >> 0)
    return limits


def link_root(link: FloatArray) -> FloatArray:
    """A root L (4, 4) of the pseudo-inertia L Lᵀ of a link (10,) with mass, thick enough to be a body."""
    mass = float(link[0])
    pseudo = pseudo_inertia(link)
    center = pseudo[:3, 3] / mass
    spread, axes = np.linalg.eigh(pseudo[:3, :3] / mass - np.outer(center, center))
    root = np.zeros((4, 4))
    root[:3, :3] = axes * np.sqrt(np.maximum(spread, _THINNEST**2))
    root[:3, 3] = center
    root[3, 3] = 1.0
    return np.asarray(np.sqrt(mass) * root)


def _link_of_shape(root: FloatArray) -> FloatArray:
    """(10, 16): standard parameters of L S Lᵀ from the entries of S."""
    return np.asarray(link_map() @ np.kron(root, root))


def _cvxpy() -> Any:
    try:
        import clarabel  # noqa: F401
        import cvxpy
    except ImportError as error:
        raise IdentificationError(
            f"the physically consistent fit needs {error.name}; install it with:"
            f" {install_command('consistent')}"
        ) from None
    return cvxpy
