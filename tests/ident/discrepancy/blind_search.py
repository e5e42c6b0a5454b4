"""A search as a user runs it, on a simulated arm in which something is hidden."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording
from ident.discrepancy import Diagnosis, Prior, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.discrepancy.examination import Examination
from ident.effects.family import EffectFamily
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray, IntArray


def recorded(
    robot: Robot, truth: int, scenario: Scenario, motion: int, seed: int, duration: float
) -> Recording:
    """Two periods of an exercise as a master would have recorded them; seeds of arm, motion and noise."""
    path = exercise(robot, duration=duration, seed=motion)
    run = simulate_offline(robot, draw_truth(robot, truth), path, scenario=scenario, periods=2, seed=seed)
    return Recording("blind", run.time, run.reference, run.position, run.control_signal)


def beyond_noise(examination: Examination) -> tuple[FloatArray, IntArray]:
    """(n,) residual sum of squares of each joint's rows beyond one per row, and (n,) how many these are."""
    joint = examination.whitening.joint_of_rows(examination.segment, examination.used)
    beyond = examination.residual[: examination.data_rows] ** 2 - 1.0
    joints = examination.used.shape[1]
    return np.bincount(joint, beyond, joints), np.bincount(joint, minlength=joints)


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
