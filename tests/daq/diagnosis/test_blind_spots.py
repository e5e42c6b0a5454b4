"""What a diagnosis could not have shown: gains that hide, and what a refit takes away."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from daq.diagnosis.blind_spots import blind_spots, smallest_gain_error
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, RegressorModel, base_parameters, identify
from ident.discrepancy import Diagnosis, Prior, Question, accepted_prior, described_prior, diagnose
from ident.discrepancy.examination import Examination, examine
from ident.discrepancy.prepared_recording import prepared_recording
from ident.discrepancy.settings import searching
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan


@pytest.fixture(scope="module")
def rig() -> Robot:
    return robots.load("emps")


@pytest.fixture(scope="module")
def truth(rig: Robot) -> PlantTruth:
    return draw_truth(rig, 8)


@pytest.fixture(scope="module")
def path(rig: Robot) -> FloatArray:
    motion = plan(rig, cycle_time=rig.bus.cycle_time, duration=5.0, seed=0, evaluations=40, periods=2)
    return np.asarray(motion.position[: len(motion.position) // 2])


@pytest.fixture(scope="module")
def accepted(rig: Robot, truth: PlantTruth, path: FloatArray) -> Recording:
    return recorded(rig, truth, path, 0.0, 1)


def recorded(rig: Robot, truth: PlantTruth, path: FloatArray, change: float, seed: int) -> Recording:
    gains = [{"drive": 1, "change": change}] if change else []
    scenario = Scenario.from_dict({"format": 1, "drive_gain_error": gains})
    run = simulate_offline(rig, truth, path, scenario=scenario, periods=2, seed=seed)
    return Recording("run", run.time, run.reference, run.position, run.control_signal)


def examined(rig: Robot, recording: Recording, prior: Any) -> Examination:
    arm = searching(rig, recording)
    base = base_parameters(RegressorModel.of(arm))
    return examine(base, (prepared_recording(arm, recording),), None if prior is None else prior(base))


def diagnosed(examination: Examination) -> Any:
    return SimpleNamespace(examinations=(examination, examination), findings=())


def test_after_a_refit_everything_that_needs_a_prior_is_named(rig: Robot, accepted: Recording) -> None:
    spots = blind_spots(diagnosed(examined(rig, accepted, None)))
    assert [spot.effect for spot in spots] == ["drive_gain_error", "current_offset", "payload"]
    assert all("--prior" in spot.words() for spot in spots)


def test_a_gain_is_known_as_well_as_the_prior_knows_the_arm(rig: Robot, accepted: Recording) -> None:
    estimate = identify(rig, (accepted,)).result.recommended

    def as_accepted(base: BaseParameters) -> Prior:
        return accepted_prior(base, estimate.values, estimate.covariance)

    sharp, rough = (examined(rig, accepted, prior) for prior in (as_accepted, described_prior))
    assert smallest_gain_error(sharp, 0) < 0.05 < 0.1 < smallest_gain_error(rough, 0)
    assert blind_spots(diagnosed(sharp)) == ()
    (spot,) = blind_spots(diagnosed(rough))
    assert (spot.effect, spot.joints) == ("drive_gain_error", (1,))
    assert "known payload" in spot.words()


def test_a_gain_error_shows_from_what_is_said_and_not_well_below(
    rig: Robot, truth: PlantTruth, path: FloatArray, accepted: Recording
) -> None:
    estimate = identify(rig, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        return accepted_prior(base, estimate.values, estimate.covariance)

    def search(change: float) -> Diagnosis:
        fit, validation = (recorded(rig, truth, path, change, seed) for seed in (2, 3))
        question = Question(rig, (fit,), (validation,), VOCABULARY, prior, at_reversals=False)
        return diagnose(question)

    smallest = smallest_gain_error(examined(rig, accepted, prior), 0)
    assert search(0.4 * smallest).findings == ()
    assert search(2.0 * smallest).findings != ()
