"""The verdict of a search: what may be called named, and what may be called clean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ident.discrepancy.residual_dependence import ResidualDependence
from ident.discrepancy.results import Candidate, Diagnosis, DiagnosisVerdict, Finding
from ident.discrepancy.unexplained import Unexplained
from ident.discrepancy.unrepeated import Unrepeated
from ident.effects.vocabulary import family_named
from ident.verdicts import Gate
from robots.arrays import FloatArray

_INTERVAL = 1.959964
"""Standard deviations to either side of a 95 % interval."""

_MAJORITY = 0.5
"""Probability from which on a name is likelier than all else."""


@dataclass(frozen=True)
class Left:
    """What the final model leaves.

    Attributes:
        dependences: what the residual of the fit depends on, per joint.
        unrepeated: what does not repeat and should not be there.
        unnamed: what the residual is, where an unnamed family explains it.
        more_than_noise: whether it is more than noise and the usual misfit.
        unexplained: per joint, of the torque on data that was not fitted, worst first.
        margin: share of a joint's torque that a model may lack, as in gate 1.
    """

    dependences: tuple[ResidualDependence, ...]
    unrepeated: tuple[Unrepeated, ...]
    unnamed: str
    more_than_noise: bool
    unexplained: tuple[Unexplained, ...]
    margin: float

    @property
    def beyond_margin(self) -> tuple[Unexplained, ...]:
        """Joints of whose torque the model lacks more than the margin, at 95 %."""
        return tuple(one for one in self.unexplained if one.least > self.margin)


def verdict_of(findings: Sequence[Finding], left: Left) -> DiagnosisVerdict:
    """A name that the data that was not fitted contradicts is none; a model that leaves much is not clean."""
    if any(not finding.confirmation.passed for finding in findings):
        return "not_confirmed"
    if any(finding.indistinguishable_from for finding in findings):
        return "ambiguous"
    if findings:
        return "named"
    something = left.more_than_noise or left.unrepeated or left.unnamed or left.beyond_margin
    return "unnamed" if something else "clean"


def lags_of_noise(
    findings: Sequence[Finding],
    usual: bool,
    unexplained: Sequence[Unexplained],
    changes: FloatArray,
    margin: float,
) -> bool:
    """Whether what was found where nothing repeats goes again: lags that noise has made, nothing left.

    An encoder's noise that the loop passes on then looks like a delay of microseconds, on every recording of
    a clean arm. So the rows that are fitted show such a lag, which other data do not confirm, and it explains
    no more than noise: of rows y = s r + n noise makes a lag of rᵀn/rᵀr, whose torque is not above that of n
    (Cauchy and Schwarz). A lag that the fit makes nothing of was found for another reason. A model that
    leaves more than an accepted one keeps its findings, not confirmed.

    Args:
        findings: with what the data that was not fitted shows of them.
        usual: whether on the rows that were fitted no more is left than by an accepted model.
        unexplained: by the model before, per joint, on data that was not fitted.
        changes: (n,) of each joint's torque there, what the findings change.
        margin: share of a joint's torque that a model may lack.
    """
    lags = all(family_named(finding.effect).taken_by_alignment for finding in findings)
    confirmed = any(finding.confirmation.passed for finding in findings)
    linear = [one for finding in findings for one in finding.parameters if not one.shape]
    fitted = all(abs(one.value) > _INTERVAL * one.sigma for one in linear)
    small = all(one.least <= margin and changes[one.joint] <= one.noise for one in unexplained)
    return bool(findings) and lags and fitted and not confirmed and usual and small


def description(verdict: DiagnosisVerdict, left: Left, ranking: Sequence[Candidate]) -> str:
    """What is left, in words, where it has no name; the likeliest one, where it is likelier than all else."""
    if verdict != "unnamed":
        return ""
    if left.unnamed:
        return left.unnamed
    if left.unrepeated:
        return "; ".join(item.sentence for item in left.unrepeated)
    if left.beyond_margin and not left.more_than_noise:
        joints = ", ".join(f"{100 * one.share:.0f} % of joint {one.joint + 1}" for one in left.beyond_margin)
        return (
            f"of the torque on data that was not fitted the model leaves {joints} unexplained"
            f" (margin {100 * left.margin:.0f} %), and no effect of the vocabulary passes"
        )
    worst = max(left.dependences, key=lambda place: place.strongest[1] * place.rms)
    first = next((one for one in ranking if one.probability > _MAJORITY), None)
    if first is None:
        return f"the residual follows no effect of the vocabulary; {worst.sentence()}"
    name = first.words().replace("_", " ")
    return (
        f"it may be {name}, probability {first.probability:.2f}, which is too little for a name;"
        f" {worst.sentence()}"
    )


def loop_does_otherwise(joint: int) -> str:
    """What the residual is of an arm that is simulated wrong, though nothing has a name; joint from 0."""
    return (
        "the simulated closed loop does not do what the arm does at its reversals, least of all at"
        f" joint {joint + 1}, though the model fits the moving arm"
    )


def beside_gate(diagnosis: Diagnosis, gate: Gate | None) -> Diagnosis:
    """The diagnosis beside gate 1 of the final model: what it rejects is not clean.

    Args:
        diagnosis: of the search.
        gate: on the validation recordings; None where it cannot be run.
    """
    if diagnosis.verdict != "clean" or gate is None or gate.passed:
        return diagnosis
    failed = [check for check in gate.columns if not check.passed]
    worst = max(failed, key=lambda check: check.size / check.limit)
    words = (
        f"gate 1 of the revised test rejects the simulated arm ({worst.column}: {100 * worst.size:.3g} %,"
        f" margin {100 * worst.limit:.3g} %), and no effect of the vocabulary passes"
    )
    return replace(diagnosis, verdict="unnamed", description=words)
