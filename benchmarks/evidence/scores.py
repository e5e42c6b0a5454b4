"""Scores of answers: right, wrong, missed, clean; and whether probabilities mean what they say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.evidence.case import UNKNOWN
from ident.discrepancy.by_evidence.decide.names import NOTHING
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from robots.arrays import FloatArray

Line = dict[str, Any]
Answer = dict[str, Any]

SEARCH = "evidence"
"""In lines of answers; those of before have another search, too."""


def report(lines: Sequence[Line]) -> str:
    """A table with a column per search, the calibration, and one line per log."""
    known = [line for line in lines if line["truth"] is not None]
    hidden = [line for line in known if line["truth"]]
    with_name = [line for line in hidden if any(one[0] != UNKNOWN for one in line["truth"])]
    clean = [line for line in known if not line["truth"]]
    # Of a real arm one thing is known to be missing, and never that nothing else is.
    foreign = [line for line in known if line["kind"] == "foreign"]
    drawn = [line for line in known if line["kind"] != "real"]
    whole = [line for line in drawn if line["truth"]]
    figures: list[tuple[str, Sequence[Line], Callable[[Line, Answer], bool]]] = [
        ("right name and joint first, of what the vocabulary has", with_name, first_is_right),
        ("every hidden effect named, and nothing else", whole, all_right),
        ("a name that is not hidden", drawn, wrong),
        ("a name that is not hidden, named or not", drawn, shown_wrong),
        ("clean arm with a finding", clean, lambda line, answer: bool(answer["names"])),
        ("clean arm called clean", clean, lambda line, answer: answer["verdict"] == "clean"),
        ("changed arm called clean", hidden, lambda line, answer: answer["verdict"] == "clean"),
    ]
    searches = list(dict.fromkeys(search for line in lines for search in line["answers"]))
    head = ["| figure | " + " | ".join(searches) + " |", "|---|" + "---|" * len(searches)]
    rows = [f"| {title} | {_cells(part, test, searches)} |" for title, part, test in figures]
    own = [line for line in known if line["kind"] == "own"]
    kinds = [f"{title}: {calibration(part)}" for title, part in (("foreign", foreign), ("own", own)) if part]
    return "\n".join([*head, *rows, "", *kinds, "", *(f"{_short(line)}" for line in lines)])


def _cells(lines: Sequence[Line], test: Callable[[Line, Answer], bool], searches: Sequence[str]) -> str:
    cells = []
    for search in searches:
        asked = [line for line in lines if search in line["answers"]]
        hits = sum(test(line, line["answers"][search]) for line in asked)
        cells.append(f"{hits} of {len(asked)}")
    return " | ".join(cells)


def same(truth: Sequence[Any], name: str, joints: Sequence[int]) -> bool:
    """Whether a name at joints is a hidden one; a pair of joints counts where it holds the joint."""
    return bool(truth[0] == name and (not truth[1] or not joints or set(joints) & set(truth[1])))


def first_is_right(line: Line, answer: Answer) -> bool:
    """Whether the first name is a hidden one, whether or not it is confirmed."""
    first = answer["names"][:1]
    return any(same(one, first[0]["name"], first[0]["joints"]) for one in line["truth"] if first)


def all_right(line: Line, answer: Answer) -> bool:
    named = [one for one in answer["names"] if one["named"]]
    found = all(any(same(one, n["name"], n["joints"]) for n in named) for one in line["truth"])
    return found and not wrong(line, answer)


def wrong(line: Line, answer: Answer) -> bool:
    return _not_hidden(line, [one for one in answer["names"] if one["named"]])


def shown_wrong(line: Line, answer: Answer) -> bool:
    return _not_hidden(line, answer["names"])


def _not_hidden(line: Line, names: Sequence[dict[str, Any]]) -> bool:
    return any(not any(same(one, n["name"], n["joints"]) for one in line["truth"]) for n in names)


@dataclass(frozen=True)
class Shown:
    """One name that was shown.

    Attributes:
        probability: that it says.
        right: whether it is hidden there.
        held: whether its 95 % set holds what is there.
        size: of that set.
    """

    probability: float
    right: bool
    held: bool
    size: int


def findings_of(line: Line) -> list[Shown]:
    """Names that the evidence showed of one log."""
    names, found = line["answers"].get(SEARCH, {"names": []})["names"], []
    for number, name in enumerate(names):
        right = any(same(one, name["name"], name["joints"]) for one in line["truth"])
        others = [other for k, other in enumerate(names) if k != number]
        held = holds_the_truth(line["truth"], name["set"], others)
        found.append(Shown(name["probability"], right, held, len(name["set"])))
    return found


def calibration(lines: Sequence[Line]) -> str:
    """Expected calibration error of the names' probabilities, coverage and mean size of the 95 % sets."""
    found = [one for line in lines for one in findings_of(line)]
    if not found:
        return "no names of the evidence to calibrate"
    said = np.array([one.probability for one in found])
    error = calibration_error(said, np.array([one.right for one in found], dtype=np.float64))
    held, size = np.mean([one.held for one in found]), np.mean([one.size for one in found])
    return (
        f"evidence: {len(found)} names, expected calibration error {error:.3f};"
        f" 95 % sets hold the truth in {held:.0%}, mean size {size:.2f}"
    )


def calibration_error(probability: FloatArray, right: FloatArray) -> float:
    """Expected calibration error over tenths of what is said.

    Args:
        probability: (N,) said.
        right: (N,) 1 where it came true.
    """
    bins = np.minimum((10 * probability).astype(int), 9)
    gaps = [abs(float(np.sum((probability - right)[bins == one]))) for one in np.unique(bins)]
    return sum(gaps) / probability.size


def holds_the_truth(
    truth: Sequence[Any], said: Sequence[Sequence[Any]], others: Sequence[dict[str, Any]]
) -> bool:
    """Whether a set for one place holds what is there: what is hidden and no other finding has, or nothing.

    Args:
        truth: what is hidden.
        said: the set: names, joints, probabilities.
        others: the other findings.
    """
    left = [one for one in truth if not any(same(one, other["name"], other["joints"]) for other in others)]
    if not left:
        return any(name == NOTHING[0] for name, *_ in said)
    return any(_is(one, name, joints) for one in left for name, joints, *_ in said)


def _is(truth: Sequence[Any], name: str, joints: Sequence[int]) -> bool:
    return same((NO_NAME, truth[1]) if truth[0] == UNKNOWN else truth, name, joints)


def _short(line: Line) -> str:
    parts = [f"{line['name']}: hidden {line['truth']}"]
    for search, answer in line["answers"].items():
        names = "; ".join(
            f"{n['name']} {n['joints']} {n['probability']:.2f}{'' if n['named'] else ' (not named)'}"
            for n in answer["names"]
        )
        parts.append(
            f"  {search}: {answer['verdict']}: {names or 'no name'} ({answer['processor_seconds']} s)"
        )
    return "\n".join(parts)
