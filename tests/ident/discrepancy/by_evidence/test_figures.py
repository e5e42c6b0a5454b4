"""What each figure of the evidence does, on data made for it: half of it or twice as much is noticed here."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from ident import Recording
from ident.discrepancy.by_evidence import in_loop, reversals
from ident.discrepancy.by_evidence.decide import left_over, problem
from ident.discrepancy.by_evidence.evidence import lag, misfit, residual
from ident.discrepancy.by_evidence.evidence.noise import autoregressive
from ident.discrepancy.by_evidence.evidence.prepared import Part, Prepared, prepare, settings_for
from ident.discrepancy.by_evidence.terms import propose, stability
from ident.effects import State
from ident.effects.usual import friction_sign
from ident.errors import IdentificationError
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel

EMPS = robots.load("emps")
RATE, PERIOD = 1000.0, 4.0
SWING = 0.1 * np.pi / PERIOD
"""m/s, the largest speed of the motion."""


def recording(seconds: float, seed: int = 0) -> Recording:
    """One axis that goes there and back in 4 s, standing still for an instant only, and noise."""
    random = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    position = 0.1 * np.sin(np.pi * (time % (2.0 * PERIOD)) / PERIOD)[:, np.newaxis]
    signal = 0.3 * np.cos(np.pi * time / PERIOD)[:, np.newaxis] + 0.01 * random.normal(size=position.shape)
    return Recording("log", time, position, position + 1e-7 * random.normal(size=position.shape), signal)


def prepared(seconds: float = 24.0) -> Prepared:
    log = recording(seconds)
    return prepare(settings_for(EMPS, log), [log])


def test_rows_are_left_out_within_80_ms_of_a_hundredth_of_the_speed_limit() -> None:
    part = prepared().parts[0]
    time = np.asarray(part.own.time)
    standstill = 0.5 * PERIOD + PERIOD * np.arange(6)
    slow = np.arcsin(0.01 * EMPS.velocity_limits[0] / SWING) * PERIOD / np.pi
    nearest = [float(np.abs(time[part.used[:, 0]] - instant).min()) for instant in standstill]
    assert np.array(nearest) == pytest.approx(slow + 0.08, abs=0.008)


def test_a_record_loses_five_periods_of_the_cut_off_at_both_ends() -> None:
    time = np.asarray(prepared().parts[0].own.time)
    assert time[0] == pytest.approx(5.0 / 50.0)
    assert time[-1] == pytest.approx(24.0 - 5.0 / 50.0, abs=0.01)


def test_fifty_rows_are_the_least() -> None:
    settings = settings_for(EMPS, recording(24.0))
    with pytest.raises(IdentificationError, match="at least 600"):
        prepare(settings, [recording(0.599)])
    assert prepare(settings, [recording(0.6)]).torque.shape[0] == 50


@pytest.mark.parametrize(("waves", "left"), [(5, 0.0), (9, 0.5)])
def test_six_half_waves_are_slow_and_more_are_noise(waves: int, left: float) -> None:
    data = prepared()
    own = data.parts[0].own
    share = (np.asarray(own.time) - own.time[0]) / (own.time[-1] - own.time[0])  # type: ignore[index]
    course = np.sign(own.velocity) * np.cos(np.pi * waves * share)[:, np.newaxis]
    noise = 100.0 * np.random.default_rng(1).normal(size=course.shape)  # in which no more half waves are seen
    rest = data.not_repeating(noise + course) - data.not_repeating(noise)
    assert np.std(rest[data.used]) / np.std(course[data.used]) == pytest.approx(left, abs=0.2)


def test_the_noise_remembers_four_rows() -> None:
    random = np.random.default_rng(2)
    series, taps = np.zeros(6000), (0.3, 0.1, -0.1, -0.5, 0.2)
    for k in range(5, series.size):
        series[k] = sum(a * series[k - 1 - i] for i, a in enumerate(taps)) + random.normal()
    one = np.zeros(series.size, dtype=np.int64)
    found = autoregressive(series, one, np.ones(series.size, dtype=np.bool_))
    assert found.coefficients.size == 4
    assert found.coefficients[3] == pytest.approx(taps[3], abs=0.15)


def state(rows: int = 4000, joints: int = 6) -> State:
    random = np.random.default_rng(4)
    motion = (random.normal(size=(rows, joints)) for _ in range(3))
    return State(*motion, np.arange(rows) / 125.0)


def test_the_misfit_of_a_joint_has_75_columns_on_six_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(misfit, "_directions", lambda columns, used: columns)
    moving, used = state(), np.ones(4000, dtype=np.bool_)
    load = np.random.default_rng(5).normal(size=4000)
    columns = misfit.misfit_columns(2, moving, load, used, friction_sign(EMPS))
    assert columns.shape[1] == 75


def test_the_misfit_follows_three_half_waves_and_no_fourth() -> None:
    moving = state()
    columns = misfit._of_time(moving)
    share = np.asarray(moving.time) / np.asarray(moving.time)[-1]
    for half_waves, follows in ((1, True), (2, True), (3, True), (4, False), (6, False)):
        wave = np.cos(np.pi * half_waves * share)
        left = wave - columns @ np.linalg.lstsq(columns, wave, rcond=None)[0]
        assert bool(np.std(left) < 0.05) is follows, half_waves


def test_splines_end_at_the_outer_half_percent() -> None:
    values = np.linspace(0.0, 1.0, 10001)
    columns = misfit._splines(values, 8, np.ones(values.size, dtype=np.bool_))
    for end in (0, -1):
        flat = np.all(columns == columns[end], axis=1).sum()
        assert flat == pytest.approx(51, abs=2)


@pytest.mark.parametrize(("apart", "directions"), [(0.12, 2), (0.08, 1)])
def test_columns_that_are_nearly_the_same_are_one_direction(apart: float, directions: int) -> None:
    first, other = np.linalg.qr(np.random.default_rng(0).normal(size=(200, 2)))[0].T * np.sqrt(200.0)
    turned = (1.0 - apart) * first + np.sqrt(1.0 - (1.0 - apart) ** 2) * other
    found = misfit._directions(np.stack([first, turned], axis=1), np.ones(200, dtype=np.bool_))
    assert found.shape[1] == directions


@pytest.mark.parametrize(("late", "sample", "taken"), [(0.0029, 2e-4, True), (0.0031, 2e-4, False)])
def test_channels_more_than_3_ms_apart_are_late(
    monkeypatch: pytest.MonkeyPatch, late: float, sample: float, taken: bool
) -> None:
    steps = iter((late, 0.0))
    monkeypatch.setattr(lag, "prepare", lambda *given: None)
    monkeypatch.setattr(lag, "_step", lambda *given: next(steps))
    robot: Any = EMPS
    found = lag.aligned(robot, None, [SimpleNamespace(sample_time=sample)])  # type: ignore[arg-type, list-item]
    assert found.identification.control_signal_lag == (pytest.approx(late) if taken else 0.0)


def test_noise_and_misfit_are_estimated_three_times_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = []
    original = problem.noise_beside
    monkeypatch.setattr(problem, "noise_beside", lambda *given: rounds.append(1) or original(*given))
    log = recording(16.0)
    robot = settings_for(EMPS, log)
    problem.pose(base_parameters(RegressorModel.of(robot)), None, prepare(robot, [log]), None)
    assert len(rounds) == 3


@pytest.mark.parametrize(("above", "left"), [(0.45, 0.02), (0.55, 0.3)])
def test_misfit_that_is_above_the_accepted_one_more_likely_than_not_is_what_is_left(
    monkeypatch: pytest.MonkeyPatch, above: float, left: float
) -> None:
    monkeypatch.setattr(left_over, "above_accepted", lambda *given: np.array([above]))
    monkeypatch.setattr(left_over, "misfit_of", lambda *given: np.array([0.3]))
    posed: Any = SimpleNamespace(misfit=SimpleNamespace(accepted=np.array([0.02])))
    assert left_over.usual_at(posed, None, 0) == left  # type: ignore[arg-type]
    monkeypatch.setattr(in_loop, "above_accepted", lambda *given: np.array([above]))
    monkeypatch.setattr(in_loop, "without_effects", lambda *given: None)
    monkeypatch.setattr(in_loop, "by_any_law", lambda *given: None)
    course: Any = SimpleNamespace(step=None)
    looked = in_loop.InLoop(course, None, ())  # type: ignore[arg-type]
    looked._tell(posed)
    assert bool(looked.unnamed) is (left == 0.3)


@pytest.mark.parametrize(("gain", "shaped"), [(9.6, False), (10.4, True), (12.0, True)])
def test_an_effect_with_half_the_nats_that_it_needs_is_shaped_by_simulation(
    monkeypatch: pytest.MonkeyPatch, gain: float, shaped: bool
) -> None:
    """A prior of 10 nats against it; the best of a grid has at least half of what the best shape has."""
    asked = []
    fitted = SimpleNamespace(log_evidence=gain, log_posterior=0.0, members=("one",), level=None)
    monkeypatch.setattr(reversals, "found_set", lambda *given: fitted)
    best = SimpleNamespace(joints=(0,))
    monkeypatch.setattr(reversals, "refined", lambda *given, **how: asked.append(1) or best)
    monkeypatch.setattr(
        reversals,
        "Member",
        lambda *given: SimpleNamespace(
            log_prior=-10.0,
            joints=(0,),
            entry=SimpleNamespace(white=SimpleNamespace(there=True)),
        ),
    )
    monkeypatch.setattr(reversals, "Entry", lambda *given: None)
    posed: Any = SimpleNamespace(
        prepared=SimpleNamespace(robot=None), rows=SimpleNamespace(effect=lambda placed: None)
    )
    candidate = SimpleNamespace(at=lambda *given: None)
    entry = SimpleNamespace(candidate=candidate, placed=SimpleNamespace(shape=()))
    one: Any = SimpleNamespace(best=SimpleNamespace(entry=entry, volume=0.0))
    empty: Any = SimpleNamespace(level=None, log_evidence=0.0)
    assert reversals._simulated(posed, empty, one, None) is fitted  # type: ignore[arg-type]
    assert bool(asked) is shaped


def test_half_of_a_recording_is_half_of_its_blocks_of_a_second() -> None:
    rows = 1000
    time = np.arange(rows) / 125.0
    motion = State(*(np.zeros((rows, 1)) for _ in range(3)), time)
    part = Part(motion, motion, np.zeros((rows, 1)), np.ones((rows, 1), dtype=np.bool_), None, 1, 0.008)
    given: Any = SimpleRows(prepared=Prepared(EMPS, (part,)))
    used = stability._half(given, 3).prepared.parts[0].used[:, 0]
    blocks = used.reshape(8, 125)
    assert np.all(blocks == blocks[:, :1]) and blocks[:, 0].sum() == 4
    kept = [stability._half(given, seed).prepared.parts[0].used[::125, 0] for seed in range(8)]
    changes = np.flatnonzero(np.any(np.diff(np.array(kept).astype(int), axis=1), axis=0))
    assert changes.size > 4, "neighbouring seconds are chosen each for itself"


@dataclass(frozen=True)
class SimpleRows:
    """Rows of which the recordings alone are asked for."""

    prepared: Prepared


def leaves(share: float, after: float, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether a term is proposed that so many halves agree with, and that leaves so much of 0.2."""
    term = SimpleNamespace(joint=0, formula="f", unit="N", variables={"v1"}, looks_like="")
    found: Any = SimpleNamespace(members=(), theta=lambda k: (np.ones(1), np.eye(1)))
    monkeypatch.setattr(propose, "_entries", lambda *given: ((term,), ()))
    monkeypatch.setattr(propose, "chosen_terms", lambda *given: [((0,), found)])
    monkeypatch.setattr(propose, "stability", lambda *given: share)
    lefts = iter((np.array([0.2]), np.array([after])))
    held: Any = SimpleNamespace(unexplained=lambda found: next(lefts))
    return bool(propose._of_joint(None, found, None, held, 0))  # type: ignore[arg-type]


