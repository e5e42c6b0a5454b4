"""What the search answered to drawn foreign logs while they were sealed, of ``benchmarks/evidence.md``.

Three sets of sixteen, each scored once by the code of its day. Logs after a refit are left out, since no
learner was taught that question.
"""

from __future__ import annotations

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
