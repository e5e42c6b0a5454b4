"""Every figure that the search by evidence goes by, halved and doubled: for each, a quick test has to fail.

``python -m benchmarks.mutants --search`` does it in a copy of the clone, after it has broken every rule of
``mutants_search_rules.py``, one at a time; ``mutants_nearest.py`` says which tests are run on each.
Of a share above a half what it lacks to one is halved in place of doubling it. A test holds this list to the
code and its words to the page, and is not among those that have to fail.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One constant of a module.

    Attributes:
        module: below ``ident/``, without its ending.
        name: of the constant.
        words: what the pages say of it, with its value.
    """

    module: str
    name: str
    words: str

    @property
    def path(self) -> str:
        return f"ident/{self.module}.py"


_BY = "discrepancy/by_evidence/"

FIGURES = (
    Figure(f"{_BY}evidence/prepared", "ROW_RATE", "125 rows a second"),
    Figure(f"{_BY}evidence/prepared", "_PASSED", "at most 0.4 of it"),
    Figure(f"{_BY}evidence/prepared", "_FINER", "samples per row for columns | two"),
    Figure(f"{_BY}evidence/prepared", "_EDGE", "five periods of the cut-off"),
    Figure(f"{_BY}evidence/prepared", "_FEWEST_ROWS", "50 rows"),
    Figure(f"{_BY}decide/free_law", "_SMOOTH", "1 of ln of the speed"),
    Figure(
        f"{_BY}decide/free_law",
        "_DIRECTIONS",
        "smooth over; directions | 0.003 of the limit; 1 of ln of the speed; 10",
    ),
    Figure(f"{_BY}evidence/slow", "_SLOW", "six half waves a recording"),
    Figure(f"{_BY}evidence/prepared", "_MINIMUM_SPEED", "1 % of the speed limit"),
    Figure(f"{_BY}decide/edges", "_STRETCH", "on 40 s"),
    Figure(f"{_BY}decide/cells", "_CELLS", "0.005 Hz apart by 40 cells"),
    Figure(f"{_BY}evidence/prepared", "_MARGIN", "80 ms"),
    Figure(f"{_BY}evidence/expected_motion", "_BANDS", "8 half octaves"),
    Figure(f"{_BY}evidence/expected_motion", "_ORDER", "8 half octaves; order 4"),
    Figure(f"{_BY}decide/soft_places", "_PASSED", "0.2 and 0.4 of the filter's cut-off"),
    Figure(f"{_BY}decide/soft_places", "_MOST", "up to three places"),
    Figure("effects/gear_state", "_FARTHEST", "farther than 1 rad"),
    Figure("effects/gear_state", "FORGOTTEN", "record's ends forgotten after | 3 s"),
    Figure(f"{_BY}evidence/known", "LAG", "50 µs"),
    Figure(f"{_BY}evidence/known", "LAG_OF_JOINT", "30 µs"),
    Figure(f"{_BY}evidence/known", "_SECOND", "10⁻⁷ s²"),
    Figure(f"{_BY}evidence/lag", "_FARTHEST", "3 ms or three samples"),
    Figure(f"{_BY}evidence/noise", "_ORDER", "order of ε; slow | 4"),
    Figure(f"{_BY}evidence/misfit", "_INNER", "0.5 to 99.5 %"),
    Figure(f"{_BY}evidence/misfit", "_WAVES", "half waves | 8 to 4 each; 0.5 to 99.5 %; three"),
    Figure(f"{_BY}evidence/misfit", "_SHARED", "0.1 of a column's mean square"),
    Figure(f"{_BY}evidence/misfit", "_SPLINES", "8 to 4 each"),
    Figure(f"{_BY}evidence/kappa", "_LOWEST", "a tenth of the accepted κ"),
    Figure(f"{_BY}evidence/kappa", "SPREAD", "Cauchy, width 1"),
    Figure(f"{_BY}decide/problem", "_OF_NOISE", "else half the noise"),
    Figure(f"{_BY}decide/problem", "_ROUNDS", "three rounds in turn"),
    Figure(f"{_BY}decide/state", "TEMPERATURE", "T | 0.5"),
    Figure(f"{_BY}decide/state", "ONE_MORE", "prior odds of one effect more | 0.2"),
    Figure(f"{_BY}decide/names", "HELD", "a name; an interval; a majority | 0.9; 95 %"),
    Figure(f"{_BY}decide/names", "SURE", "a name; an interval; a majority | 0.9"),
    Figure(f"{_BY}decide/elsewhere", "_DURATION", "motion all over the travel | 24 s"),
    Figure(f"{_BY}decide/elsewhere", "_OF_LIMITS", "motion all over the travel | 24 s; 0.9 of the limits"),
    Figure(f"{_BY}decide/elsewhere", "_ALLOWED", "a name; an interval; a majority | 0.9; 95 %"),
    Figure(f"{_BY}accepted", "RUN_TO_RUN", "0.2 % of each parameter"),
    Figure(f"{_BY}accepted", "_LEAST_MISFIT", "at least 0.3 noise"),
    Figure(f"{_BY}decide/no_name", "OUTSIDE", "of what an arm leaves | 0.1"),
    Figure(f"{_BY}decide/no_name", "_IMITATED", "0.1; 1; imitated 0.2"),
    Figure(f"{_BY}decide/no_name", "_FORM", "width 0.5; 3 %"),
    Figure(f"{_BY}decide/no_name", "_FORM_OF_ROUGH", "more at a joint 0.5; 30 %"),
    Figure(f"{_BY}decide/no_name", "_FORM_OF_FRICTION", "of friction 10 %"),
    Figure(f"{_BY}decide/no_name", "_USUAL", "imitated 0.2; width 0.5"),
    Figure(f"{_BY}decide/no_name", "_AT_A_JOINT", "width 0.5; 3 %; more at a joint 0.5"),
    Figure(f"{_BY}decide/no_name", "AS_NOT", "odds without a name; of what an arm leaves | 0.1; 1"),
    Figure(f"{_BY}decide/state", "OF_JOINT", "frictions of a joint | two"),
    Figure("discrepancy/existing_arm", "_LEAST", "a tenth of its own"),
    Figure(f"{_BY}decide/left_over", "ABOVE", "0.9; 95 %; 0.5"),
    Figure(f"{_BY}reversals", "_OF_BEST", "nats | 0.5"),
    Figure(f"{_BY}in_loop", "_MOST", "effects beside which reversals are not looked at | three"),
    Figure(f"{_BY}terms/chosen", "MOST", "two;"),
    Figure(f"{_BY}terms/stability", "_HALVES", "two; ten,"),
    Figure(f"{_BY}terms/stability", "STABLE", "of blocks of 1 s; eight"),
    Figure(f"{_BY}terms/stability", "_BLOCK", "ten, of blocks of 1 s"),
    Figure(f"{_BY}terms/stability", "_OTHERWISE", "0.3 of the torque"),
    Figure(f"{_BY}terms/propose", "_CLOSED", "closed | 0.5"),
    Figure(f"{_BY}power/smallest", "CHANCE", "80 % of recordings"),
    Figure("effects/scales", "_LEAST_FRICTION", "2 % of the rated torque"),
    Figure("effects/scales", "_PAYLOAD", "a tenth of the links' mass"),
    Figure("effects/scales", "_LEVER", "0.1 m out (25 kg)"),
    Figure("effects/scales", "_USUAL", "0.1 m out (25 kg)"),
    Figure("effects/scales", "_TYPICAL_SPEED", "0.3 of the speed limit"),
    Figure("discrepancy/presliding", "_NEAREST", "looked for within | 6 %"),
    Figure("effects/gear_load", "MEMORY", "memory of a load | 5 ms"),
    Figure(f"{_BY}evidence/law_columns", "_SHARES", "0.1 to 5 times"),
    Figure(f"{_BY}evidence/law_columns", "_WAYS", "0.1 and 1 mm"),
    Figure(f"{_BY}evidence/law_columns", "_SPEEDS", "0.5 to 32 mm/s"),
    Figure("discrepancy/unknown_feed_forward", "_ABOVE", "more than twice the power"),
    Figure("discrepancy/loop", "SETTLING", "settling of a simulated loop; a period | 1 s"),
    Figure("discrepancy/confirmation", "_FORM", "a row's change 10 %"),
    Figure(f"{_BY}taken", "_BY_CHANCE", "by chance one in twenty"),
    Figure("discrepancy/confirmation", "_STEPS", "0.01 of what it leaves"),
    Figure(f"{_BY}decide/scanned", "_FEW", "up to 12 in the motion"),
    Figure("discrepancy/confirmation", "_INTERVAL", "told from zero at 95 %"),
    Figure("discrepancy/accepted", "_INTERVAL", "told from its absence at 95 %"),
    Figure("discrepancy/deviations", "BLOCK", "of a change | 0.5 s; 1 s"),
    Figure("discrepancy/unexplained", "_INTERVAL", "at 95 %"),
    Figure("discrepancy/repeats", "_SHORTEST", "≥ 1 s"),
    Figure("discrepancy/onset", "SURE", "From 0.9 on"),
    Figure("discrepancy/onset", "ODDS", "0.1 each"),
    Figure("discrepancy/onset", "BLOCK", "blocks: of a share; of a change | 0.5 s; 1 s"),
    Figure("discrepancy/onset", "_THERE", "three deviations"),
)
"""Those that decide, each with its words on ``docs/explanation/naming.md``."""


def broken(text: str, name: str) -> Iterator[tuple[str, str]]:
    """A module's text with a constant halved, and with it doubled; what was done, in words, and the text.

    Raises:
        KeyError: the module has no such constant.
    """
    for number in (0, 1):
        tree = ast.parse(text)
        assigned = [one for one in tree.body if name in _targets(one)]
        if not assigned:
            raise KeyError(name)
        for node in ast.walk(assigned[0]):
            if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
                node.value = _changed(node.value)[number]
        yield ("halved", "doubled")[number], ast.unparse(tree)


def _targets(statement: ast.stmt) -> list[str]:
    """Names that a statement of a module assigns, several of them as a tuple, too."""
    if not isinstance(statement, ast.Assign):
        return []
    named = (node for target in statement.targets for node in ast.walk(target))
    return [node.id for node in named if isinstance(node, ast.Name)]


def _changed(value: float) -> tuple[float, float]:
    if isinstance(value, int):
        return max(value // 2, 1) if value > 1 else 0, 2 * value
    return 0.5 * value, 1.0 - 0.5 * (1.0 - value) if 0.5 < value < 1.0 else 2.0 * value
