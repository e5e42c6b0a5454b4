"""What the discrepancy search returns: small frozen values."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ident.discrepancy.binned_residual import BinnedResidual
from ident.discrepancy.confirmation import Confirmation
from ident.discrepancy.examination import Examination
from ident.discrepancy.gap import Gap, LoopTrace
from ident.discrepancy.loop import Standstill
from ident.discrepancy.residual_dependence import ResidualDependence
from ident.discrepancy.unexplained import Unexplained
from ident.discrepancy.unrepeated import Unrepeated
from ident.effects.entry import joint_words
from ident.effects.family import PlacedEffect, Scope
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray

DiagnosisVerdict = Literal["clean", "named", "ambiguous", "not_confirmed", "unnamed"]

Mode = Literal["prior", "refit"]
"""Against a model that existed before, or after a refit of the base parameters."""


@dataclass(frozen=True)
class FoundParameter:
    """One parameter of a finding, SI; ``shape`` where the torque is not linear in it."""

    name: str
    value: float
    sigma: float
    unit: str
    shape: bool


@dataclass(frozen=True)
class Candidate:
    """One entry of a ranking: a name at its joints, from 1.

    Attributes:
        effect, joints: what and where.
        score: log odds of it against nothing.
        probability: of the name at its place.
        placed: the effect with its shapes, as it was scored.
    """

    effect: str
    joints: tuple[int, ...]
    score: float
    probability: float
    placed: PlacedEffect = field(repr=False, compare=False)

    def words(self) -> str:
        return f"{self.effect} ({joint_words(self.joints)})"


@dataclass(frozen=True)
class Possible:
    """One of the answers for a place that together hold 95 %: a name, something without one, or nothing.

    Attributes:
        name: as the vocabulary or the search says it.
        joints: from 1.
        probability: of it.
    """

    name: str
    joints: tuple[int, ...]
    probability: float

    def words(self) -> str:
        place = f" ({joint_words(self.joints)})" if self.joints else ""
        return f"{self.name}{place} {self.probability:.2f}"


@dataclass(frozen=True)
class Finding:
    """One missing effect, where it sits, how sure that is, and the gap with and without it.

    Joints count from 1. ``indistinguishable_from`` holds what this data cannot tell from it. ``gap`` is that
    of the final model less this finding alone, and with it, on the validation recordings; ``held_out_gain``
    is the share of the explainable gap that it closes there, and ``confirmation`` whether it is there at all.
    """

    effect: str
    sentence: str
    scope: Scope
    joints: tuple[int, ...]
    parameters: tuple[FoundParameter, ...]
    p_value: float
    score: float
    threshold: float
    held_out_gain: float
    indistinguishable_from: tuple[Candidate, ...]
    mode: Mode
    gap: Gap
    confirmation: Confirmation
    placed: PlacedEffect
    binned_residual: BinnedResidual
    ranking: tuple[Candidate, ...]
    probability: float
    """Of the name at its place."""
    held: tuple[Possible, ...]
    """What is possible there, the likeliest first, as far as it takes for 95 %."""

    def with_deviations_more(self, more: FloatArray) -> Finding:
        """The same, its parameters with deviations (k,) beside those that they have, each in its unit."""
        sigmas = np.hypot([one.sigma for one in self.parameters], more)
        pairs = zip(self.parameters, sigmas, strict=True)
        return replace(self, parameters=tuple(replace(one, sigma=float(sigma)) for one, sigma in pairs))

    def words(self) -> str:
        """The finding as a sentence."""
        seen = [p for p in self.parameters if p.value != 0.0 or p.sigma != 0.0]
        values = ", ".join(_parameter_words(parameter) for parameter in seen)
        place = joint_words(self.joints)
        verb = "have" if len(self.joints) > 1 else "has"
        return f"{place} {verb} {self.effect.replace('_', ' ')} ({values})"


@dataclass(frozen=True)
class Diagnosis:
    """The answer: a verdict, the findings in the order they were made, the model that has them.

    Attributes:
        verdict: of the whole.
        findings: none where the arm is clean or the residual has no name.
        rejected: findings that the recordings that were not fitted contradict, beside others that they
            confirm; no part of the model.
        ranking: candidates beside the final model, best first, whether one passed or not.
        unexplained: per joint, what the final model leaves on the validation recordings, worst first.
        description: in words, what is left where nothing explains it.
        dependences: what the last residual depends on, per joint.
        unrepeated: what does not repeat and should not be there.
        notes: sentences on the arm beside what the model lacks.
        torque, position, control_signal: gap on the validation recordings; None where the loop could not
            be simulated, with the reason in ``loop_reason``.
        base, beta: the final model and its base parameters.
        examinations: of the fit recordings, before the first finding and after the last.
        standstill: how each drive's dry friction turns its sign there, as the fit recordings show it in the
            simulated loop; None where that was not asked.
    """

    verdict: DiagnosisVerdict
    findings: tuple[Finding, ...]
    rejected: tuple[Finding, ...]
    ranking: tuple[Candidate, ...]
    unexplained: tuple[Unexplained, ...]
    description: str
    dependences: tuple[ResidualDependence, ...]
    unrepeated: tuple[Unrepeated, ...]
    torque: Gap
    position: Gap | None
    control_signal: Gap | None
    loop_reason: str
    loop: LoopTrace | None
    base: BaseParameters
    beta: FloatArray
    covariance: FloatArray
    examinations: tuple[Examination, ...] = field(repr=False, default=())
    notes: tuple[str, ...] = ()
    standstill: Standstill | None = field(repr=False, default=None)

    def nearest(self, joint: int) -> Candidate | None:
        """The best candidate of the ranking that acts on a joint (from 0), alone; None where none is."""
        return next((one for one in self.ranking if one.joints == (joint + 1,)), None)


def _parameter_words(parameter: FoundParameter) -> str:
    """Value and deviation, small angles and lengths in thousandths."""
    value, sigma, unit = parameter.value, parameter.sigma, parameter.unit
    if unit in {"rad", "m", "s"} and abs(value) < 0.1:
        value, sigma, unit = 1e3 * value, 1e3 * sigma, f"m{unit}"
    spread = f" ± {sigma:.2g}" if sigma else ""
    return f"{parameter.name} {value:.4g}{spread}{'' if unit == '1' else f' {unit}'}"
