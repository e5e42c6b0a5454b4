"""Slower along a path and back to its own pace: on the path, within the limits, and back on a row of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robots
from drivers.cyclic.path_pace import RAMP_SECONDS, PathPace
from drivers.frames.units import Units

TX40 = robots.load("tx40")
CYCLE = TX40.bus.cycle_time


def path(seed: int, rows: int = 600) -> np.ndarray:
    """A smooth motion from rest to rest, at its highest acceleration up to the limit of a joint; counts."""
    dice = np.random.default_rng(seed)
    t = np.arange(rows) * CYCLE
    window = np.minimum(1.0, np.minimum(t, t[::-1]) / 0.5)
    window = window**3 * (10 - 15 * window + 6 * window**2)
    wave = np.sin(2 * np.pi * (dice.uniform(0.3, 1.2, 6) * t[:, None] + dice.random(6)))
    motion = window[:, None] * wave
    fastest = np.abs(np.diff(motion, 2, axis=0)).max(axis=0) / CYCLE**2
    motion *= (TX40.acceleration_limits / fastest).min() * 0.99
    return Units.of(TX40).counts(np.array(TX40.home) + motion)


@settings(max_examples=40)
@given(st.integers(0, 2**16), st.integers(0, 598), st.lists(st.integers(1, 250), max_size=4))
def test_any_pauses_anywhere(seed: int, row: int, turns: list[int]) -> None:
    """Slower and faster by turns, for so many cycles each; then back to its own pace."""
    counts, units = path(seed), Units.of(TX40)
    pace = PathPace(counts, units, TX40.acceleration_limits, CYCLE, row)
    went = [counts[max(row - 1, 0)].tolist(), counts[row].tolist()]
    places = [pace.place]
    for number, cycles in enumerate(turns):
        for _ in range(cycles):
            if number % 2 and pace.at_own_pace:
                break
            went.append(list(pace.faster() if number % 2 else pace.slower()))
            places.append(pace.place)
            assert 0.0 <= pace.pace <= 1.0
    for _ in range(2000):
        if pace.at_own_pace:
            break
        went.append(list(pace.faster()))
        places.append(pace.place)
    assert pace.at_own_pace and pace.place == round(pace.place)
    on = int(pace.place)
    assert (went[-1] == counts[on]).all() and (np.diff(places) >= 0).all(), "on a row, and never backwards"
    went += counts[on + 1 : on + 3].tolist()
    joints = units.position(np.array(went))
    rounding = 4 * np.abs(np.linalg.inv(units.transmission)) @ (1 / np.abs(units.counts_per_output_unit))
    limit = TX40.acceleration_limits * CYCLE**2
    assert (np.abs(np.diff(joints, 2, axis=0)) <= 1.01 * limit + rounding).all()


@pytest.mark.parametrize("row", [100, 250, 377])
def test_at_rest_as_soon_as_it_may(row: int) -> None:
    pace = PathPace(path(3), Units.of(TX40), TX40.acceleration_limits, CYCLE, row)
    cycles = 0
    while not pace.at_rest:
        pace.slower()
        cycles += 1
    assert round(RAMP_SECONDS / CYCLE) <= cycles <= round(0.8 / CYCLE)
    there = pace.place
    assert list(pace.slower()) == list(pace.slower()) and pace.place == there, "and stays"


def test_on_a_row_again_as_soon_as_it_may() -> None:
    pace = PathPace(path(3), Units.of(TX40), TX40.acceleration_limits, CYCLE, 150)
    for _ in range(37):
        pace.slower()
    cycles = 0
    while not pace.at_own_pace:
        pace.faster()
        cycles += 1
    assert cycles <= round(0.8 / CYCLE) and pace.pace == 1.0 and pace.place < 500


@pytest.mark.parametrize("row", [30, 110, 170, 230])
def test_a_joint_that_brakes_at_its_limit_brakes_no_harder_for_a_pause(row: int) -> None:
    """Up to speed and down again at the limit of one joint: there is nothing left for a while."""
    units, limit = Units.of(TX40), TX40.acceleration_limits[0]
    speeds = 0.99 * limit * CYCLE * np.concatenate([np.arange(150), np.arange(150)[::-1]])
    way = np.outer(np.cumsum(speeds) * CYCLE, np.eye(6)[0])
    counts = units.counts(way)
    pace = PathPace(counts, units, TX40.acceleration_limits, CYCLE, row)
    went = [counts[row - 1].tolist(), counts[row].tolist()]
    while not pace.at_rest:
        went.append(list(pace.slower()))
    while not pace.at_own_pace:
        went.append(list(pace.faster()))
    found = np.abs(np.diff(units.position(np.array(went))[:, 0], 2)) / CYCLE**2
    assert found.max() <= 1.01 * limit + 4 / abs(units.counts_per_output_unit[0]) / CYCLE**2
