"""Which rows the evidence reads and what they hold: of coupled drives, of torque, of the other periods."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import numpy as np
import pytest

import robots
from ident import Recording, RegressorModel
from ident.discrepancy.by_evidence.decide.problem import pose
from ident.discrepancy.by_evidence.decide.state import Member, found_set
from ident.discrepancy.by_evidence.evidence import prepared as prepared_rows
from ident.discrepancy.by_evidence.evidence.lag import aligned
from ident.discrepancy.by_evidence.evidence.prepared import (
    Part,
    _away_from_standstill,
    prepare,
    settings_for,
)
from ident.discrepancy.by_evidence.evidence.rows import WhiteEffects
from ident.discrepancy.by_evidence.library.candidates import Entry, candidates
from ident.effects import State
from ident.effects.vocabulary import family_named
from ident.parameters.base import base_parameters
from robots.arrays import FloatArray

EMPS = robots.load("emps")
RATE, PERIOD = 1000.0, 4.0


def recording(more: FloatArray | float = 0.0, noise: float = 1e-7, seconds: float = 16.0) -> Recording:
    """One axis that goes there and back; its control signal goes with its speed, with something more."""
    random = np.random.default_rng(0)
    time = np.arange(round(seconds * RATE)) / RATE
    position = 0.1 * np.sin(np.pi * (time % (2.0 * PERIOD)) / PERIOD)[:, np.newaxis]
    signal = 0.3 * np.cos(np.pi * time / PERIOD) + 0.01 * random.normal(size=time.size) + more
    measured = position + noise * random.normal(size=position.shape)
    return Recording("log", time, position, measured, signal[:, np.newaxis])


def part(log: Recording) -> Part:
    return prepare(settings_for(EMPS, log), [log]).parts[0]


def swinging(seconds: float) -> Recording:
    """One axis that swings at 20 Hz about where it is, and goes on for some seconds once in each period."""
    time = np.arange(round(4.0 * PERIOD * RATE)) / RATE
    phase = time % (2.0 * PERIOD)
    way = 0.05 * np.clip(phase - 2.0, 0.0, seconds) - 0.025 * seconds * np.clip(phase - 5.0, 0.0, 2.0)
    still = (phase > 2.0) & (phase < 2.0 + seconds)
    position = (way + np.where(still, 0.0, 2e-4) * np.sin(40.0 * np.pi * time))[:, np.newaxis]
    return Recording("log", time, position, position, np.cos(time)[:, np.newaxis])


def test_a_joint_that_swings_about_where_it_is_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the few rows that it turns on nothing is noise, and in units of that rows are no numbers."""
    assert part(swinging(1.5)).used.any()
    assert not part(swinging(0.2)).used.any()
    monkeypatch.setattr(prepared_rows, "_FEWEST_ROWS", 1)
    assert 0 < np.count_nonzero(part(swinging(0.2)).used) < 50


def test_rows_near_a_standstill_of_a_drive_that_moves_with_the_joint_are_left_out() -> None:
    """Two joints of a coupled wrist that turn so that a drive of both stands still."""
    robot = robots.load("tx40")
    transmission = robot.transmission_matrix
    drive, joint = next(
        (drive, joint)
        for drive in range(6)
        for joint in range(6)
        if drive != joint and transmission[drive, joint] != 0.0
    )
    time = np.arange(2000) * 0.001
    velocity = np.tile(0.3 * robot.velocity_limits, (time.size, 1))
    velocity[1000:, drive] = -transmission[drive, joint] * velocity[0, joint] / transmission[drive, drive]
    state = State(np.zeros_like(velocity), velocity, np.zeros_like(velocity), time)
    settings = settings_for(robot, recording()).identification
    used = _away_from_standstill(robot, state, 0.001, settings)
    together = np.isin(np.arange(6), (drive, joint))
    assert used[:900].all() and used[:, ~together].all()
    assert not used[1000:, together].any()


def test_torque_above_the_cut_off_is_not_folded_into_the_rows() -> None:
    """A tone that the positions' filter keeps out of the motion is kept out of the torque, too."""
    time = np.arange(round(16.0 * RATE)) / RATE
    plain, tone = (part(recording(more)) for more in (0.0, 0.1 * np.sin(2.0 * np.pi * 297.0 * time)))
    apart = np.abs(tone.torque - plain.torque) / np.abs(EMPS.gains)
    assert apart.max() < 1e-3


def test_what_another_period_has_of_noise_is_no_motion() -> None:
    """Of an encoder's noise in accelerations more than half goes; the sample's own motion has all of it."""
    noisy, clean = part(recording(noise=3e-6)), part(recording(noise=0.0))
    used = clean.used[:, 0]
    own, other = (
        np.std((one.acceleration - true.acceleration)[used])
        for one, true in ((noisy.own, clean.own), (noisy.at_rows, clean.at_rows))
    )
    assert other < 0.5 * own


@pytest.mark.parametrize(("given", "found"), [(0.0, -0.002), (0.0005, 0.0005)])
def test_a_lag_that_the_description_gives_is_believed(given: float, found: float) -> None:
    """Of a log whose control signal comes 2 ms after its motion."""
    tones = ((np.pi / PERIOD, 0.1), (5.0 * np.pi / PERIOD, 0.02))
    time = np.arange(round(16.0 * RATE)) / RATE
    position = sum(size * np.sin(turn * time) for turn, size in tones)[:, np.newaxis]
    force = sum(
        size * turn * (200.0 * np.cos(turn * (time - 0.002)) - 95.0 * turn * np.sin(turn * (time - 0.002)))
        for turn, size in tones
    )
    log = Recording("late", time, position, position, force[:, np.newaxis] / EMPS.gains)
    said = {"control_signal_lag": given, "control_signal_reading": "averaged"}
    settings = EMPS.identification.model_copy(update=said)
    robot = settings_for(EMPS.model_copy(update={"identification": settings}), log)
    lag = aligned(robot, base_parameters(RegressorModel.of(robot)), [log]).identification.control_signal_lag
    assert lag == pytest.approx(found, abs=1e-4)


def test_an_effect_that_is_made_of_the_measured_torque_does_not_explain_it() -> None:
    """Beyond the limit of a drive that saturates any torque is asked for, a ripple that repeats with it."""
    time = np.arange(round(16.0 * RATE)) / RATE
    log = recording(0.05 * np.sin(np.pi * 40.0 * time / PERIOD))
    robot = settings_for(EMPS, log)
    problem = pose(base_parameters(RegressorModel.of(robot)), None, prepare(robot, [log]), None)
    (one,) = candidates(robot, (family_named("saturation"),))
    placed = one.at(robot, (0.1 * float(np.abs(problem.prepared.torque).max()),), problem.present)
    member = Member(Entry(one, placed, problem.rows.effect(placed)), 0.0)
    assert found_set(problem, (member,), problem.level, (0,)).log_evidence < problem.score - 100.0


def test_an_effect_whose_products_are_forgotten_keeps_no_rows() -> None:
    class Nobody:
        """In the place of rows."""

    rows: Any = Nobody()
    kept = weakref.ref(rows)
    white = WhiteEffects(1, (None,), np.zeros(1), np.zeros((1, 2)), np.ones(1))
    white.products(rows, tuple)
    del rows
    gc.collect()
    assert kept() is not None
    white.forget()
    gc.collect()
    assert kept() is None
