"""The diagnosis in words, the same on the terminal and on the page."""

from __future__ import annotations

from daq.diagnosis.settled_by import settled_by
from daq.text.numbers import percent
from ident.discrepancy import Diagnosis, Finding
from ident.discrepancy.before_after import ModelCheck
from ident.effects.entry import joint_words
from ident.verdicts import ColumnCheck, Gate
from robots import Joint


def headline(diagnosis: Diagnosis) -> str:
    """One sentence that says what was found."""
    found = diagnosis.findings
    if diagnosis.verdict == "clean":
        return "Nothing is missing that this data can show"
    if diagnosis.verdict == "unnamed":
        return "Something is missing, and nothing in the vocabulary is it"
    if diagnosis.verdict == "not_confirmed":
        names = ", ".join(dict.fromkeys(spaced(finding.effect) for finding in found))
        return f"Something is missing that looks like {names}; data that was not fitted does not confirm it"
    words = "; ".join(_short(finding) for finding in found)
    return sentence_of(f"{words}{explained_words(diagnosis)}")


def sentence_of(words: str) -> str:
    """With a capital letter, and minus signs that are some."""
    return f"{words[0].upper()}{words[1:]}".replace(" -", " −")


def spaced(words: str) -> str:
    """Names of effects as words."""
    return words.replace("_", " ")


def _short(finding: Finding) -> str:
    """The finding as a sentence; many parameters are left to the tables."""
    return finding.words() if len(finding.parameters) <= _FEW else finding.words().split(" (")[0]


_FEW = 2
"""Parameters that a headline holds."""


def explained_words(diagnosis: Diagnosis) -> str:
    """How far the explained share of the gap went, as the end of a sentence; empty without a gap."""
    share = diagnosis.torque.closed
    if share is None:
        return ""
    return (
        f"; adding it closes {100 * share:.0f} % of the explainable gap (energy) on data that was not fitted"
    )


def recommendation(diagnosis: Diagnosis) -> str:
    """What to do about it."""
    if diagnosis.verdict == "clean":
        return "The model and the measurement agree down to what does not repeat. Use the model."
    if diagnosis.verdict == "unnamed":
        return f"What is left: {diagnosis.description}. Look there on the arm before trusting the model."
    if diagnosis.verdict == "not_confirmed":
        reasons = "; ".join(
            f"{spaced(finding.effect)} at {joint_words(finding.joints)}: {finding.confirmation.reason}"
            for finding in diagnosis.findings
            if not finding.confirmation.passed
        )
        return f"Not confirmed: {reasons}. Do not use the model that has it."
    undecided = [finding for finding in diagnosis.findings if finding.indistinguishable_from]
    if undecided:
        return " ".join(_cannot_tell(finding) for finding in undecided)
    return (
        "The new model file has the effect: armhil identify --model and diagnose --prior go on with it, and"
        " so do checks once it is the baseline."
    )


def confirmed_words(finding: Finding) -> str:
    """Whether data that was not fitted shows what the finding adds."""
    found = finding.confirmation
    if not found.passed:
        return f"not confirmed: {found.reason}"
    share = f"{100.0 * found.torque.share:.0f} ± {100.0 * found.torque.sigma:.0f} %"
    return f"confirmed: of the torque that it adds, data that was not fitted shows {share}"


def sure_words(finding: Finding) -> str:
    """How sure a name is, and what else is possible at 95 %."""
    own = (finding.effect, finding.joints)
    others = [spaced(one.words()) for one in finding.held if (one.name, one.joints) != own]
    return f"probability {finding.probability:.2f}" + (f", else {', '.join(others)}" if others else "")


def _cannot_tell(finding: Finding) -> str:
    others = ", ".join(spaced(candidate.words()) for candidate in finding.indistinguishable_from[:5])
    more = len(finding.indistinguishable_from) - 5
    rest = f" and {more} more" if more > 0 else ""
    first = finding.indistinguishable_from[0]
    return (
        f"This data cannot tell {spaced(finding.effect)} from {others}{rest}."
        " Drive the discriminating trajectory, if there is one, or settle it without:"
        f" {settled_by((finding.effect, first.effect))}."
    )


def gate_words(before: ModelCheck, after: ModelCheck) -> str:
    """How gate 1 of the revised DWH-test goes as an effect is added, one sentence."""
    if before.gate is None or after.gate is None:
        return f"cannot be run: {before.reason or after.reason}"
    worst = worst_check(before.gate)
    then = next((check for check in after.gate.columns if check.column == worst.column), worst)
    what = f"regressor {worst.column}" if worst.kind == "regressor" else worst.column
    return (
        f"{_passed(before.gate)} → {_passed(after.gate)}; what the simulation lacks of the {what} goes from"
        f" {percent(100 * worst.size)} to {percent(100 * then.size)} (margin {percent(100 * worst.limit)})"
    )


def worst_check(gate: Gate) -> ColumnCheck:
    """What is nearest to its margin, or furthest beyond it: those that failed first."""
    return max(gate.columns, key=lambda check: (not check.passed, check.size / check.limit))


def gate_state(check: ModelCheck) -> str:
    """``rejected``, ``accepted`` or ``not run``."""
    return "not run" if check.gate is None else _passed(check.gate)


def _passed(gate: Gate) -> str:
    return "accepted" if gate.passed else "rejected"


def unit_of_quantity(quantity: str, joint: Joint) -> str:
    """SI unit of what a residual of a joint is drawn against."""
    angle = joint.unit
    return {
        "position": angle,
        "speed": f"{angle}/s",
        "acceleration": f"{angle}/s²",
        "torque": joint.torque_unit,
        "time": "s",
    }[quantity]
