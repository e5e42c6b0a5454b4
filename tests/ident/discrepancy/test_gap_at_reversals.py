"""Whether recordings that do not repeat show what was found at reversals: by the simulated positions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from ident.discrepancy import step, validation
from ident.discrepancy.confirmation import Shown
from ident.discrepancy.step import LoopStep, Step
from ident.discrepancy.validation import Validation

ROWS, LOOP, POSITIONS = Shown(-6.2, 0.26), Shown(0.9, 0.1), Shown(1.03, 0.05)
MODEL: Any = SimpleNamespace(base=None, shown=None, prior=None)


def in_loop(monkeypatch: pytest.MonkeyPatch, repeats: bool) -> LoopStep:
    found = ("gap of the loop", LOOP) if repeats else None
    monkeypatch.setattr(step, "loop_gap", lambda *given: found)
    monkeypatch.setattr(Step, "gap_from", lambda *given: ("gap of rows", ROWS))
    one = object.__new__(LoopStep)
    examination = SimpleNamespace(loop=SimpleNamespace(standstill=None))
    for name, value in (("examination", examination), ("base", None), ("shown", None)):
        object.__setattr__(one, name, value)
    return one


@pytest.mark.parametrize(("repeats", "said"), [(True, LOOP), (False, None)])
def test_rows_of_the_moving_arm_say_nothing_of_reversals(
    monkeypatch: pytest.MonkeyPatch, repeats: bool, said: Shown | None
) -> None:
    gap, shown = in_loop(monkeypatch, repeats).gap_from(MODEL, (), None)  # type: ignore[arg-type]
    assert shown == said
    assert str(gap) == ("gap of the loop" if repeats else "gap of rows")


@pytest.mark.parametrize("simulated", [POSITIONS, None])
def test_the_simulated_positions_say_it_instead(
    monkeypatch: pytest.MonkeyPatch, simulated: Shown | None
) -> None:
    """A static friction was in the positions with 103 ± 5 % and in the rows with −620 ± 30 %: refuted."""
    monkeypatch.setattr(validation, "Finding", lambda **given: given["confirmation"])
    monkeypatch.setattr(validation, "_parameters", lambda accepted: ())
    monkeypatch.setattr(Validation, "_binned_residual", lambda *given: None)
    monkeypatch.setattr(Validation, "loop_run", lambda self, model: (model, ""))
    known = {("without", "whole"): simulated, ("described", "described with"): Shown(1.9, 0.6)}
    monkeypatch.setattr(
        Validation, "shown_in_loop", lambda self, first, last: known[(str(first[0]), str(last[0]))]
    )

    class Model(str):
        __slots__ = ()
        prior = None
        examination = SimpleNamespace(simulated=True)

        def gap_from(self, *given: object) -> Any:
            return SimpleNamespace(closed=0.1), None

    whole, without = Model("whole"), Model("without")
    accepted: Any = SimpleNamespace(
        basis=SimpleNamespace(
            p_value=0, score=0, threshold=0, doubt="", ranking=(), probability=1, held=None
        ),
        effect="static_friction",
        placed=SimpleNamespace(sentence="", place=SimpleNamespace(scope="drive")),
        joints=(1,),
        indistinguishable_from=(),
        unsure="",
    )
    loops: Any = (("described", ""), ("described with", ""))
    confirmation: Any = Validation((), None).finding(accepted, without, whole, loops)  # type: ignore[arg-type]
    assert confirmation.torque == (simulated or Shown(0.0, 0.0))
    assert confirmation.passed is (simulated is not None) and confirmation.of_reversals
