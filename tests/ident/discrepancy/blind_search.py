"""A search as a user runs it, on a simulated arm in which something is hidden."""

from __future__ import annotations

from collections.abc import Sequence

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording
from ident.discrepancy import Diagnosis, Prior, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.effects.family import EffectFamily
from ident.effects.vocabulary import VOCABULARY
from robots import Robot


def recorded(
    robot: Robot, truth: int, scenario: Scenario, motion: int, seed: int, duration: float
) -> Recording:
    """Two periods of an exercise as a master would have recorded them; seeds of arm, motion and noise."""
    path = exercise(robot, duration=duration, seed=motion)
    run = simulate_offline(robot, draw_truth(robot, truth), path, scenario=scenario, periods=2, seed=seed)
    return Recording("blind", run.time, run.reference, run.position, run.control_signal)


def hidden(scenario: dict[str, object]) -> Scenario:
    """What only the plant is told."""
    return Scenario.from_dict({"format": 1, **scenario})


def search(
    arm: str,
    truth: int,
    scenario: dict[str, object],
    *,
    duration: float,
    vocabulary: Sequence[EffectFamily] = VOCABULARY,
    at_reversals: bool = True,
) -> Diagnosis:
    """One recording to fit and another to validate, against the model of the same arm without the effect."""
    robot = robots.load(arm)
    accepted = recorded(robot, truth, Scenario(), 0, 1, duration)

    def prior(base: BaseParameters) -> Prior:
        return prior_by_evidence(base, (accepted,))

    fit = recorded(robot, truth, hidden(scenario), 0, 2, duration)
    validation = recorded(robot, truth, hidden(scenario), 1, 3, duration)
    question = Question(robot, (fit,), (validation,), tuple(vocabulary), prior, at_reversals=at_reversals)
    return diagnose_with_evidence(question, sizes=False)[0]
