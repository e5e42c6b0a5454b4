"""The course of a parameter: noise looks like noise, a step like a step, and no two labels are the same."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from daq.catalogue.values import Course
from daq.service.trends import axis_of, time_ticks, trend_of

START = datetime(2026, 3, 1, 2, 30, tzinfo=UTC)


def course_of(values: list[float], sigma: float, apart: timedelta = timedelta(days=1)) -> Course:
    """One run each, so far apart."""
    at = tuple(START + k * apart for k in range(len(values)))
    numbers = np.arange(len(values)) + 1
    seconds = np.array([time.timestamp() for time in at])
    sigmas = np.full(len(values), sigma)
    return Course("Fc2", "N·m", numbers, numbers, at, seconds, np.array(values), sigmas)


def number(label: str) -> float:
    """Of a label such as ``−3.2·10⁻⁵``."""
    mantissa, _, power = label.translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")).partition("·10")
    return float(f"{mantissa}e{power or 0}")


def heights(picture: str) -> list[float]:
    line = re.search(r'<polyline class="line" points="([^"]*)"', picture)
    assert line is not None
    return [float(pair.split(",")[1]) for pair in line[1].split()]


def wide(picture: str) -> str:
    return next(part for part in picture.split("</svg>") if 'class="trend wide"' in part)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e5])
def test_flat_noise_stays_flat_and_a_step_does_not(scale: float) -> None:
    rng = np.random.default_rng(0)
    noise = scale * (20.0 + 0.01 * rng.normal(size=60))
    flat = heights(wide(str(trend_of(course_of(noise.tolist(), 0.01 * scale), None).picture)))
    assert max(flat) - min(flat) < 0.15 * 224  # of 260 without the margins
    noise[30:] *= 1.2
    step = heights(wide(str(trend_of(course_of(noise.tolist(), 0.01 * scale), None).picture)))
    assert max(step) - min(step) > 0.7 * 224


def test_noise_of_a_parameter_near_zero_is_flat_by_its_sigma() -> None:
    rng = np.random.default_rng(1)
    noise = 0.3 * rng.normal(size=60)
    low, high = axis_of(noise, np.full(60, 0.3), None)
    assert (high - low) > 3.5 * np.ptp(noise)
    assert axis_of(np.zeros(3), np.zeros(3), None) == (-1.0, 1.0)
    assert axis_of(noise, np.full(60, 0.3), (-9.0, 9.0))[1] > 9.0


@pytest.mark.parametrize("value", [95.1, 203.5, -3.2e-5, 1e6, 0.0])
@pytest.mark.parametrize(
    "apart", [timedelta(minutes=3), timedelta(hours=7), timedelta(days=1), timedelta(days=40)]
)
def test_labels_of_an_axis_differ_and_lie_where_they_say(value: float, apart: timedelta) -> None:
    course = [value * (1 + 1e-4 * k) for k in range(30)]
    picture = str(trend_of(course_of(course, abs(value) * 1e-5, apart), None).picture)
    for kind, height in (("wide", 260), ("narrow", 210)):
        one = next(part for part in picture.split("</svg>") if f'class="trend {kind}"' in part)
        texts = re.findall(r'<text x="([0-9.]+)" y="([0-9.]+)" text-anchor="\w+">([^<]*)</text>', one)
        vertical = [(float(y), text) for _, y, text in texts if float(y) != height - 6]
        across = [(float(x), text) for x, y, text in texts if float(y) == height - 6]
        assert len(vertical) >= 3 and len(across) >= 1
        for labels in (vertical, across):
            assert len({text for _, text in labels}) == len(labels) == len({at for at, _ in labels}), labels
        places, numbers = (
            np.array([y for y, _ in vertical]),
            np.array([number(t) for _, t in vertical]),
        )
        slope = np.polyfit(numbers, places, 1)
        np.testing.assert_allclose(np.polyval(slope, numbers), places, atol=0.2)  # the axis is a line


def test_times_have_as_many_labels_as_there_is_room_for() -> None:
    for days in (0, 0.02, 0.5, 3, 40, 400, 4000):
        for most in (2, 6):
            ticks = time_ticks(START, START + timedelta(days=days), most)
            assert 1 <= len(ticks) <= most + 1, (days, ticks)
            assert all(START <= time <= START + timedelta(days=days) for time, _ in ticks)


def test_no_label_lies_behind_the_last_run() -> None:
    """Two runs within seconds, the next whole minute less than a second after: the label was cut off."""
    first = START.replace(second=57)
    last = first + timedelta(seconds=2.4)
    assert [time for time, _ in time_ticks(first, last, 6)] == [first]


def test_each_run_has_its_sigma() -> None:
    picture = wide(str(trend_of(course_of([1.0, 1.1, 1.2], 0.05), None).picture))
    bars = re.search(r'<path class="sigma" d="([^"]*)"', picture)
    assert bars is not None
    found = [(float(a), float(b)) for a, b in re.findall(r"M[0-9.]+ ([0-9.]+)V([0-9.]+)", bars[1])]
    assert len(found) == 3 and all(
        b - a == pytest.approx(2 * 0.05 / 0.1 * (heights(picture)[0] - heights(picture)[1]), rel=0.05)
        for a, b in found
    )
