"""Folding over a period: the parts of it that a residual shows, beside those that are tried one by one."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.signal import lfilter

from ident.discrepancy.by_evidence.decide import boxes
from ident.discrepancy.by_evidence.decide.edges import Agreement, best_edges
from ident.discrepancy.by_evidence.decide.peaks import PEAKS, tried_at
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import gains_beside
from ident.discrepancy.by_evidence.decide.state import Found, without_effects
from ident.discrepancy.by_evidence.evidence.residual import white_residual
from ident.discrepancy.by_evidence.evidence.rows import effect_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, candidates
from ident.discrepancy.by_evidence.workflow import Problem
from ident.effects.placed import Placed
from ident.effects.vocabulary import family_named
from ident.kernels.folding import best_parts
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.test_scanned import small

PERIOD = 2.5


def posed() -> tuple[Problem, Found, Candidate, Placed]:
    problem, _ = small()
    nothing = without_effects(problem)
    drags = candidates(problem.prepared.robot, (family_named("dragging_brake"),))
    (drag,) = (one for one in drags if one.over == "time")
    always = drag.at(problem.prepared.robot, (PERIOD, 1.0, 0.0), present_with(problem, nothing))
    assert isinstance(always, Placed)
    return problem, nothing, drag, always


def residual(problem: Problem, nothing: Found) -> FloatArray:
    """(rows,) Wᵀu over s² of the one joint."""
    rows = problem.rows
    (left,) = white_residual(rows, nothing.level, nothing.posterior, [])
    return rows.whiteners[0].back(left, rows.prepared.used.shape[0]) / nothing.level.excess[0] ** 2


def agreement() -> tuple[Agreement, FloatArray]:
    """Of the column that is there all the time, and that column of the one joint."""
    problem, nothing, _, always = posed()
    rows = problem.rows
    height = effect_rows(rows.prepared, always)[:, :, 0]
    time = np.asarray(rows.prepared.parts[0].at_rows.time)
    products = boxes._products(rows, height, nothing.level.excess**2)
    agreed = height[:, 0] * residual(problem, nothing)
    return Agreement(time, agreed, products, always.scale[0]), height[:, 0]


def test_the_best_part_of_a_turn_is_the_best_of_all_parts_tried() -> None:
    problem, nothing, _, always = posed()
    rows, said, cells = problem.rows, residual(problem, nothing), 20
    (seen, height), squares = agreement(), nothing.level.excess**2
    time = seen.time
    cell = np.floor(np.mod(time / PERIOD, 1.0) * cells).astype(int)
    sizes, prior, tried = np.array([0.01, 0.1, 1.0]) * always.scale[0], 1.0 / always.scale[0] ** 2, {}
    for count, start in product(range(1, cells), range(cells)):
        column = height * np.isin(cell, np.arange(start, start + count) % cells)
        white = rows.whiteners[0](column[:, np.newaxis])[:, 0]
        information = white @ white / squares[0] + prior
        tried[count, start] = max(sizes * (column @ said) - 0.5 * sizes**2 * information)
    of_rows = seen.agreed, seen.products.sum(axis=0), seen.crossing
    turns = time, np.array([1.0 / PERIOD]), np.array([cells])
    gain, first, count_of = best_parts(turns, of_rows, sizes, prior)
    best = max(tried, key=lambda one: tried[one])
    assert gain[0] == pytest.approx(tried[best], rel=1e-6)
    assert (count_of[0], first[0]) == best
    assert tried[best] > 3.0 * np.median(list(tried.values()))


@pytest.mark.parametrize("beginning", [0.2, 0.8])
def test_a_part_of_any_period_is_found_to_a_row(beginning: float) -> None:
    """Noise that remembers shows its edges alone: with 5 ms more there are none after nine turns."""
    period, share = 7.0331, 0.34
    time = 0.008 * np.arange(8000)
    box = (np.mod(time / period - beginning, 1.0) < share).astype(np.float64)
    white = lfilter([1.0, -0.98], [1.0], box) + np.random.default_rng(1).normal(0.0, 0.25, time.size)
    back = lfilter([1.0, -0.98], [1.0], (white / 0.0625)[::-1])[::-1]
    products = np.repeat([[1.0 + 0.98**2], [-2.0 * 0.98]], time.size, axis=1) / 0.0625
    found = best_edges(Agreement(time, back, products, 1.0), (1.0, 10.0), 2)
    assert found[0][0] > 50.0 and found[0][0] == max(gain for gain, _ in found)
    assert found[0][1][0] == pytest.approx(period, abs=0.003)
    assert found[0][1][1:] == pytest.approx((share, beginning), abs=0.01)


def test_of_some_parts_those_are_tried_that_say_most_beside_all_else(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, nothing, drag, _ = posed()
    present, luck = present_with(problem, nothing), np.log(drag.combinations)
    some = [(PERIOD, 0.3, start) for start in (0.0, 0.2, 0.4, 0.6, 0.8)]
    gains = gains_beside(problem.rows, nothing, tried_at(problem.rows, drag, some, present))
    order = [some[k] for k in np.argsort(gains)]  # those that say least come first
    monkeypatch.setattr(boxes, "best_cells", lambda *given: [])
    monkeypatch.setattr(boxes, "best_edges", lambda *given: [(1.1 * luck, part) for part in order])
    entries = scanned(problem.rows, nothing, (drag,), present)
    assert [one.placed.shape for one in entries] == order[::-1][:PEAKS]


def test_all_periods_are_tried_on_40_s_and_their_peaks_on_all(monkeypatch: pytest.MonkeyPatch) -> None:
    time, asked = 0.008 * np.arange(8000), list[float]()
    box = (np.mod(time / 7.0, 1.0) < 0.3).astype(np.float64)
    parts = Agreement.parts

    def heard(
        self: Agreement, frequencies: FloatArray
    ) -> tuple[FloatArray, list[tuple[float, float, float]]]:
        asked.append(self.duration)
        return parts(self, frequencies)

    monkeypatch.setattr(Agreement, "parts", heard)
    best_edges(Agreement(time, box, np.ones((1, time.size)), 1.0), (1.0, 10.0), 3)
    assert asked == pytest.approx([40.0, 64.0, 64.0, 64.0], abs=0.02)


def test_what_the_best_of_so_many_has_by_luck_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, nothing, drag, _ = posed()
    present, luck = present_with(problem, nothing), np.log(drag.combinations)
    monkeypatch.setattr(boxes, "best_cells", lambda *given: [])
    for share, height, count in ((0.3, 0.9, 0), (0.3, 1.1, 1), (0.97, 1.1, 0)):  # 0.97 is out of its limits
        part = (height * luck, (PERIOD, share, 0.1))
        monkeypatch.setattr(boxes, "best_edges", lambda *given, part=part: [part])
        assert len(scanned(problem.rows, nothing, (drag,), present)) == count
