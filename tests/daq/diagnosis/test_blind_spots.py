"""What a diagnosis could not have shown: gains that hide, and what a refit takes away."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from daq.diagnosis import blind_spots as module
from daq.diagnosis.blind_spots import blind_spots
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording
from ident.discrepancy import Diagnosis, Prior, Question, described_prior
from ident.discrepancy.by_evidence import EvidenceAnswer, diagnose_with_evidence, prior_by_evidence
from ident.effects.vocabulary import family_named
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

FEW = tuple(
    map(
        family_named, ("drive_gain_error", "viscous_friction", "coulomb_friction", "rotor_inertia", "payload")
    )
)


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


def asked(
    rig: Robot, recordings: tuple[Recording, Recording], prior: Any
) -> tuple[Diagnosis, EvidenceAnswer]:
    return diagnose_with_evidence(
        Question(rig, recordings[:1], recordings[1:], FEW, prior, at_reversals=False)
    )


def test_after_a_refit_everything_that_needs_a_prior_is_named(rig: Robot, accepted: Recording) -> None:
    diagnosis: Any = SimpleNamespace(examinations=(SimpleNamespace(prior=None),))
    nobody: Any = None
    spots = blind_spots(diagnosis, nobody)
    assert [spot.effect for spot in spots] == ["drive_gain_error", "current_offset", "payload"]
    assert all("--prior" in spot.words() for spot in spots)


def test_a_gain_is_known_as_well_as_the_prior_knows_the_arm(
    rig: Robot, truth: PlantTruth, path: FloatArray, accepted: Recording
) -> None:
    later = recorded(rig, truth, path, 0.0, 2), recorded(rig, truth, path, 0.0, 3)
    sharp, rough = (
        asked(rig, later, prior)
        for prior in (lambda base: prior_by_evidence(base, (accepted,)), described_prior)
    )
    assert blind_spots(*sharp) == ()
    (spot,) = blind_spots(*rough)
    assert (spot.effect, spot.joints) == ("drive_gain_error", (1,))
    assert spot.smallest > 0.05
    assert "known payload" in spot.words()


def test_a_gain_error_shows_from_what_is_said_and_not_well_below(
    rig: Robot, truth: PlantTruth, path: FloatArray, accepted: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    def prior(base: BaseParameters) -> Prior:
        return prior_by_evidence(base, (accepted,))

    def search(change: float) -> tuple[Diagnosis, EvidenceAnswer]:
        return asked(
            rig, (recorded(rig, truth, path, change, 2), recorded(rig, truth, path, change, 3)), prior
        )

    monkeypatch.setattr(module, "WORTH_KNOWING", 0.0)
    (spot,) = blind_spots(*search(0.0))
    assert search(0.4 * spot.smallest)[0].findings == ()
    found = search(2.0 * spot.smallest)
    assert [one.effect for one in found[0].findings] == ["drive_gain_error"]
    assert blind_spots(*found) == ()
