"""A single axis at 1 kHz: what its many reversals leave must not look like a missing effect."""

from __future__ import annotations

import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Diagnosis, Prior, Question, accepted_noise, accepted_prior, diagnose
from ident.effects.vocabulary import VOCABULARY

TRUTH = 501


def search(scenario: dict[str, object]) -> Diagnosis:
    robot = robots.load("emps")
    truth = draw_truth(robot, TRUTH)

    def recorded(hidden: Scenario, motion: int, seed: int) -> Recording:
        path = exercise(robot, duration=5.0, seed=motion)
        run = simulate_offline(robot, truth, path, scenario=hidden, periods=2, seed=seed)
        return Recording("blind", run.time, run.reference, run.position, run.control_signal)

    accepted = recorded(Scenario(), 0, 1)
    estimate = identify(robot, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

    hidden = Scenario.from_dict({"format": 1, **scenario})
    return diagnose(Question(robot, (recorded(hidden, 0, 2),), (recorded(hidden, 1, 3),), VOCABULARY, prior))


def test_nothing_hidden_is_clean() -> None:
    found = search({})
    assert found.verdict == "clean", found.description
    examination = found.examinations[-1]
    assert examination.excess < 0.1 * examination.torque.shape[0]


@pytest.mark.parametrize(
    ("scenario", "effect"),
    [
        ({"drive_gain_error": [{"drive": 1, "change": -0.05}]}, "drive_gain_error"),
        ({"viscous_friction": [{"drive": 1, "change": 0.3}]}, "viscous_friction"),
        # Further apart than channels are aligned, and nobody has said how they lie.
        ({"time_delay": [{"drive": 1, "position": 0.005}]}, "time_delay"),
    ],
)
def test_an_effect_of_a_drive_is_named(scenario: dict[str, object], effect: str) -> None:
    found = search(scenario)
    assert found.findings and found.findings[0].effect == effect, found.description
