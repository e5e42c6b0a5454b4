"""Folding over periods of a grid: the parts that a residual shows, by themselves and beside all else."""

from __future__ import annotations

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide import boxes, cells
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.library.candidates import Entry
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.test_boxes import PERIOD, agreement, posed, residual


def parts(turns: FloatArray) -> list[FloatArray]:
    """(rows,) 1 within each part of a period."""
    cell = np.floor(np.mod(turns, 1.0) * 40).astype(int)
    return [
        np.isin(cell, np.arange(start, start + length) % 40).astype(float)
        for length in range(2, 39)
        for start in range(40)
    ]


def test_the_best_part_of_a_period_is_that_of_all_parts_tried() -> None:
    problem, nothing, _, always = posed()
    rows, said, (seen, height) = problem.rows, residual(problem, nothing), agreement()
    squares, tried = nothing.level.excess**2, []
    for inside in parts(seen.time / PERIOD):
        column = height * inside
        white = rows.whiteners[0](column[:, np.newaxis])[:, 0]
        information = white @ white / squares[0] + 1.0 / always.scale[0] ** 2
        tried.append(0.5 * max(float(column @ said), 0.0) ** 2 / information)
    assert cells._alone(PERIOD, seen) == pytest.approx(max(tried), rel=1e-6)
    assert max(tried) > 3.0 * np.median(tried)


def test_beside_all_that_the_model_has_it_is_the_likeliest_of_all_parts() -> None:
    problem, nothing, drag, always = posed()
    gain, share, beginning = cells._beside_all(problem.rows, nothing, drag, always, PERIOD)
    present, tried = present_with(problem, nothing), {}
    for length, start in ((share, beginning), (share, (beginning + 0.3) % 1.0), (0.5, 0.0), (0.2, 0.6)):
        placed = drag.at(problem.prepared.robot, (PERIOD, length, start), present)
        entry = Entry(drag, placed, problem.rows.effect(placed))
        own, score = information_beside(problem.rows, nothing.level, nothing.members, (entry,))
        tried[length, start] = 0.5 * max(float(score[0]), 0.0) ** 2 / (1.0 + float(own[0, 0]))
    assert max(tried, key=lambda one: tried[one]) == (share, beginning)
    # Its edges have passed the filter, those of the cells have not.
    assert gain == pytest.approx(tried[share, beginning], rel=0.3, abs=1.0)


def test_what_the_best_of_so_many_has_by_luck_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, nothing, drag, _ = posed()
    present, luck = present_with(problem, nothing), np.log(drag.combinations)
    monkeypatch.setattr(boxes, "best_edges", lambda *given: [])
    for height, count in ((0.9 * luck, 0), (1.1 * luck, cells.PEAKS)):
        gains = iter(np.where(np.arange(len(drag.shapes[0].grid)) % 40 == 20, height, 0.0))
        monkeypatch.setattr(cells, "_alone", lambda *given, gains=gains: next(gains))
        assert len(scanned(problem.rows, nothing, (drag,), present)) == count
