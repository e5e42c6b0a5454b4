"""What the search by evidence says of its names, on the terminal."""

from __future__ import annotations

from math import isfinite

from rich.console import Console

from daq.text.wrapped import Column, write, write_table
from ident.discrepancy.by_evidence import EvidenceAnswer, EvidenceFinding
from ident.discrepancy.by_evidence.decide.names import NOTHING, Named
from ident.effects.entry import joint_words

_RANKED = 5


def print_evidence(console: Console, answer: EvidenceAnswer) -> None:
    """What is behind the names, for who asks: the evidence of each, and the ranking of the first effect.

    The name, its probability and whether the motion repeats stand in the diagnosis already.
    """
    for number, finding in enumerate(answer.findings, start=1):
        seen = finding.confirmation
        write(
            console,
            f"- Evidence of finding {number}: on recordings that were not fitted {seen.observed:.0f} nats,"
            f" predicted {seen.predicted:.0f} ± {seen.deviation:.0f}.{_others(finding)}",
            indent="  ",
        )
    columns = [Column("effect", right=False, wraps=True), Column("probability")]
    columns += [Column("would be named from", right=False)]
    rows = [[_words(one), f"{one.probability:.3f}", _from(answer, one)] for one in answer.ranking[:_RANKED]]
    write_table(console, "Names for the first effect, by evidence", columns, rows)


def _others(finding: EvidenceFinding) -> str:
    """The set that holds 95 %, where it has more than one name."""
    if len(finding.set) == 1:
        return ""
    names = ", ".join(f"{_words(one)} {one.probability:.2f}" for one in finding.set)
    return f" 95 % are held by: {names}."


def _words(one: Named) -> str:
    if one.key == NOTHING:
        return "nothing"
    return f"{one.name.replace('_', ' ')} ({joint_words(tuple(joint + 1 for joint in one.joints))})"


def _from(answer: EvidenceAnswer, name: Named) -> str:
    """The size from which on a name that was not found would have been, in words."""
    joints = tuple(joint + 1 for joint in name.joints)
    for one in answer.nameable:
        if (one.name, one.joints) == (name.name, joints) and isfinite(one.size):
            return f"{one.parameter} {one.size:.2g}" + (f" {one.unit}" if one.unit != "1" else "")
    return ""
