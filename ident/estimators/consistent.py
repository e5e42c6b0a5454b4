"""The physically consistent fit: the nearest parameters that an arm made of bodies can have.

Least squares knows nothing of physics; what the motion shows badly may come out as a body of negative mass.
Here every link's pseudo-inertia is positive (Traversaro et al. 2016; Wensing, Kim, Slotine 2018), the
drives' inertia and damping are positive semidefinite and their friction is not negative. Minimised is

    (Kp − β̂)ᵀ XᵀΩ⁻¹X (Kp − β̂) + (1/ρ²) · [ Σ 2 d(P_k ‖ P⁰_k) + Σ ((x_i − x⁰_i)/s_i)² ]

over the standard vector p, with K the regrouping, P_k the pseudo-inertias and x_i the drives' parameters.
For least squares the first term is the rise of the whitened residual. The second chooses among the standard
vectors of one base vector. d is the entropic divergence tr(P⁰⁻¹P) − log det(P⁰⁻¹P) − 4: unlike a Frobenius
norm it does not depend on frame or unit and keeps each body away from the boundary, so that the mass matrix
is positive definite; unlike the geodesic distance (Lee, Wensing, Park 2020), to which it is equal to second
order, it is convex in p. ρ = 1 means that the prior is right to a factor of two or so: a parameter that the
data show to 1 % is moved by about a hundredth of its σ.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ident.errors import IdentificationError
from ident.estimators.consistent_program import Program, link_root, require_solver, solve
from ident.estimators.consistent_scales import Scalars
from ident.estimators.fit import LinearFit, Stacked
from ident.parameters.base import BaseParameters
from ident.statistics.tails import beyond_chi2
from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.pseudo_inertia import LINK_SIZE, impossible_links

__all__ = ["Body", "ConsistentFit", "consistent_fit", "consistent_standard", "require_solver"]

PRIOR_DEVIATION = 1.0
"""ρ: relative standard deviation that the prior is believed to have."""

_AT_LIMIT = 0.02
"""A link is at its limit where its pseudo-inertia is below this share of the prior's in some direction."""


@dataclass(frozen=True)
class Body:
    """One link of the consistent model.

    Attributes:
        name: of the link in the URDF.
        mass: kg.
        center: (3,) centre of mass in the link frame, m.
        margin: smallest eigenvalue of the pseudo-inertia relative to the prior's; 1 for the prior itself, 0
            at the edge of what a body can be.
        impossible_before: whether the unconstrained estimate, mapped back to the standard vector nearest to
            the prior, makes a body of it that cannot exist.
    """

    name: str
    mass: float
    center: FloatArray
    margin: float
    impossible_before: bool

    @property
    def at_limit(self) -> bool:
        return self.margin < _AT_LIMIT


@dataclass(frozen=True)
class ConsistentFit(LinearFit):
    """A linear fit that an arm can have; ``covariance`` is that of the unconstrained estimate.

    Attributes:
        standard: (p,) the standard vector; ``beta`` is its base vector.
        shift: (b,) β less the unconstrained β̂, in its σ.
        distance: (β − β̂)ᵀ XᵀΩ⁻¹X (β − β̂).
        expected_distance: what errors alone make of it where the true arm is consistent, at most.
        p_value: probability of at least this distance then: a small one speaks against the *model*, since no
            arm of this structure has such parameters. Conservative: the nearest arm is nearer than the true.
        bodies: the links.
        limits: what holds the fit back: links and drive parameters at the edge of what can be.
        residual_change_percent: by how much the whitened torque residual grows, Ω^-½(y − Xβ) in norm; None
            where no rows were given.
    """

    standard: FloatArray = field(kw_only=True)
    shift: FloatArray = field(kw_only=True)
    distance: float = field(kw_only=True)
    expected_distance: float = field(kw_only=True)
    p_value: float = field(kw_only=True)
    bodies: tuple[Body, ...] = field(kw_only=True)
    limits: tuple[str, ...] = field(kw_only=True)
    residual_change_percent: float | None = field(kw_only=True, default=None)

    def sentence(self) -> str:
        """How much worse than the unconstrained fit, and why, in words."""
        change = self.residual_change_percent
        worse = "" if change is None else f"the torque residual grows by {max(change, 0.0):.2g} %; "
        verdict = (
            "errors alone explain that" if self.p_value >= 0.05 else "the data speak against any such arm"
        )
        held = f"; at the limit: {', '.join(self.limits)}" if self.limits else ""
        return (
            f"{worse}distance {self.distance:.3g} where errors alone make up to {self.expected_distance:.3g}"
            f" (p = {self.p_value:.2g}): {verdict}{held}"
        )


