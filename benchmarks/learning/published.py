"""What the search answered to drawn foreign logs while they were sealed, of ``benchmarks/evidence.md``.

Three sets of sixteen, each scored once by the code of its day. Logs after a refit are left out, since no
learner was taught that question.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

FIRST_RIGHT = (
    *(82402, 82404, 82406, 82502, 82505, 82506, 82507),
    *(83000, 83003, 83004, 83007, 83500, 83502, 83505, 83506, 83507),
    *(84001, 84002, 84003, 84004, 84005, 84007, 84500, 84501, 84502, 84505),
)
"""The first name is one that is hidden, at its place."""
FIRST_WRONG = (82400, 82401, 82405, 82500, 82504, 83001, 83006, 83501)
"""It is not, or there is none."""
NAMED_WRONG = (82401, 84004, 84007)
"""Of these one that is named is not there."""
CLEAN = {82403: False, 82407: False, 83005: True, 84006: True}
"""Nothing is hidden: whether it is called clean."""
OUTSIDE = (82503, 83504, 84000, 84503)
"""Something that the vocabulary lacks: not called clean and nothing named, of all of them."""
SEEDS = tuple(sorted((*FIRST_RIGHT, *FIRST_WRONG, *CLEAN, *OUTSIDE)))
CALLED_CLEAN = (83001,)
"""Changed arms of these that the search called clean."""
RECORDED_RIGHT = ("log_01", "log_02", "log_04", "log_05", "log_07", "log_08", "log_09", "log_10", "log_11")
"""Recorded logs with the right name first; 03 and 06 are called clean. Development of the search."""


def answered(kind: str, name: str, truth: Sequence[Any]) -> dict[str, Any] | None:
    """A published answer as a line of a report; without probabilities, which the pages do not give for all.

    Args:
        kind: of logs, ``foreign`` or ``shared``.
        name: of the log, a seed or ``log_01`` …
        truth: what is hidden, as the learners' lines have it.
    """
    if kind == "shared":
        right, wrong, clean = name in RECORDED_RIGHT, False, not truth
    elif kind == "foreign" and int(name) in SEEDS:
        seed = int(name)
        right, wrong = seed in FIRST_RIGHT, seed in NAMED_WRONG
        clean = seed in CALLED_CLEAN or CLEAN.get(seed, False)
    else:
        return None
    names = [_name(truth[0][0], truth[0][1], named=False)] if right else []
    names += [_name("another name", [], named=True)] if wrong else []
    answer = {"verdict": "clean" if clean else "other", "names": names}
    line = {"kind": kind, "name": name, "truth": truth, "search": "evidence", "answer": answer}
    return {**line, "published": True}


def _name(name: str, joints: Sequence[int], *, named: bool) -> dict[str, Any]:
    return {"name": name, "joints": list(joints), "probability": None, "named": named}
