"""Effects that a search has found against a prior keep what it found of them.

A spring beside gravity, or a payload, is told from the links by what was known of the links before. Fitted
once more without that, it is known to a few times its size and takes the links' parameters along. So the
estimate is combined with what the model file says of such an effect, θ₀ ± Σ₀, as two measurements of one
thing are:

    β = β̂ + C Hᵀ S⁻¹ (θ₀ − H β̂) ,   Cov = C − C Hᵀ S⁻¹ H C ,   S = H C Hᵀ + Σ₀

with H β the parameters of the effect. Where the recordings say more of it than the file, they win.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ident.effects.found import Found
from ident.estimators.fit import LinearFit
from ident.identification.found_effects import FoundModel
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray, IntArray

_DISAGREE = 3.0
"""Deviations of the difference from which on it is said that the recordings say something else."""


@dataclass(frozen=True)
class KeptEffects:
    """What is known before of the effects that a model has.

    Attributes:
        names: (k,) their parameters.
        places: (k,) where these stand among the base parameters.
        values: (k,) θ₀.
        covariance: (k, k) Σ₀.
        source: of the model, for messages.
    """

    names: tuple[str, ...] = ()
    places: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    values: FloatArray = field(default_factory=lambda: np.zeros(0))
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    source: str = ""

    @classmethod
    def of(cls, base: BaseParameters, known: FoundModel | None) -> KeptEffects:
        """Of the found effects of a model that easily pass for its links."""
        if known is None or not known.covariance:
            return cls()
        names = [
            parameter.name
            for effect in base.model.effects
            if isinstance(effect, Found) and _is_beside_links(base, effect)
            for parameter, kept in zip(effect.parameters, effect.kept, strict=True)
            if kept and known.covariance.get((parameter.name, parameter.name), 0.0) > 0.0
        ]
        if not names:
            return cls()
        covariance = np.array([[known.covariance.get((a, b), 0.0) for b in names] for a in names])
        return cls(
            tuple(names),
            np.array([base.names.index(name) for name in names], dtype=np.int64),
            np.array([known.values[name] for name in names]),
            covariance,
            known.source,
        )

    def in_fit(self, fit: LinearFit) -> LinearFit:
        """An estimate combined with what was known."""
        if not self.names:
            return fit
        across = fit.covariance[:, self.places]
        share = np.linalg.solve(across[self.places] + self.covariance, across.T).T
        beta = fit.beta + share @ (self.values - fit.beta[self.places])
        covariance = fit.covariance - share @ across.T
        return replace(fit, beta=beta, covariance=0.5 * (covariance + covariance.T))

    def sentences(self, alone: LinearFit) -> tuple[str, ...]:
        """What is said where an estimate without all this is something else, or hardly one."""
        found = []
        for name, place, value, variance in zip(
            self.names, self.places, self.values, np.diag(self.covariance), strict=True
        ):
            own, sigma = float(alone.beta[place]), float(np.sqrt(alone.covariance[place, place]))
            if abs(own - value) > _DISAGREE * np.hypot(sigma, np.sqrt(variance)):
                found.append(
                    f"{name} is {value:.4g} ± {np.sqrt(variance):.2g} in {self.source}; these recordings"
                    f" alone say {own:.4g} ± {sigma:.2g}"
                )
        return tuple(found)


def _is_beside_links(base: BaseParameters, effect: Found) -> bool:
    """Whether it hangs on the arm, or only a prior tells it; friction of a drive is what it is on the day.

    A formula may be anything.
    """
    # Imported here: every effect, and the compiler.
    from ident.effects.term_family import is_term
    from ident.effects.vocabulary import form_of

    if is_term(effect.name):
        return False

    family = form_of(base.model.robot, effect.name, effect.shape_names)
    return effect.place.scope != "drive" or family.needs_prior


def known_names(known: FoundModel | None) -> frozenset[str]:
    """Parameters of found effects whose size is known before."""
    return frozenset() if known is None else frozenset(name for name, _ in known.covariance)
