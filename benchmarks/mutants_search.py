"""Every figure that the search by evidence goes by, halved and doubled: for each, a quick test has to fail.

``python -m benchmarks.mutants --search`` does it in a copy of the clone, and then breaks every rule of
``mutants_search_rules.py``, one at a time. Of a share above a half what it lacks to one is halved in place of
doubling it. A test holds this list to the code (not its words to the pages), and is not among those that have
to fail.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

_TESTS = "tests/ident/discrepancy/"
_EVIDENCE = f"{_TESTS}by_evidence/"


def of_evidence(*names: str) -> tuple[str, ...]:
    """Files of the evidence's tests."""
    return ("-m", "not slow", *(f"{_EVIDENCE}test_{name}.py" for name in names))


def of_search(*names: str) -> tuple[str, ...]:
    """Files of the tests that both searches share."""
    return ("-m", "not slow", *(f"{_TESTS}test_{name}.py" for name in names))


@dataclass(frozen=True)
class Figure:
    """One constant of a module.

    Attributes:
        module: below ``ident/``, without its ending.
        name: of the constant.
        words: what the pages say of it, with its value; of a numeric one what it is.
        tests: arguments of pytest; none where it is numeric: it changes the time or the last digits.
    """

    module: str
    name: str
    words: str
    tests: tuple[str, ...] = ()

    @property
    def path(self) -> str:
        return f"ident/{self.module}.py"


_BY = "discrepancy/by_evidence/"
_FIGURES = of_evidence("figures", "hyperparameters")
_ROWS = of_evidence("figures", "expected_motion", "hyperparameters", "repeated_motion")
_TERMS = of_evidence("figures", "terms")
_LOOP = of_search("loop")
_SHOWN = of_search("confirmation", "deviations", "onset", "residual_dependence")
_SCALES = ("tests/ident/effects/test_scales.py",)

