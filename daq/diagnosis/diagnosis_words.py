"""The diagnosis in words, the same on the terminal and on the page."""

from __future__ import annotations

import numpy as np

from ident.discrepancy import Diagnosis, Finding, Gap


def headline(diagnosis: Diagnosis) -> str:
    """One sentence that says what was found."""
    found = diagnosis.findings
    if diagnosis.verdict == "clean":
        return "Nothing is missing that this data can show"
    if diagnosis.verdict == "unnamed":
        return "Something is missing, and nothing in the vocabulary is it"
    words = "; ".join(finding.words() for finding in found)
    closed = explained_words(diagnosis)
    return f"{words[0].upper()}{words[1:]}{closed}"


def explained_words(diagnosis: Diagnosis) -> str:
    """How far the explained share of the gap went, as the end of a sentence; empty without a gap."""
    share = closed_share(diagnosis.torque)
    if share is None:
        return ""
    return f"; adding it closes {100 * share:.0f} % of the explainable gap on data that was not fitted"


def closed_share(gap: Gap) -> float | None:
    """Share of the explainable gap that is closed, over all joints in units of their floors."""
    before, after = gap.explainable(gap.before), gap.explainable(gap.after)
    unit = np.where(np.isfinite(gap.floor) & (gap.floor > 0), gap.floor, 1.0)
    whole = float(np.sqrt(np.sum((before / unit) ** 2)))
    return None if whole == 0.0 else 1.0 - float(np.sqrt(np.sum((after / unit) ** 2))) / whole


def recommendation(diagnosis: Diagnosis) -> str:
    """What to do about it."""
    if diagnosis.verdict == "clean":
        return "The model and the measurement agree down to what does not repeat. Use the model."
    if diagnosis.verdict == "unnamed":
        return f"What is left: {diagnosis.description}. Look there on the arm before trusting the model."
    alike = [finding for finding in diagnosis.findings if finding.indistinguishable_from]
    if alike:
        return " ".join(_cannot_tell(finding) for finding in alike)
    return "The new model file has the effect; simulation, identification and the next check use it."


def _cannot_tell(finding: Finding) -> str:
    others = ", ".join(candidate.words() for candidate in finding.indistinguishable_from[:5])
    more = len(finding.indistinguishable_from) - 5
    rest = f" and {more} more" if more > 0 else ""
    return (
        f"This data cannot tell {finding.effect.replace('_', ' ')} from {others}{rest}."
        " The discriminating trajectory would."
    )


def unit_of_quantity(quantity: str, kind: str) -> str:
    """SI unit of what a residual is drawn against."""
    angle = "m" if kind == "prismatic" else "rad"
    torque = "N" if kind == "prismatic" else "N·m"
    return {
        "position": angle,
        "speed": f"{angle}/s",
        "acceleration": f"{angle}/s²",
        "torque": torque,
        "time": "s",
    }[quantity]
