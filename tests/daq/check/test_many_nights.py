"""Years of nights behind a check: what is asked of the database does not grow with them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.catalogue import baselines, checks, models, runs
from daq.catalogue.checks import INCREASED
from daq.catalogue.database import Catalogue
from daq.check.nights import nights_since
from daq.check.recorded import TRAJECTORY_SHA256
from daq.check.residual import ENOUGH, residual_increases
from tests.daq.catalogue.entries import identity, model
from tests.daq.service.test_many_arms import counted

MOTION = "c3" * 32
NAMES = tuple(parameter.name for parameter in model().parameters)
LEFT = (1.0,) * 6


def add_nights(catalogue: Catalogue, count: int, **details: object) -> None:
    """Checks beside the arm's baseline, which the first of all models becomes."""
    for _ in range(count):
        run = runs.begin(catalogue, identity(), "check", facts={"celsius": "21.5"})
        kept = models.add(catalogue, run.id, replace(model(run.id), torque_rms=LEFT))
        arm = kept.arm_id
        known = baselines.current(catalogue, arm)
        if known is None:
            baselines.accept(catalogue, kept.id, "Ada", "first", None)
            continue
        found = {TRAJECTORY_SHA256: MOTION, "state": "unchanged", INCREASED: [], "warnings": ["x"] * 99}
        found |= {"celsius": [20.0 + run.id] * 6, **details}
        checks.add(catalogue, run.id, "ok", "fine", found, model_id=kept.id, baseline_id=known.id)


def test_what_is_asked_does_not_grow_with_the_nights(tmp_path: Path) -> None:
    """And the long details of a night stay in the database."""
    asked = []
    with Catalogue(str(tmp_path / "catalogue.db")) as catalogue:
        for more in (4, 20):
            add_nights(catalogue, more)
            (arm,) = {run.arm_id for run in runs.every(catalogue)}
            baseline = baselines.current(catalogue, arm)
            assert baseline is not None
            tonight = replace(
                models.of_arm(catalogue, arm, limit=1)[0], id=9999, torque_rms=(1.0, 3.0, *LEFT[2:])
            )
            with counted() as nights:
                known = nights_since(catalogue, baseline, MOTION, NAMES)
            with counted() as residual:
                assert residual_increases(catalogue, baseline, tonight, MOTION) == ((2, 3.0),)
            statements = [one for one in (*nights, *residual) if one.startswith("SELECT")]
            assert not [one for one in statements if re.search(r"(?<!\()checks\.details", one)]
            asked.append((len(known), len(statements)))
    assert [count for count, _ in asked] == [3, 23]
    assert asked[0][1] == asked[1][1] <= 10, asked


@pytest.mark.parametrize(
    ("details", "clean"),
    [({}, True), ({"state": "changed"}, False), ({INCREASED: [2]}, False), ({INCREASED: None}, True)],
)
def test_a_night_is_what_its_details_say(tmp_path: Path, details: dict[str, object], clean: bool) -> None:
    """Of another motion or baseline it is none; without temperatures of its own it has those of its run."""
    with Catalogue(str(tmp_path / "catalogue.db")) as catalogue:
        add_nights(catalogue, 2, **details)
        add_nights(catalogue, 1, **{TRAJECTORY_SHA256: "other"})
        add_nights(catalogue, 1, celsius=None)
        run = runs.get(catalogue, 2)
        baseline = baselines.current(catalogue, run.arm_id)
        assert baseline is not None
        first, last = nights_since(catalogue, baseline, MOTION, NAMES)
        assert (first.clean, last.clean) == (clean, True)
        assert first.celsius is not None and last.celsius is not None
        assert (first.celsius[0], last.celsius[0]) == (22.0, 21.5)
        assert first.label == f"run 2 ({run.started:%Y-%m-%d})"
        kept = models.latest_of(catalogue, 2)
        np.testing.assert_array_equal(first.values, [parameter.value for parameter in kept.parameters])
        add_nights(catalogue, ENOUGH)
        loud = replace(kept, id=9999, torque_rms=(1.5,) * 6)
        assert len(residual_increases(catalogue, baseline, loud, MOTION)) == 6
        assert residual_increases(catalogue, baseline, replace(loud, torque_rms=(1.2,) * 6), MOTION) == ()
