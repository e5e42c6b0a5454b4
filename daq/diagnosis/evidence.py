"""``armhil diagnose --search evidence|both``: the search by evidence, beside the one by rules."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.diagnosis.diagnose import DiagnoseRequest, question_of
from daq.diagnosis.term_words import term_words
from daq.text.progress import Steps
from ident.discrepancy.by_evidence import EvidenceAnswer, diagnose_by_evidence
from ident.discrepancy.by_evidence.decide.names import Named
from ident.discrepancy.by_evidence.report.as_json import answer_json
from ident.discrepancy.by_evidence.terms.asked import proposed_terms
from ident.effects.entry import joint_words

__all__ = ["answer_json", "print_evidence", "run_by_evidence"]

_COLOURS = {"clean": "green", "named": "cyan", "not_confirmed": "yellow", "unnamed": "red"}
_RANKED = 5


def run_by_evidence(request: DiagnoseRequest, steps: Steps) -> EvidenceAnswer:
    """Read and search; nothing is written.

    Raises:
        CaptureError, RobotFileError, ModelFileError, IdentificationError: one line each.
    """
    with question_of(request, steps) as question, steps.step("Search by evidence") as update:
        answer = diagnose_by_evidence(question, lambda step, share: update(share, step))
        if answer.verdict != "unnamed":
            return answer
        update(0.97, "terms")
        return replace(answer, terms=proposed_terms(question))


def print_evidence(console: Console, answer: EvidenceAnswer) -> None:
    """Findings with their probabilities, the ranking, and each joint, worst first."""
    console.print("\n[bold]By evidence[/]", highlight=False)
    for finding in answer.findings:
        console.print(finding.words(), highlight=False, markup=False)
        seen = finding.confirmation
        console.print(
            f"  on recordings that were not fitted: {seen.observed:.0f} nats,"
            f" predicted {seen.predicted:.0f} ± {seen.deviation:.0f}",
            highlight=False,
            markup=False,
        )
    console.print(_ranking(answer))
    console.print(_joints(answer))
    for term in answer.terms:
        console.print(term_words(term), highlight=False, markup=False)
    if not answer.repeats:
        console.print("The motion does not repeat: noise is told from misfit by its course in time alone.")
    if answer.gate_one_rejected:
        console.print("Gate 1 rejects: the simulated arm is not the real one.")
    colour, words = _COLOURS[answer.verdict], answer.verdict.replace("_", " ").upper()
    console.print(
        f"[bold {colour}]{words}[/]   probability that nothing is missing: {answer.probability_clean:.2f}",
        highlight=False,
    )


def _ranking(answer: EvidenceAnswer) -> Table:
    columns = ("Effect", "Where", "Probability", "Would be named from")
    table = Table(*columns, title="Names for the first effect", box=SIMPLE_HEAD)
    for one in answer.ranking[:_RANKED]:
        joints = tuple(joint + 1 for joint in one.joints)
        place = "" if one.name == "nothing" else joint_words(joints)
        table.add_row(one.name.replace("_", " "), place, f"{one.probability:.3f}", _from(answer, one, joints))
    return table


def _from(answer: EvidenceAnswer, name: Named, joints: tuple[int, ...]) -> str:
    """The size from which on a name that was not found would have been, in words."""
    for one in answer.nameable:
        if (one.name, one.joints) == (name.name, joints) and isfinite(one.size):
            return f"{one.parameter} {one.size:.2g}" + (f" {one.unit}" if one.unit != "1" else "")
    return ""


def _joints(answer: EvidenceAnswer) -> Table:
    title = "Torque that stays unexplained on recordings that were not fitted"
    columns = ("Joint", "Before", "After", "Misfit", "Accepted", "Nearest name")
    table = Table(*columns, title=title, box=SIMPLE_HEAD)
    for one in answer.joints:
        cells = (f"{one.before:.1%}", f"{one.after:.1%}", f"{one.kappa:.3g}", f"{one.accepted:.3g}")
        near = one.nearest
        name = "" if near is None else f"{near.name.replace('_', ' ')}, {near.probability:.2f}"
        table.add_row(str(one.joint), *cells, name)
    return table
