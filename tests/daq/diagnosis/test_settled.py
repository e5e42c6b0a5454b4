"""Names that a poor motion leaves open, and the planned motion that settles them.

Development seeds of ``benchmarks/naming_settled_beside.py``, whose page has those that nobody had seen.
"""

from __future__ import annotations

import pytest

from benchmarks import naming_settled_beside as beside
from daq.diagnosis.apart import PlanSettings


@pytest.mark.parametrize(("effect", "seed"), [("viscous_friction", 595), ("nonlinear_viscous_friction", 584)])
def test_the_planned_motion_settles_what_a_poor_one_left_open(
    monkeypatch: pytest.MonkeyPatch, effect: str, seed: int
) -> None:
    monkeypatch.setattr(beside, "SETTINGS", PlanSettings(evaluations=150))
    line = beside.one_run(effect, seed)
    assert line["verdict"] == "ambiguous" and beside.holds(line, line["first"])
    assert len(line["first"]["names"][0]) > 1
    assert beside.settled(line, line["planned"]) and not beside.wrong(line, line["planned"])
    assert beside.settled_whole(line, line["planned"])
    assert not line["planned"]["beyond"]
    assert f"| {effect} | 1 |" in beside.report([line])
