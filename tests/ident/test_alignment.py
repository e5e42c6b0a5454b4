"""The lag between control signal and torque, found where it is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.importing.load import load_recording
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from ident import IdentificationError, Recording, identify
from ident.results import Signals
from robots import Robot


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def recording(tx40: Robot) -> Recording:
    time = np.arange(0.0, 16.0, tx40.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(time, 16.0 - time))[:, np.newaxis] ** 3
    tones = [(0.13, 0.5), (0.31, 0.22), (0.7, 0.06)]
    waves = sum(
        a * np.sin(2 * np.pi * f * (1 + 0.09 * np.arange(6)) * time[:, np.newaxis] + np.arange(6))
        for f, a in tones
    )
    run = simulate_offline(tx40, draw_truth(tx40, 4), np.array(tx40.home) + window * waves)
    return Recording("run", run.time, run.reference, run.position, run.control_signal)


def signals(robot: Robot, recording: Recording, **changes: object) -> tuple[Signals, tuple[str, ...]]:
    settings = robot.identification.model_copy(update=changes)
    without = Recording(
        "run", recording.time, recording.reference, recording.position, recording.control_signal
    )
    result = identify(robot.model_copy(update={"identification": settings}), (without,)).result
    assert result.signals is not None
    return result.signals, result.warnings


@pytest.mark.slow
@pytest.mark.parametrize("given", [0.0, 0.0005, 0.004])
def test_the_lag_of_the_simulated_arm_is_half_a_hold(tx40: Robot, recording: Recording, given: float) -> None:
    found, warnings = signals(tx40, recording, control_signal_lag=given)
    assert found.estimated_lag is not None and found.lag_sigma is not None
    assert found.lag_sigma < 5e-5
    # A fortieth of a sample: what else a slow motion leaves in the residual is of that size.
    assert abs(found.estimated_lag - 0.0005) < 1e-4
    assert found.lag == given
    assert any("control-signal lag" in sentence for sentence in warnings) == (given != 0.0005)


def test_the_arm_may_ask_for_the_estimate(tx40: Robot, recording: Recording) -> None:
    found, warnings = signals(tx40, recording, control_signal_lag=0.002, alignment="estimate")
    assert found.lag == pytest.approx(0.0005, abs=1e-4)
    assert not any("control-signal lag" in sentence for sentence in warnings)


def test_a_lag_beyond_all_reason_is_refused(tx40: Robot, recording: Recording) -> None:
    settings = tx40.identification.model_copy(
        update={"control_signal_lag": 0.1, "alignment": "estimate", "control_signal_reading": "averaged"}
    )
    with pytest.raises(IdentificationError, match='alignment "estimate": no lag within 20 ms'):
        identify(tx40.model_copy(update={"identification": settings}), (recording,))


def test_a_published_log_hardly_has_a_lag(shared_data: Path) -> None:
    """By its measured motion it would be 0.30 ± 0.03 ms, of which the loop's noise makes the most."""
    robot = robots.load("emps")
    loaded = load_recording(shared_data / "emps" / "DATA_EMPS.mat", robot)
    found, warnings = signals(robot, loaded.recordings[0])
    assert found.estimated_lag is not None and found.lag_sigma is not None
    assert abs(found.estimated_lag) < 3.0 * found.lag_sigma < 0.00015
    assert found.lag == 0.0
    assert not any("control-signal lag" in sentence for sentence in warnings)
    own, _ = signals(robot, replace(loaded.recordings[0], reference=None))
    assert own.estimated_lag == pytest.approx(0.0003, abs=0.00005)
