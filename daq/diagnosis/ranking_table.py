"""The ranking of a finding: every candidate that scored, with its bar and what it is to the named one."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from daq.diagnosis.diagnosis_words import share_words, spaced
from daq.diagnosis.scored_families import scored_family
from daq.text.numbers import significant
from ident.discrepancy import Candidate, Diagnosis, Finding

_ALWAYS = 5
"""Candidates that are listed though none of them passes."""


@dataclass(frozen=True)
class RankRow:
    """One candidate: what, how much it explains, its bar, and whether it is in the set."""

    words: str
    score: str
    explained: str
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
            RankRow(spaced(words), significant(candidate.score), explained_words(candidate), picture, state)
        )
    return tuple(rows)


def candidate_rows(diagnosis: Diagnosis) -> tuple[tuple[str, str, str], ...]:
    """What was tried beside the final model, best first: words, score, share that it explains."""
    shown = [one for one in diagnosis.ranking if one.score > 0.0] or list(diagnosis.ranking[:_ALWAYS])
    return tuple((spaced(one.words()), significant(one.score), explained_words(one)) for one in shown)


def explained_words(candidate: Candidate) -> str:
    """What it explains, or its probability where that is what the search gives."""
    if candidate.probability is not None:
        return f"probability {candidate.probability:.3f}"
    return share_words(candidate.explained)


def _contains(candidate: Candidate, finding: Finding) -> bool:
    """Whether the named effect is a limit of the candidate: friction that drifts may also not drift."""
    if len(candidate.effects) > 1 or candidate.joints[0][-1:] != finding.joints[-1:]:
        return False
    return finding.effect in scored_family(candidate.effects[0]).contains


def _named(finding: Finding, shown: list[Candidate]) -> str:
    for candidate in shown:
        if candidate.effects == (finding.effect,) and candidate.joints == (finding.joints,):
            return candidate.words()
    return ""
