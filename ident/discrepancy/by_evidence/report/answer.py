"""The answer: what is missing, how sure that is, what confirms it, what stays unexplained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.discrepancy.by_evidence.confirm.borne_out import Refuted
from ident.discrepancy.by_evidence.confirm.held_out import Confirmation
from ident.discrepancy.by_evidence.decide.names import SURE, Key, Named, Slot
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.effects.entry import joint_words
from ident.effects.family import PlacedEffect
from robots.arrays import FloatArray

WORSE = "with all that was found recordings that were not fitted leave more than without any of it"
"""How a set fails, and another name in the place of one of its own need not."""

TOO_POOR = "recordings that were not fitted leave more than the torque itself: the fitted motion is too poor"
"""How any set fails."""

EvidenceVerdict = Literal["named", "not_confirmed", "clean", "unnamed"]


@dataclass(frozen=True)
class FittedParameter:
    """One parameter of an effect, SI; a shape where the torque is not linear in it."""

    name: str
    value: float
    sigma: float
    unit: str
    shape: bool


@dataclass(frozen=True)
class EvidenceFinding:
    """One effect of the best set.

    Attributes:
        placed: the effect with its shapes.
        names: the possible names in its place, the likeliest first; nothing at all is one of them.
        parameters: values with deviations.
        unsure: what makes it this effect and is not told from nothing, in words; empty where all is.
        confirmation: on recordings that were not fitted.
        explains: root mean square of its torque, N·m (or N), at its joints.
        left: misfit of the joint of its own where it is largest, N·m (or N); the accepted one at least.
        fails: how on recordings that were not fitted the whole set fails at the joint where this one is
            largest, in words; empty where it does not.
    """

    placed: PlacedEffect
    names: tuple[Named, ...]
    parameters: tuple[FittedParameter, ...]
    unsure: str
    confirmation: Confirmation
    explains: float
    left: float
    fails: str

    @property
    def key(self) -> Key:
        """Its name and joints, from 0."""
        return self.placed.name, self.placed.place.joints

    @property
    def name(self) -> str:
        return self.placed.name

    @property
    def joints(self) -> tuple[int, ...]:
        """From 1."""
        return tuple(joint + 1 for joint in self.placed.place.joints)

    @property
    def linear(self) -> FloatArray:
        """(p,) its linear parameters."""
        return np.array([one.value for one in self.parameters if not one.shape])

    @property
    def probability(self) -> float:
        """Of its name at its place."""
        return Slot(self.names).each.probability(self.key)

    @property
    def something(self) -> float:
        """Probability that there is any effect in its place."""
        return Slot(self.names).something

    @property
    def log_odds(self) -> float:
        """Of its name against nothing, coarsened, with its prior."""
        return Slot(self.names).log_odds(self.key)

    @property
    def set(self) -> tuple[Named, ...]:
        """The smallest set of names that holds 95 %."""
        return Slot(self.names).each.held

    @property
    def sure(self) -> bool:
        """Whether it is likely enough, and explains more than stays unexplained beside it."""
        return self.probability >= SURE and self.explains > self.left

    @property
    def no_name(self) -> float:
        """Probability that what is there has no name."""
        return Slot(self.names).probability((NO_NAME, self.key[1]))

    @property
    def held_up(self) -> bool:
        """Whether it is an effect that has a name, and what is found as a whole does not fail."""
        return Slot(self.names).named >= SURE and not self.fails

    @property
    def named(self) -> bool:
        return self.sure and self.held_up

    @property
    def doubt(self) -> str:
        """Why it is not confirmed, in words; empty where it is."""
        return self.doubt_of(self.key)

    def doubt_of(self, key: Key) -> str:
        """Why a name in its place is not confirmed; that a set does worse is known of its own name alone."""
        seen = self.confirmation.shown
        if Slot(self.names).named < SURE:
            shown = (
                f"{100.0 * seen.share:.0f} ± {100.0 * seen.sigma:.0f} % of it"
                if seen.sigma > 0.0
                else "nothing of it"
            )
            return (
                f"recordings that were not fitted show {shown};"
                f" something that has no name is there with probability {self.no_name:.2f}"
            )
        if self.fails and (key == self.key or self.fails != WORSE):
            return self.fails
        if self.explains <= self.left:
            return "it explains less than a model leaves at its joint without any change"
        return ""

    def words(self) -> str:
        """As a sentence."""
        what = (
            f"{self.name.replace('_', ' ')} ({joint_words(self.joints)}), probability {self.probability:.2f}"
        )
        return f"{what}; not confirmed: {self.doubt}" if self.doubt else what


@dataclass(frozen=True)
class JointMisfit:
    """What stays unexplained at a joint, from 1.

    Attributes:
        joint: which.
        before, after: share of the torque that is left beyond noise on recordings that were not fitted.
        kappa, accepted: root mean square of the misfit and that of the accepted run, N·m (or N).
        above: probability that it is above the accepted one.
        nearest: the name that comes nearest to what is left here, against nothing at all; None where the
            vocabulary has none that acts here.
    """

    joint: int
    before: float
    after: float
    kappa: float
    accepted: float
    above: float
    nearest: Named | None = None


@dataclass(frozen=True)
class EvidenceAnswer:
    """What the evidence says.

    Attributes:
        verdict: of the whole.
        findings: effects of the best set, those first that explain most of what is left beside them.
        refuted: effects that the fitted rows want beside these, and other motion does not.
        ranking: names for the first effect, the likeliest first; nothing at all is one of them.
        beside: names for one effect more beside the set, each against nothing, the likeliest first.
        joints: worst first.
        nameable: the smallest size of each other effect that would have been named here.
        gate_one_rejected: whether gate 1 of the revised test rejects a model that is otherwise clean; None
            where it was not asked, or the loop cannot be simulated.
        repeats: whether noise was told from repeats of the motion.
        log_evidence: of the model without an effect, and of the best set.
        standard: (p,) parameters of the model beside the best set.
    """

    verdict: EvidenceVerdict
    findings: tuple[EvidenceFinding, ...]
    refuted: tuple[Refuted, ...]
    ranking: tuple[Named, ...]
    beside: tuple[Named, ...]
    joints: tuple[JointMisfit, ...]
    nameable: tuple[Smallest, ...]
    gate_one_rejected: bool | None
    repeats: bool
    log_evidence: tuple[float, float]
    standard: FloatArray

    @property
    def probability_clean(self) -> float:
        """That nothing of the vocabulary is missing."""
        return next((one.probability for one in self.ranking if one.name == "nothing"), 0.0)


def verdict_of(
    findings: tuple[EvidenceFinding, ...], nothing: float, joints: tuple[JointMisfit, ...]
) -> EvidenceVerdict:
    """What the parts of an answer come to, gate 1 apart: an arm that it rejects is not clean.

    Args:
        findings: of the best set.
        nothing: probability that nothing of the vocabulary is missing.
        joints: what stays unexplained.
    """
    if findings:
        if any(finding.named for finding in findings):
            return "named"
        return "not_confirmed" if any(finding.sure for finding in findings) else "unnamed"
    quiet = all(one.above <= 1.0 - SURE for one in joints)
    return "clean" if nothing >= SURE and quiet else "unnamed"


def parameters_of(
    placed: PlacedEffect, units: tuple[str, ...], theta: FloatArray, deviation: FloatArray
) -> tuple[FittedParameter, ...]:
    """Linear parameters with deviations, then shapes."""
    linear = [
        FittedParameter(one.name, float(value), float(sigma), one.unit, shape=False)
        for one, value, sigma in zip(placed.parameters, theta, deviation, strict=True)
    ]
    shapes = [
        FittedParameter(name, float(value), 0.0, unit, shape=True)
        for name, value, unit in zip(placed.shape_names, placed.shape, units, strict=True)
    ]
    return (*linear, *shapes)
