"""As much of a search as looks at reversals, of a one-axis arm with something hidden."""

from __future__ import annotations

from types import MethodType, SimpleNamespace
from typing import Any, cast

import robots
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Prior, Question, accepted_noise, accepted_prior
from ident.discrepancy.by_evidence import diagnosis
from ident.discrepancy.step import LoopStep
from ident.discrepancy.workflow import Search, silent
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import recorded

FAMILIES = [
    family_named(name) for name in ("static_friction", "hysteresis", "joint_elasticity", "stribeck_friction")
]


def in_loop(scenario: Scenario) -> LoopStep:
    """A one-axis arm with something hidden, against its model from before, examined in closed loop."""
    return of_recording(recorded(robots.load("emps"), 700, scenario, 0, 2, 8.0))


def of_recording(fit: Recording) -> LoopStep:
    """Of the same arm, a recording of it with something hidden."""
    robot = robots.load("emps")
    accepted = recorded(robot, 700, Scenario(), 0, 1, 8.0)
    estimate = identify(robot, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

    step = Search(Question(robot, (fit,), (fit,), (), prior), silent).step.in_loop()
    return cast(LoopStep, step)


class Course:
    """What a search goes on with; it takes what it is given."""

    def __init__(self) -> None:
        self.step: Any = "moving"
        self.reversing: Any = None
        self.taken: list[tuple[str, float | None]] = []

    def add_in_loop(self, component: Any, basis: Any) -> None:
        self.taken.append((component.family.name, basis.probability))


def led(step: LoopStep, moving: str, settled: set[int]) -> Any:
    """As much of a search as looks at reversals."""
    told: Any = SimpleNamespace(
        step=SimpleNamespace(in_loop=lambda any_law=False: step.in_loop(any_law=True) if any_law else step),
        question=SimpleNamespace(families=FAMILIES),
        findings=[],
        _no_further=set,
        settled=settled,
        course=Course(),
        unnamed="",
        notes=(),
        _leave_to_motion=lambda: None,
        _more_in_motion=lambda: moving != "clean",
    )
    for name in ("_tell_loop", "_tell_problem"):
        setattr(told, name, MethodType(getattr(diagnosis._Led, name), told))
    return told
