"""Names that a poor motion leaves open, and the planned motion that settles them.

Development seeds of ``benchmarks/naming_settled_beside.py``, whose page has those that nobody had seen.
"""

from __future__ import annotations

import pytest

from benchmarks import naming_settled_beside as beside
from daq.diagnosis.apart import PlanSettings


def test_the_planned_motion_settles_what_a_poor_one_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beside, "SETTINGS", PlanSettings(evaluations=150))
    effect = "nonlinear_viscous_friction"
    line = beside.one_run(effect, 894502)
    assert line["verdict"] == "ambiguous" and beside.holds(line, line["first"])
    assert len(line["first"]["names"][0]) > 1
    assert beside.settled(line, line["planned"]) and not beside.wrong(line, line["planned"])
    assert beside.settled_whole(line, line["planned"])
    assert not line["planned"]["beyond"]
    assert f"| {effect} | 1 |" in beside.report([line])


def test_what_slow_motion_says_nothing_of_is_not_left_open() -> None:
    """Viscous friction of 8.3 ± 1.1 N·s/m beside a fourth power of the speed of −3 ± 39 N is viscous."""
    line = beside.one_run("viscous_friction", 595)
    assert line["verdict"] == "named"
    ((first, *_),) = line["first"]["names"]
    assert first[0] == "viscous_friction" and first[2] > 0.9
