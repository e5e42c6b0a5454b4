"""What each figure that both searches share does: half of it or twice as much is noticed here."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy import loop, onset
from ident.discrepancy.repeats import repeat_length
from robots.arrays import FloatArray


@pytest.mark.parametrize(("seconds", "found"), [(0.8, 1.6), (1.2, 1.2)])
def test_a_period_is_a_second_or_more(seconds: float, found: float) -> None:
    time = np.arange(round(12 * seconds / 0.01)) * 0.01
    phase = np.round(time / 0.01) % round(seconds / 0.01)
    reference = np.sin(phase**1.5 / 20.0)[:, np.newaxis]
    assert repeat_length(reference, 0.01) == round(found / 0.01)


def test_the_first_second_of_a_loop_settles() -> None:
    piece: Any = SimpleNamespace(recording=SimpleNamespace(sample_time=0.004))
    assert loop.settled(piece) == 250


def likely(log: float) -> SimpleNamespace:
    """Rows of which a step has this log evidence, wherever it is, and a drift has none."""

    def steps(instants: FloatArray) -> FloatArray:
        share = (instants[1] - instants[0]) / 100.0
        return np.full(instants.size, log - np.log(instants.size) - np.log(share))

    return SimpleNamespace(
        torque=np.ones(1),
        time=np.array([0.0, 100.0]),
        ramp=None,
        of_cuts=steps,
        of_steps=steps,
        spread_beside=lambda instant: 1.0,
        white=lambda course: course,
        log_evidence=lambda more: np.array([-50.0]),
    )


@pytest.mark.parametrize(("log", "told"), [(4.0, False), (4.6, True)])
def test_a_change_is_told_at_nine_tenths_with_prior_odds_of_a_tenth(
    monkeypatch: pytest.MonkeyPatch, log: float, told: bool
) -> None:
    """Nine tenths are e^4.28 beside 0.8 to 0.1."""
    monkeypatch.setattr(onset._Rows, "of", lambda *given: likely(log))
    monkeypatch.setattr(onset, "replace", lambda rows, **changed: rows)
    monkeypatch.setattr(onset, "_stepping", lambda *given: "told")
    assert (onset.onset_of(None, np.zeros(1, dtype=np.int64)) == "told") is told  # type: ignore[arg-type]


@pytest.mark.parametrize(("deviations", "kind"), [(2.5, "begins"), (3.5, "changes")])
def test_what_is_less_than_three_deviations_before_a_step_begins_there(deviations: float, kind: str) -> None:
    sizes = iter(((deviations, 1.0), (20.0, 1.0)))
    started = SimpleNamespace(started=0.0, recording=SimpleNamespace(sample_time=0.01, time=np.zeros(1)))
    rows: Any = SimpleNamespace(
        examination=SimpleNamespace(prepared=(started,)),
        later=lambda instants: np.zeros((1, 1)),
        factor_beside=lambda course: next(sizes),
    )
    instants = np.linspace(1.0, 2.0, 11)
    assert onset._stepping(rows, instants, np.zeros(11), 1, 0.95).kind == kind


def test_a_score_deviates_as_sums_over_a_second_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """What turns its sign every second adds up over one, and to nothing over two."""
    time = np.arange(4000) / 100.0
    left = np.where(time // 1.0 % 2.0, 1.0, -1.0)
    rows: Any = SimpleNamespace(
        examination=SimpleNamespace(torque=left, data_rows=time.size),
        columns=np.ones((time.size, 1)),
        later=lambda instants: None,
        white=lambda course: np.zeros((time.size, 1)),
    )
    monkeypatch.setattr(onset, "_times", lambda examination: time)
    assert onset._Rows.spread_beside(rows, 20.0) == pytest.approx(100.0, rel=0.01)