def test_a_term_is_kept_that_eight_halves_of_ten_agree_with(monkeypatch: pytest.MonkeyPatch) -> None:
    assert leaves(0.8, 0.1, monkeypatch) and not leaves(0.7, 0.1, monkeypatch)


def test_a_term_closes_more_than_half_of_what_is_unexplained_on_other_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert leaves(1.0, 0.14, monkeypatch) and not leaves(1.0, 0.142, monkeypatch)


def test_ten_halves_choose_again(monkeypatch: pytest.MonkeyPatch) -> None:
    halves: list[int] = []
    monkeypatch.setattr(stability, "_half", lambda rows, seed: halves.append(seed) or rows)
    monkeypatch.setattr(stability, "replace", lambda one, **changed: one)
    monkeypatch.setattr(stability, "information_beside", lambda *given: (np.eye(1), np.ones(1)))
    found: Any = SimpleNamespace(
        members=(), level=None, log_posterior=0.0, posterior=SimpleNamespace(theta=np.ones(1))
    )
    monkeypatch.setattr(stability, "found_set", lambda *given: found)
    answers = iter([[((0,), found)]] * 7 + [[]] * 3)
    monkeypatch.setattr(stability, "chosen_terms", lambda *given: next(answers))
    term: Any = SimpleNamespace(variables=frozenset({"v1"}))
    posed: Any = SimpleNamespace(rows=None)
    entries: Any = [SimpleNamespace()]
    monkeypatch.setattr(stability, "_on", lambda rows, entry: entry)
    monkeypatch.setattr(stability, "_same_torque", lambda *given: False)
    assert stability.stability(posed, found, entries, [term], ((0,), found), 0) == 0.7
    assert len(set(halves)) == 10


def test_what_is_slow_is_no_noise_where_nothing_repeats() -> None:
    """Else a spring that the model lacks is taken for noise that remembers for seconds."""
    random = np.random.default_rng(3)
    log = recording(7.0)
    data = prepare(settings_for(EMPS, log), [log])
    rows = data.torque.shape[0]
    noise = 0.01 * random.normal(size=(rows, 1))
    for hz, kept in ((0.5, 0.0), (1.0, 0.0), (12.0, 1.0)):
        wave = np.sin(2.0 * np.pi * hz * np.asarray(data.parts[0].own.time))[:, np.newaxis]
        (found,) = residual._noise(data, noise + wave, np.zeros(1))
        (alone,) = residual._noise(data, noise, np.zeros(1))
        power = (found.marginal**2 - alone.marginal**2) / 0.5
        assert power == pytest.approx(kept, abs=0.35 if kept else 0.02), hz
