"""A vocabulary made for tests: waves over the position of one axis, which nothing else of its model has."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

import robots
from ident import Recording, RegressorModel
from ident.discrepancy.by_evidence.accepted import accepted_prior
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.problem import Problem, pose
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import Found, without_effects
from ident.discrepancy.by_evidence.evidence.prepared import prepare, settings_for
from ident.discrepancy.by_evidence.library.candidates import candidates, library
from ident.discrepancy.confirmation import Shown
from ident.effects import State
from ident.effects.family import EffectFamily, Place, PresentModel, Shape
from ident.effects.placed import Family, Law, Parameters, Parts, along, each_joint
from ident.effects.simulated import SimulatedParts
from ident.parameters.base import base_parameters
from robots.arrays import FloatArray
from robots.description import Robot

EMPS = robots.load("emps")
RATE, PERIOD, REACH, NOISE = 250.0, 4.0, 0.1, 0.2
"""Hz; s there and as long back; m; N."""

SIZE = 2.0
"""N, what a toy effect is before any data."""

Course = Callable[[FloatArray, Sequence[float]], FloatArray]
"""Torque (samples,) of a position (samples,) and of shapes."""


class NotLookedAt:
    """Other motion that shows nothing of any change."""

    def shown(self, found: Found, other: Found) -> Shown:
        return Shown(0.0, 0.0)

    def alone(self, found: Found, number: int) -> Shown:
        return Shown(0.0, 0.0)


def wave(number: float, position: FloatArray) -> FloatArray:
    """Half waves over the way, more than the splines of the misfit can follow."""
    return np.asarray(np.sin(number * np.pi * position / REACH))


def family(
    name: str,
    course: Course,
    shapes: tuple[Shape, ...] = (),
    contains: tuple[str, ...] = (),
    of_model: Callable[[FloatArray], FloatArray] | None = None,
    links: FloatArray | None = None,
    damping: FloatArray | None = None,
    beside: Course | None = None,
    essential: tuple[int, ...] = (),
) -> Family:
    """An effect of one axis with one factor, or two.

    Args:
        name: of it.
        course: its torque.
        shapes: that it has.
        contains: names of its limits.
        of_model: makes its torque of the model's instead.
        links: (1, 10) what it adds to the parameters of the link, per unit.
        damping: (1, 1) of friction.
        beside: torque of a second factor.
        essential: factors without which it is something else.
    """

    def make(
        robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
    ) -> tuple[Parameters, Law, Parts]:
        def law(state: State) -> FloatArray:
            if of_model is not None:
                return along(np.ones(1), of_model(present.torque(state)[:, 0]))
            courses = (course,) if beside is None else (course, beside)
            return along(np.ones(1), *(one(state.position[:, 0], shape) for one in courses))

        def parts(values: FloatArray) -> SimulatedParts:
            return SimulatedParts(links=None if links is None else links * values[0], damping=damping)

        symbols = (name,) if beside is None else (name, f"{name}_beside")
        count = len(symbols)
        return Parameters(symbols, ("N",) * count, ((-np.inf, np.inf),) * count, (SIZE,) * count), law, parts

    def of_it(robot: Robot, place: Place) -> tuple[Shape, ...]:
        return shapes

    return Family(name, name, "joint", each_joint, make, of_it, essential=essential, contains=contains)


def waves(name: str, **numbers: float) -> Family:
    """A sum of waves: ``w9=1.0`` is one of nine half waves."""
    return family(name, lambda position, shape: torque(position, **numbers))


def torque(position: FloatArray, **numbers: float) -> FloatArray:
    """(samples,) N, of such a sum."""
    return np.asarray(sum(size * wave(float(key[1:]), position) for key, size in numbers.items()))


def recording(more: Callable[[FloatArray], FloatArray], seconds: float = 16.0) -> Recording:
    """One axis with viscous friction that goes there and back, and more torque, N, of its position."""
    random = np.random.default_rng(0)
    time = np.arange(round(seconds * RATE)) / RATE
    position = REACH * np.sin(np.pi * (time % (2.0 * PERIOD)) / PERIOD)
    force = 10.0 * np.cos(np.pi * time / PERIOD) + more(position) + NOISE * random.normal(size=time.size)
    reference = position[:, np.newaxis]
    return Recording("toy", time, reference, reference, force[:, np.newaxis] / EMPS.gains)


def problem_of(more: Callable[[FloatArray], FloatArray], accepted: bool = False) -> Problem:
    """The axis without any toy effect, fitted to such a recording; or against an accepted model of it."""
    log = recording(more)
    robot = settings_for(EMPS, log)
    base, data = base_parameters(RegressorModel.of(robot)), prepare(robot, [log])
    problem = pose(base, None, data, None)
    if not accepted:
        return problem
    beta = problem.start
    return pose(base, accepted_prior(beta, np.diag(1e-6 * beta**2 + 1e-8)), data, None)


def searching(problem: Problem, families: Sequence[Family]) -> Search:
    """A search that has not begun."""
    return Search(problem, candidates(problem.prepared.robot, families), lambda step, share: None)


def found_alone(search: Search, one: EffectFamily) -> Searched:
    """Where a search would be that took one effect, in its one form, and went no further."""
    empty = without_effects(search.problem)
    present = present_with(search.problem, empty)
    entries = library(search.problem.rows, search.wanted, present)
    forms = [form for form in screen(search.problem, empty, entries) if form.candidate.family is one]
    (found,) = search.replaced(empty, forms)
    return Searched(found, empty, present, entries, {})


def names_of(searched: Searched) -> list[str]:
    """Of the set that a search ended with, in order of the alphabet."""
    return sorted(member.candidate.family.name for member in searched.found.members)
