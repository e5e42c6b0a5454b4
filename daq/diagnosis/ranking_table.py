"""The ranking of a finding: every candidate that scored, with its bar and what it is to the named one."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from daq.diagnosis.diagnosis_words import spaced
from daq.text.numbers import significant
from ident.discrepancy import Candidate, Diagnosis, Finding
from ident.effects.vocabulary import family_named

_ALWAYS = 5
"""Candidates that are listed though none of them passes."""


@dataclass(frozen=True)
class RankRow:
    """One candidate: what, how likely it is, its bar, and whether it is in the set."""

    words: str
    score: str
    probability: str
    picture: Markup
    state: str


def ranking_rows(finding: Finding) -> tuple[RankRow, ...]:
    """Candidates with bars from zero to the best score; those that cannot be told apart are marked."""
    indistinguishable = {candidate.words() for candidate in finding.indistinguishable_from}
    shown = [c for c in finding.ranking if c.score > 0] or list(finding.ranking[:1])
    named = _named(finding, shown)
    best = max((c.score for c in shown), default=1.0) or 1.0
    rows = []
    for candidate in shown:
        words = candidate.words()
        state = "named" if words == named else "indistinguishable" if words in indistinguishable else "other"
        if state == "other" and _contains(candidate, finding):
            state = "general"
        width = max(0.0, min(100.0, 100.0 * candidate.score / best))
        bound = max(0.0, min(100.0, 100.0 * finding.threshold / best))
        picture = Markup(  # noqa: S704
            f'<svg class="bar {state}" aria-hidden="true"><rect y="4" height="10" width="{width:.1f}%"/>'
            f'<line x1="{bound:.1f}%" x2="{bound:.1f}%" y1="0" y2="18"/></svg>'
        )
        rows.append(
            RankRow(spaced(words), significant(candidate.score), probability_words(candidate), picture, state)
        )
    return tuple(rows)


def candidate_rows(diagnosis: Diagnosis) -> tuple[tuple[str, str, str], ...]:
    """What was tried beside the final model, best first: words, score, probability."""
    shown = [one for one in diagnosis.ranking if one.score > 0.0] or list(diagnosis.ranking[:_ALWAYS])
    return tuple((spaced(one.words()), significant(one.score), probability_words(one)) for one in shown)


def probability_words(candidate: Candidate) -> str:
    """In three decimals."""
    return f"{candidate.probability:.3f}"


def _contains(candidate: Candidate, finding: Finding) -> bool:
    """Whether the named effect is a limit of the candidate: friction that drifts may also not drift."""
    here = candidate.joints[-1:] == finding.joints[-1:]
    return here and finding.effect in family_named(candidate.effect).contains


def _named(finding: Finding, shown: list[Candidate]) -> str:
    for candidate in shown:
        if (candidate.effect, candidate.joints) == (finding.effect, finding.joints):
            return candidate.words()
    return ""
