"""As much of a search as looks at reversals, of a one-axis arm with something hidden."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import robots
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Prior, Question, accepted_noise
from ident.discrepancy.by_evidence.accepted import accepted_prior
from ident.discrepancy.by_evidence.diagnosis import course_of
from ident.discrepancy.by_evidence.in_loop import InLoop
from ident.discrepancy.step import LoopStep
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
        return accepted_prior(estimate.values, estimate.covariance, noise)

    step = course_of(Question(robot, (fit,), (fit,), (), prior)).step.in_loop()
    return cast(LoopStep, step)


class Course:
    """What a search goes on with; it takes what it is given."""

    def __init__(self, step: LoopStep) -> None:
        def in_loop(any_law: bool = False) -> LoopStep | None:
            return step.in_loop(any_law=True) if any_law else step

        self.step: Any = SimpleNamespace(in_loop=in_loop, placed=[])
        self.reversing: Any = None
        self.findings: list[Any] = []
        self.taken: list[tuple[str, float]] = []

    def add_in_loop(self, in_loop: Any, component: Any, basis: Any) -> None:
        self.step = self.reversing = in_loop
        self.taken.append((component.family.name, basis.probability))


class Looking(InLoop):
    """A look at reversals of which what the moving arm shows is given."""

    moving = "clean"
    alone: frozenset[int] = frozenset()

    def left_alone(self) -> set[int]:
        return set(self.alone)

    def more_in_motion(self) -> bool:
        return self.moving != "clean"


def looking(step: LoopStep, moving: str = "clean", alone: set[int] | frozenset[int] = frozenset()) -> Any:
    """Before a look at reversals."""
    answer: Any = None
    course: Any = Course(step)
    search = Looking(course, answer, FAMILIES)
    search.moving, search.alone = moving, frozenset(alone)
    return search


def looked(step: LoopStep, moving: str, alone: set[int]) -> Any:
    """After it."""
    search = looking(step, moving, alone)
    search.look()
    return search