FIGURES = (
    Figure(f"{_BY}evidence/prepared", "ROW_RATE", "125 rows a second", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_PASSED", "cut-off of at most 0.4 of that", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_FINER", "evaluated at two samples per row", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_EDGE", "five periods of the cut-off", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_FEWEST_ROWS", "at least 50 rows", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_SLOW", "six half waves a recording", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_MINIMUM_SPEED", "1 % of the speed limit", _ROWS),
    Figure(f"{_BY}evidence/prepared", "_MARGIN", "80 ms", _ROWS),
    Figure(f"{_BY}evidence/expected_motion", "_BANDS", "8 half octaves", _ROWS),
    Figure(f"{_BY}evidence/expected_motion", "_ORDER", "a low-pass of order 4", _ROWS),
    Figure(f"{_BY}evidence/expected_motion", "_REACH", "three periods of the lowest band", _ROWS),
    Figure(
        f"{_BY}evidence/repeated_motion",
        "_FORGOTTEN",
        "3 s before the beginning of a record is forgotten",
        _ROWS,
    ),
    Figure(f"{_BY}evidence/known", "LAG", "50 µs", _FIGURES),
    Figure(f"{_BY}evidence/known", "LAG_OF_JOINT", "30 µs", _FIGURES),
    Figure(f"{_BY}evidence/known", "_SECOND", "10⁻⁷ s²", _FIGURES),
    Figure(f"{_BY}evidence/lag", "_FARTHEST", "3 ms", of_evidence("figures")),
    Figure(f"{_BY}evidence/noise", "_ORDER", "autoregressive of order 4", _FIGURES),
    Figure(f"{_BY}evidence/misfit", "_INNER", "between the 0.5 and the 99.5 % quantile", _FIGURES),
    Figure(f"{_BY}evidence/misfit", "_WAVES", "three half waves over the recordings", _FIGURES),
    Figure(f"{_BY}evidence/misfit", "_SHARED", "0.1 of a column's mean square", _FIGURES),
    Figure(f"{_BY}evidence/misfit", "_SPLINES", "8, 8, 6, 6, 6, 6, 5, 5 and 4 splines", _FIGURES),
    Figure(f"{_BY}evidence/kappa", "_LOWEST", "from a tenth of the accepted κ", _FIGURES),
    Figure(f"{_BY}evidence/kappa", "SPREAD", "Cauchy, width 1", _FIGURES),
    Figure(f"{_BY}decide/problem", "_OF_NOISE", "else half the noise", _FIGURES),
    Figure(f"{_BY}decide/problem", "_ROUNDS", "three rounds in turn with κ", _FIGURES),
    Figure(f"{_BY}decide/state", "TEMPERATURE", "T | 0.5", _FIGURES),
    Figure(f"{_BY}decide/state", "ONE_MORE", "prior odds of one effect more | 0.2", _FIGURES),
    Figure(f"{_BY}decide/names", "HELD", "smallest set of names that holds 95 %", _FIGURES),
    Figure(f"{_BY}decide/names", "SURE", "probability for a name; interval | 0.9; 95 %", _FIGURES),
    Figure(f"{_BY}accepted", "SPREAD", "0.2 % of each parameter", _FIGURES),
    Figure(f"{_BY}accepted", "_LEAST_MISFIT", "at least 0.3 noise", _FIGURES),
    Figure(f"{_BY}confirm/held_out", "_DEVIATIONS", "not below the 95 % interval", _FIGURES),
    Figure(f"{_BY}workflow", "ABOVE", "with a probability of 0.5", of_evidence("figures", "loop_evidence")),
    Figure(
        f"{_BY}reversals", "_OF_BEST", "best of a grid has | 0.5", of_evidence("figures", "loop_evidence")
    ),
    Figure(f"{_BY}terms/propose", "MOST", "two at most", _TERMS),
    Figure(f"{_BY}terms/propose", "_HALVES", "Ten random halves", _TERMS),
    Figure(f"{_BY}terms/propose", "STABLE", "eight of them choose", _TERMS),
    Figure(f"{_BY}terms/propose", "_BLOCK", "in blocks of 1 s", _TERMS),
    Figure(
        f"{_BY}power/smallest", "CHANCE", "each in 80 % of recordings", of_evidence("figures", "smallest")
    ),
    Figure("effects/scales", "_LEAST_FRICTION", "2 % of the rated torque", _SCALES),
    Figure("effects/scales", "_PAYLOAD", "a tenth of the links' mass", _SCALES),
    Figure("effects/scales", "_LEVER", "0.1 m from the last frame of an arm of 25 kg", _SCALES),
    Figure("effects/scales", "_USUAL", "0.1 m from the last frame of an arm of 25 kg", _SCALES),
    Figure("effects/scales", "_TYPICAL_SPEED", "0.3 of the speed limit", _SCALES),
    Figure("discrepancy/presliding", "_NEAREST", "looked for within 6 %", _LOOP),
    Figure("discrepancy/loop", "SETTLING", "first second of a simulated loop", of_search("figures", "loop")),
    Figure("discrepancy/confirmation", "_INTERVAL", "told from zero at 95 %", _SHOWN),
    Figure("discrepancy/accepted", "_INTERVAL", "told from its absence at 95 %", _SHOWN),
    Figure(
        "discrepancy/deviations",
        "BLOCK",
        "blocks of 0.5 s",
        of_search("deviations", "confirmation", "figures"),
    ),
    Figure("discrepancy/unexplained", "_INTERVAL", "(5 %), at 95 %", of_search("confirmation", "figures")),
    Figure(
        "discrepancy/repeats", "_SHORTEST", "repeats after a second or more", of_search("repeats", "figures")
    ),
    Figure("discrepancy/onset", "SURE", "From a probability of 0.9 on", of_search("onset", "figures")),
    Figure("discrepancy/onset", "ODDS", "prior odds 0.1 each", of_search("onset", "figures")),
    Figure(
        "discrepancy/onset", "BLOCK", "blocks of 1 s that a score deviates by", of_search("onset", "figures")
    ),
    Figure("discrepancy/onset", "_THERE", "three deviations from none", of_search("onset", "figures")),
)
"""Those that decide, each with its words on ``docs/explanation/evidence.md`` or ``naming.md``."""


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