def consistent_fit(
    base: BaseParameters,
    fit: LinearFit,
    stacked: Stacked | None = None,
    prior: FloatArray | None = None,
    prior_deviation: float = PRIOR_DEVIATION,
) -> ConsistentFit:
    """The physically consistent parameters nearest to a fit.

    Args:
        base: the base parameters of the fit.
        fit: any linear estimate, LS, IV or robust.
        stacked: its rows. Without them Σ̂⁻¹ stands for XᵀΩ⁻¹X, which weighs the same where the covariance is
            the paper's (``block``) and leaves more to the prior where it is wider.
        prior: (p,) standard vector, e.g. CAD; URDF and drive data where None.
        prior_deviation: ρ, relative standard deviation of the prior.

    Raises:
        IdentificationError: cvxpy is not installed, a link of the prior has no mass, or the solver fails.
    """
    prior = base.model.prior() if prior is None else prior
    sigma = np.sqrt(np.diag(fit.covariance))
    root = _information_root(fit, stacked)
    scalars = Scalars.of(base, prior)
    weight = 1.0 / prior_deviation**2
    found = solve(Program(root @ base.relation, root @ fit.beta, _prior_roots(base, prior), scalars, weight))
    assert found is not None  # an arm like the prior always is a solution
    standard, margins = found
    beta = base.regroup(standard)
    distance = float(np.sum((root @ (beta - fit.beta)) ** 2))
    expected, p_value = _by_errors_alone(root @ fit.covariance @ root.T, distance)
    before = base.standard_from(fit.beta, prior)
    bodies = _bodies(base, standard, margins, before)
    inherited = {name: getattr(fit, name) for name in LinearFit.__dataclass_fields__}
    return ConsistentFit(
        **(inherited | {"beta": beta}),
        standard=standard,
        shift=(beta - fit.beta) / sigma,
        distance=distance,
        expected_distance=expected,
        p_value=p_value,
        bodies=bodies,
        limits=(*(body.name for body in bodies if body.at_limit), *scalars.holding(standard, before)),
        residual_change_percent=None if stacked is None else _residual_change(stacked, fit, beta),
    )


def consistent_standard(
    base: BaseParameters, beta: FloatArray, prior: FloatArray | None = None
) -> FloatArray | None:
    """Of the standard vectors (p,) with exactly this base vector that an arm can have, the nearest to a
    prior. None where there is none: no arm has these base parameters, whatever the split over its links.

    Args:
        base: the base parameters.
        beta: (b,) their values.
        prior: (p,) standard vector, e.g. CAD; URDF and drive data where None.

    Raises:
        IdentificationError: cvxpy is not installed, a link of the prior has no mass, or the solver fails.
    """
    prior = base.model.prior() if prior is None else prior
    scalars = Scalars.of(base, prior)
    unit = 1.0 / np.maximum(np.abs(beta), 1e-3 * np.linalg.norm(base.relation, axis=1))
    matrix = unit[:, np.newaxis] * base.relation
    found = solve(Program(matrix, unit * beta, _prior_roots(base, prior), scalars, 1.0, exact=True))
    if found is None:
        return None
    # The solver stops at a residual of its tolerance; the rest of the way is the shortest one.
    standard = base.standard_from(beta, found[0])
    links = standard[: LINK_SIZE * base.model.robot.n].reshape(-1, LINK_SIZE)
    return None if impossible_links(links) else standard


def link_names(base: BaseParameters) -> tuple[str, ...]:
    """The URDF's names of the n moving links."""
    model = rigid_body_model(base.model.robot)
    return tuple(
        next(frame.name for frame in model.frames if frame.parentJoint == joint and "BODY" in str(frame.type))
        for joint in range(1, model.njoints)
    )


def _prior_roots(base: BaseParameters, prior: FloatArray) -> tuple[FloatArray, ...]:
    """Per link a root of the prior's pseudo-inertia."""
    links = prior[: LINK_SIZE * base.model.robot.n].reshape(-1, LINK_SIZE)
    massless = [name for name, link in zip(link_names(base), links, strict=True) if not link[0] > 0.0]
    if massless:
        raise IdentificationError(
            f"{', '.join(massless)}: no mass in the URDF, so there is no prior for the inertia; allowed: a"
            " rough estimate of mass, centre and inertia for each moving link"
        )
    return tuple(link_root(link) for link in links)


def _information_root(fit: LinearFit, stacked: Stacked | None) -> FloatArray:
    """R (b, b) with RᵀR = XᵀΩ⁻¹X, or Σ̂⁻¹ where there are no rows."""
    if stacked is not None:
        weights = stacked.spread(1.0 / fit.sigma)
        return np.asarray(np.linalg.qr(stacked.x * weights[:, np.newaxis], mode="r"))
    sigma = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(sigma, sigma)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(correlation), np.diag(1.0 / sigma)))


def _by_errors_alone(covariance: FloatArray, distance: float) -> tuple[float, float]:
    """Mean of ‖e‖² for e of this covariance (b, b), and the probability of at least ``distance``.

    A sum of weighted χ²; its first two moments are those of a multiple of one χ² (Satterthwaite).
    """
    mean = float(np.trace(covariance))
    square = float(np.sum(covariance**2))
    return mean, beyond_chi2(distance * mean / square, mean**2 / square)


def _bodies(
    base: BaseParameters, standard: FloatArray, margins: FloatArray, before: FloatArray
) -> tuple[Body, ...]:
    count = LINK_SIZE * base.model.robot.n
    impossible = impossible_links(before[:count].reshape(-1, LINK_SIZE))
    links = standard[:count].reshape(-1, LINK_SIZE)
    return tuple(
        Body(name, float(link[0]), link[1:4] / link[0], float(margin), k in impossible)
        for k, (name, link, margin) in enumerate(zip(link_names(base), links, margins, strict=True))
    )


def _residual_change(stacked: Stacked, fit: LinearFit, beta: FloatArray) -> float:
    weights = stacked.spread(1.0 / fit.sigma)
    before, after = (float(np.linalg.norm((stacked.y - stacked.x @ b) * weights)) for b in (fit.beta, beta))
    return 100.0 * (after / before - 1.0)
