"""The simulated year in short, by the code of ``benchmarks/year.py``: quiet nights, wear, a step, gain."""

from __future__ import annotations

import re

import numpy as np
import pytest

from benchmarks.year import run_year
from benchmarks.year_nights import bench, hall
from ident.drift import DriftSettings

LEARNING = 8
AFTER = 11


@pytest.mark.slow
def test_each_change_is_named_at_its_joint_and_nothing_else_is() -> None:
    """Nights of a simulated six-axis arm in a hall whose temperature swings; eight of them teach."""
    made = bench(0, duration=3.0, evaluations=200)
    found = run_year(0, 16, AFTER, DriftSettings(learning_nights=LEARNING), made)
    assert found["nights"] == 15 and found["false_alarms"] == []
    wear, tool, gain = found["changes"]
    assert wear["named"] is not None and wear["named"] >= 2, "one hundredth more a week is not seen at once"
    assert re.match(r"Coulomb friction of joint 2 \+(0\.[7-9]|1\.[0-3]) %", wear["sentence"])
    assert (tool["delay"], tool["named"]) == (1, 1)
    assert tool["sentence"].startswith("payload on the tool +0.2")
    assert (gain["delay"], gain["named"]) == (1, 1)
    assert gain["sentence"].startswith("drive gain of joint 3 -5.")


@pytest.mark.parametrize("seed", range(3))
def test_the_hall_is_no_laboratory(seed: int) -> None:
    """Seasons, weather and weekends that a thermometer sees only in part."""
    room, gears, recorded = hall(365, seed)
    assert np.ptp(room) > 12.0 and (gears >= room).all()
    weekend = np.arange(365) % 7 >= 5
    assert room[~weekend].mean() - room[weekend].mean() > 1.5
    missed = recorded - 22.0 - gears
    assert 0.3 < np.std(missed) < 3.0
