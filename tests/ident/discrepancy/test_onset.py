"""When a found effect began: the instant within its interval, none told of what is there all the time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.onset import ROBOT, heavier_from, onset, rubs_until
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy import onset as module
from ident.discrepancy.prepared_recording import prepared_recordings
from tests.ident.discrepancy.blind_search import hidden, recorded


def of(scenario: Scenario, seed: int) -> Recording:
    return recorded(ROBOT, 700, scenario, 0, seed, 8.0)


@pytest.fixture(scope="module")
def accepted() -> Recording:
    return of(Scenario(), 1)


def test_a_brake_lets_go_when_the_interval_says(accepted: Recording) -> None:
    found = onset(of(rubs_until(9.37, 0.8), 2), accepted, "coulomb_friction")
    assert found is not None and found.kind == "ends" and found.recording == 1
    assert found.interval[0] <= 9.37 <= found.interval[1] < found.interval[0] + 0.2
    assert found.before > 1.2 and abs(found.after) < 3 * found.after_sigma


def test_a_mass_is_there_from_an_instant_on(accepted: Recording) -> None:
    found = onset(heavier_from(of(Scenario(), 3), 5.2), accepted, "rotor_inertia")
    assert found is not None and found.kind == "begins"
    assert found.interval[0] <= 5.2 <= found.interval[1] < found.interval[0] + 0.4


def test_friction_that_is_there_all_the_time_began_at_no_instant(accepted: Recording) -> None:
    always = of(hidden({"coulomb_friction": [{"drive": 1, "change": 0.3}]}), 4)
    assert onset(always, accepted, "coulomb_friction") is None


def test_what_fades_over_the_recording_has_no_instant(accepted: Recording) -> None:
    warming = of(hidden({"drifting_friction": [WARMING]}), 5)
    found = onset(warming, accepted, "coulomb_friction")
    assert found is None or found.kind == "drifts"


WARMING: dict[str, Any] = {
    "drive": 1,
    "start": 15.0,
    "coulomb_per_kelvin": -0.05,
    "viscous_per_kelvin": -0.05,
    "time_constant": 10.0,
    "heating": 0.0,
}


def test_a_simulated_loop_has_no_instants() -> None:
    other: Any = type("Loop", (), {"examinations": (object(),), "findings": ()})()
    assert module.onsets(other) == ()


def test_a_step_of_a_motion_that_repeats_is_seen_through_the_low_pass(accepted: Recording) -> None:
    """There the torque is filtered as the motion is: the step is half done in its middle, and longer."""
    (piece,) = prepared_recordings(ROBOT, (accepted,))
    slow = piece.settings.model_copy(update={"cutoff_hz": 5.0})
    widths = {}
    for period in (None, 2000):
        offset, value = module._response(replace(piece, period=period, settings=slow))
        assert abs(value[np.abs(offset).argmin()] - 0.5) < 0.1
        widths[period] = int(((value > 0.05) & (value < 0.95)).sum())
    assert widths[2000] > 2 * widths[None]
