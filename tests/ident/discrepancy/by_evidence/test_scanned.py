"""Ripples whose period nobody has described: found by scanning the residual, said, and paid for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from ident.discrepancy import Diagnosis, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.search import first_of
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.evidence.noise import Noise, Whitener
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry, candidates, library
from ident.discrepancy.by_evidence.workflow import posed
from ident.effects.family import Place, PresentModel
from ident.effects.torque_ripple import TORQUE_RIPPLE
from tests.ident.discrepancy.by_evidence.test_search import FEW, prior, recorded
from tests.ident.discrepancy.by_evidence.toy_effects import REACH, problem_of, torque

EMPS = robots.load("emps")
WITHOUT = 1.7
"""Periods per turn of the motor, of no gear: 400 turns are a metre."""

PER_METRE = WITHOUT * 400.0


def question(order: float, amplitude: float) -> Question:
    ripple = {"drive": 1, "amplitude": amplitude, "order": order, "phase": 0.4}
    hidden: dict[str, object] = {"torque_ripple": [ripple]} if amplitude else {}
    fit, held = recorded(hidden, 0, 2), recorded(hidden, 1, 3)
    return Question(EMPS, (fit,), (held,), FEW, prior)


def diagnosed(order: float) -> Diagnosis:
    return diagnose_with_evidence(question(order, 2.0), sizes=False)[0]


@cache
def small() -> tuple[Problem, tuple[Entry, ...]]:
    problem = posed(question(WITHOUT, 0.6))
    nothing = without_effects(problem)
    present = present_with(problem, nothing)
    return problem, scanned(problem.rows, nothing, of_ripple(problem), present)


def of_ripple(problem: Problem) -> tuple[Candidate, ...]:
    return candidates(problem.prepared.robot, (TORQUE_RIPPLE,))


def test_a_ripple_of_no_gear_is_named_with_its_period() -> None:
    found = diagnosed(WITHOUT)
    assert found.verdict == "named"
    (finding,) = found.findings
    assert finding.effect == "torque_ripple" and finding.confirmation.passed
    (period,) = (one for one in finding.parameters if one.name == "periods_per_metre")
    assert 0.0 < period.sigma < 0.3
    assert period.value == pytest.approx(PER_METRE, abs=3.0 * period.sigma)
    said = f"comes {period.value:.1f} times per metre; no gear of the description explains it"
    assert f"torque ripple of joint 1 {said}" in found.notes


def test_a_ripple_of_the_motor_has_the_gear_for_its_reason() -> None:
    """Its period need not be chosen among thousands, and is likelier by their number."""
    found = diagnosed(2.0)
    (finding,) = found.findings
    assert {one.name: one.value for one in finding.parameters}["periods_per_turn"] == 2.0
    assert not any("gear" in note for note in found.notes)


def test_what_comes_a_few_times_within_the_motion_is_tried_beside_all_else() -> None:
    """Nine waves there, which splines and friction may half take up."""
    problem = problem_of(lambda q: torque(q, w9=2.0))
    nothing = without_effects(problem)
    entries = scanned(problem.rows, nothing, of_ripple(problem), present_with(problem, nothing))
    slow = [one.placed.shape for one in entries if one.placed.shape[0] < 60.0]
    assert any(shape == (pytest.approx(4.5 / REACH, abs=0.5 / REACH), 0.0) for shape in slow)
    best = screen(problem, nothing, entries)[0].best.entry
    assert best.placed.shape in slow


def test_the_scan_finds_what_every_period_by_itself_would_show() -> None:
    problem, entries = small()
    nothing = without_effects(problem)
    best = screen(problem, nothing, entries)[0].best.entry
    (candidate,) = {one.candidate for one in entries}
    present = present_with(problem, nothing)
    grid = candidate.shapes[0].grid
    near = int(np.argmin(np.abs(np.array(grid) - PER_METRE)))
    tried = [grid[k] for k in (*range(0, len(grid), 97), *range(near - 4, near + 5))]
    own = {period: alone(problem, candidate, (period, 0.0), present) for period in tried}
    assert alone(problem, candidate, best.placed.shape, present) >= max(own.values()) - 0.5


def alone(problem: Problem, candidate: Candidate, shape: tuple[float, ...], present: PresentModel) -> float:
    """Nats of one period without any prior of it."""
    placed = candidate.at(problem.prepared.robot, shape, present)
    entry = Entry(candidate, placed, problem.rows.effect(placed))
    (screened,) = screen(problem, without_effects(problem), (entry,))
    return screened.gain + float(np.log(candidate.combinations))


def test_a_period_costs_the_number_of_those_that_could_have_been_tried() -> None:
    problem, entries = small()
    nothing = without_effects(problem)
    (found,) = screen(problem, nothing, entries)
    peak = alone(problem, found.candidate, found.best.entry.placed.shape, present_with(problem, nothing))
    assert found.candidate.combinations > 2000
    assert found.gain == pytest.approx(peak - np.log(found.candidate.combinations), abs=np.log(4.0))


def test_a_library_has_no_entry_of_what_is_scanned() -> None:
    problem, _ = small()
    nothing = without_effects(problem)
    entries = library(problem.rows, of_ripple(problem), present_with(problem, nothing))
    assert entries and not any(one.candidate.is_scanned for one in entries)


def test_what_is_scanned_takes_no_place_among_those_that_are_tried() -> None:
    """There is one of each drive beside any set, and the places are few."""
    any_period, motor = sorted(of_ripple(small()[0]), key=lambda one: not one.is_scanned)
    kinds = [any_period, any_period, motor, any_period, motor, motor, any_period]
    assert first_of("abcdefg", 1, kinds) == list("abcdefg")
    kinds[3] = replace(any_period, place=Place("drive", (3,)))
    kinds[4:6] = (replace(motor, place=Place("drive", (k,))) for k in (1, 2))
    assert first_of("abcdefg", 1, kinds) == list("abcd")
    assert first_of("abcdefg", 2, kinds) == list("abcde")
    assert first_of("abcdefg", 3, kinds) == list("abcdefg")


def test_the_adjoint_of_whitening_is_its_own() -> None:
    random = np.random.default_rng(5)
    segment, used = np.repeat([0, 1], [60, 40]), np.ones(100, dtype=np.bool_)
    used[[20, 21, 70]] = False
    whitener = Whitener.of(Noise(np.array([0.7, -0.2]), 0.3), segment, used)
    values = random.normal(size=(100, 1))
    white = whitener(values)[:, 0]
    other = random.normal(size=white.size)
    assert other @ white == pytest.approx(whitener.back(other, 100) @ values[:, 0])
