"""The figures of a stream under way, and how they look."""

from __future__ import annotations

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from daq.session.keyboard import help_lines
from daq.session.live_figures import LiveFigures
from daq.session.live_view import LiveView
from daq.session.states import Conduct, SessionState
from drivers import Samples, StreamResult
from drivers.frames.job import following_error_window
from robots import Robot
from tests.daq.captures import samples
from tests.daq.session.motions import there_and_back


@pytest.fixture
def batch(tx40: Robot) -> Samples:
    return samples(0, 100, tx40.n, tx40.bus.cycle_time)


def test_before_the_first_sample(tx40: Robot) -> None:
    figures = LiveFigures(tx40).now()
    assert figures.cycle == -1 and figures.missed == 0 and np.isnan(figures.cycle_time)


def test_figures_are_those_of_the_samples(tx40: Robot, batch: Samples) -> None:
    live = LiveFigures(tx40)
    live.add(batch)
    figures = live.now()
    torque = tx40.joint_torque(batch.control_signal)
    assert figures.cycle == 99
    assert np.array_equal(figures.position, batch.position[-1])
    assert np.array_equal(figures.torque, torque[-1])
    assert np.array_equal(figures.torque_peak, np.abs(torque).max(axis=0))
    error = batch.reference[-1] - batch.position[-1]
    assert np.array_equal(figures.following_error, error)
    window = following_error_window(tx40, tx40.bus.cycle_time)
    assert figures.following_error_share == pytest.approx(np.abs(tx40.transmission_matrix @ error) / window)
    assert figures.torque_limit == pytest.approx([joint.torque for joint in tx40.joint])


def test_missed_and_late_are_counted_from_the_start_and_the_cycle_over_a_second(tx40: Robot) -> None:
    period, live = tx40.bus.cycle_time, LiveFigures(tx40)
    count = round(1.0 / period)
    first = samples(0, count, tx40.n, period)
    lateness, complete = np.zeros(count), first.complete.copy()
    lateness[10], lateness[20], lateness[30] = 0.9 * period, 1.2 * period, 3.5 * period
    complete[5, 2] = complete[6, 0] = complete[6, 1] = False
    live.add(replace(first, lateness=lateness, complete=complete))
    figures = live.now()
    assert (figures.missed, figures.incomplete) == (4, 2)
    assert figures.longest_cycle == pytest.approx(4.5 * period)
    live.add(replace(samples(count, count, tx40.n, period), lateness=np.zeros(count)))
    figures = live.now()
    assert (figures.missed, figures.incomplete, figures.cycle) == (4, 2, 2 * count - 1)
    assert figures.cycle_time == pytest.approx(period) == figures.longest_cycle


@pytest.mark.parametrize("width", [100, 80])
def test_the_picture_shows_every_joint_and_the_keys(tx40: Robot, batch: Samples, width: int) -> None:
    console = Console(width=width, file=StringIO(), record=True, force_terminal=True)
    view, conduct = LiveView(console, tx40), Conduct()
    view.begin("First motion", there_and_back(tx40), conduct)
    conduct.begin()
    view.samples(batch)
    console.print(view.picture())
    view.end(StreamResult("completed", "", 100, 0, 0))
    text = console.export_text()
    figures = LiveFigures(tx40)
    figures.add(batch)
    for axis, joint in enumerate(tx40.joint):
        line = next(line for line in text.splitlines() if f"{joint.name} " in line and "rad" in line)
        assert f"{figures.now().position[axis]:+.4f} rad" in line
        assert f"{figures.now().torque[axis]:+.2f} N·m" in line
    assert "running" in text and "First motion" in text
    assert "p pause now  e pause after this pass  s stop after this pass  a end now" in text
    assert "…" not in text.replace("0.4 s …", ""), "no number is cut off"


def test_the_picture_in_the_docs_shows_the_keys_of_today() -> None:
    """``benchmarks/live_view_picture.py`` makes it anew."""
    picture = Path(__file__).parents[3] / "docs" / "images" / "live-view.svg"
    shown = "".join(re.findall(r">([^<]*)</text>", picture.read_text(encoding="utf-8"))).replace(
        "&#160;", " "
    )
    assert help_lines(SessionState.RUNNING, 1000)[0] in shown


def test_a_pipe_gets_two_lines(tx40: Robot, batch: Samples) -> None:
    out = StringIO()
    view = LiveView(Console(file=out, width=100), tx40)
    trajectory = there_and_back(tx40)
    view.begin("Run", trajectory, Conduct())
    view.samples(batch)
    view.end(StreamResult("stopped", "by the operator, key s, at the end of the period", 100, 3, 0))
    assert out.getvalue().splitlines() == [
        f"Run: {trajectory.duration:.1f} s …",
        "Run: stopped (by the operator, key s, at the end of the period); 100 of 103 cycles (3 deadlines"
        " missed); the arm is at rest and its torque is off",
    ]
