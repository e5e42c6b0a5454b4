"""Per joint what stays unexplained on data that was not fitted, worst first, on page and terminal."""

from __future__ import annotations

from dataclasses import dataclass

from daq.diagnosis.diagnosis_words import spaced
from daq.text.numbers import percent
from ident.discrepancy import Diagnosis


@dataclass(frozen=True)
class UnexplainedRow:
    """One joint: its whole error, noise and the rest as shares of its torque, and what comes nearest."""

    joint: str
    error: str
    noise: str
    unexplained: str
    nearest: str


def unexplained_rows(diagnosis: Diagnosis, joints: list[str]) -> tuple[UnexplainedRow, ...]:
    """Worst joint first.

    Args:
        diagnosis: of the search.
        joints: headings, in the order of the arm.
    """
    rows = []
    for one in diagnosis.unexplained:
        nearest = diagnosis.nearest(one.joint)
        rows.append(
            UnexplainedRow(
                joints[one.joint],
                percent(100.0 * one.error),
                percent(100.0 * one.noise),
                percent(100.0 * one.share),
                "none" if nearest is None else spaced(nearest.effect),
            )
        )
    return tuple(rows)


_NOT_REPEATED = (
    "Nothing repeats in these recordings, so noise is only what differs from row to row: what is slower"
    " cannot be told from a missing effect, and a small effect cannot be told from noise. Two periods of"
    " one motion would settle both."
)


def unexplained_remarks(diagnosis: Diagnosis) -> str:
    """The diagnosis' notes, and what it costs that nothing repeats; empty where there is nothing to say."""
    remarks = [f"{note[0].upper()}{note[1:]}." for note in diagnosis.notes]
    if not all(one.repeats for one in diagnosis.unexplained):
        remarks.append(_NOT_REPEATED)
    return " ".join(remarks)
