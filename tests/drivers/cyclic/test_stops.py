"""Pause, stop, abort and halt, against the simulated drives in virtual time."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from benchmarks.fault_cases import largest_acceleration
from drivers import Request, StreamControl
from drivers.frames.ring import Ring
from drivers.frames.units import Units
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.in_process import InProcessRun, stream_in_process
from robots import Robot

PERIOD = 150
"""Rows."""


@pytest.fixture(scope="module")
def truth(tx40: Robot) -> PlantTruth:
    return draw_truth(tx40, 3)


def three_periods(robot: Robot) -> np.ndarray:
    """Three periods of a sine with a smooth beginning and end: the arm is in motion where they meet."""
    return at_row(robot, np.arange(3.0 * PERIOD))


def at_row(robot: Robot, row: np.ndarray) -> np.ndarray:
    """The same motion at any time, in rows."""
    t = row / PERIOD
    window = np.clip(np.minimum(t, 3 - 1 / PERIOD - t) / 0.4, 0, 1)
    window = window**3 * (10 - 15 * window + 6 * window**2)
    return np.array(robot.home) + 0.08 * window[:, None] * np.sin(2 * np.pi * t[:, None] + np.arange(robot.n))


def run(robot: Robot, truth: PlantTruth, requests: dict[int, Request], **options: object) -> InProcessRun:
    return stream_in_process(
        robot,
        truth,
        three_periods(robot),
        requests=requests,
        period_ends=(PERIOD, 2 * PERIOD),
        **options,  # type: ignore[arg-type]
    )


def test_stop_finishes_the_period_and_then_ramps_down(tx40: Robot, truth: PlantTruth) -> None:
    done = run(tx40, truth, {200: Request.STOP})
    assert done.result is not None
    assert (done.result.outcome, done.result.reason) == (
        "stopped",
        "stop requested: the period was finished",
    )
    end = done.result.cycles
    first_end = PERIOD if end < 2 * PERIOD else 2 * PERIOD
    assert first_end < end < first_end + 40, "the ramp follows the end of a period"
    assert largest_acceleration(tx40, done) <= 1.0
    assert not done.bus.powered


def test_abort_ramps_down_at_once(tx40: Robot, truth: PlantTruth) -> None:
    done = run(tx40, truth, {200: Request.ABORT}, measure_from=200)
    assert done.result is not None and done.result.outcome == "stopped"
    assert done.cycles_to_rest is not None and done.cycles_to_rest < 60
    assert done.result.cycles % PERIOD > 1
    assert largest_acceleration(tx40, done) <= 1.0
    np.testing.assert_array_equal(done.rows["target"][-1], done.rows["target"][-2])


def test_halt_is_the_drives_own_quick_stop(tx40: Robot, truth: PlantTruth) -> None:
    done = run(tx40, truth, {200: Request.HALT}, measure_from=200)
    assert done.result is not None
    assert (done.result.outcome, done.result.reason) == ("stopped", "halt requested")
    states = set((done.rows["statusword"] & 0x6F).ravel().tolist())
    assert 0x07 in states, "quick stop active was seen"
    assert done.cycles_to_rest is not None and done.cycles_to_rest < 60
    assert not done.bus.powered


@pytest.mark.parametrize("option", [1, 2, 5, 6])
def test_halt_ends_disabled_whatever_605a_says(tx40: Robot, truth: PlantTruth, option: int) -> None:
    from drivers.simulated.drive import Drive

    class Changed(Drive):
        def _start(self) -> None:
            super()._start()
            self.dictionary.set(0x605A, 0, option)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("drivers.simulated.group.Drive", Changed)
        done = run(tx40, truth, {200: Request.HALT})
    assert done.result is not None and done.result.reason == "halt requested"
    assert not done.bus.powered


class Pausing(Ring):
    """Takes the pause back after it was looked at so often."""

    looks = 0
    patience = 600

    def requested(self) -> Request | None:
        found = super().requested()
        if found in (Request.PAUSE, Request.PAUSE_AFTER):
            type(self).looks += 1
            if self.looks == self.patience:
                self.resume()
        return found


def paused(robot: Robot, truth: PlantTruth, when: int, request: Request, patience: int = 600) -> InProcessRun:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Pausing, "looks", 0)
        patch.setattr(Pausing, "patience", patience)
        patch.setattr("drivers.simulated.in_process.Ring", Pausing)
        return run(robot, truth, {when: request})


def away_from_the_path(robot: Robot, targets: np.ndarray) -> float:
    """The largest distance, in counts, of any target from the motion as it is in continuous time."""
    units = Units.of(robot)

    def distance(row: float, target: np.ndarray) -> float:
        there = at_row(robot, np.array([row]))[0]
        exact = units.transmission @ there * units.counts_per_output_unit
        return float(np.abs(exact - target).max())

    worst, row = 0.0, 0.0
    for target in targets:
        found = minimize_scalar(
            distance, bounds=(row - 0.6, row + 1.6), args=(target,), options={"xatol": 1e-7}, method="bounded"
        )
        worst, row = max(worst, found.fun), found.x
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("when", [60, 137, 200, 291, 333, 410])
def test_a_pause_is_a_ramp_along_the_path_and_goes_on_from_there(
    tx40: Robot, truth: PlantTruth, when: int
) -> None:
    whole = stream_in_process(tx40, truth, three_periods(tx40))
    done = paused(tx40, truth, when, Request.PAUSE)
    assert done.result is not None and whole.result is not None
    assert done.result.outcome == "completed", done.result.reason
    targets, reference = done.rows["target"], whole.rows["target"]
    (rest,) = done.result.pauses
    np.testing.assert_array_equal(targets[rest - 1], targets[rest])
    np.testing.assert_array_equal(targets[rest - 2], targets[rest])
    assert largest_acceleration(tx40, done) <= 1.0
    assert away_from_the_path(tx40, targets) < 2.5
    # Until the pause and from the ramp on row by row as planned; between them no longer than it takes.
    same = (targets[: len(reference)] == reference[: len(targets)]).all(axis=1)
    begun = int(np.argmin(same))
    more = len(targets) - len(reference)
    assert 0 < begun < rest <= begun + round(0.8 / tx40.bus.cycle_time), "at rest within 0.8 s"
    on = rest + round(0.8 / tx40.bus.cycle_time)
    np.testing.assert_array_equal(targets[on:], reference[on - more :])
    # The record leaves out the time at rest, and where the arm was before it, it is after it.
    assert done.bus.syncs > len(targets) + 300
    before, after = done.rows["position"][rest - 1], done.rows["position"][rest]
    assert (np.abs(after - before) / np.abs(tx40.counts_per_output_unit)).max() < 0.005


def test_a_pause_after_the_period_begins_where_it_ends(tx40: Robot, truth: PlantTruth) -> None:
    whole = stream_in_process(tx40, truth, three_periods(tx40))
    done = paused(tx40, truth, 120, Request.PAUSE_AFTER)
    assert done.result is not None and done.result.outcome == "completed"
    begun = int(np.argmin((done.rows["target"][: len(whole.rows)] == whole.rows["target"]).all(axis=1)))
    assert begun in (PERIOD, 2 * PERIOD), "not before the period is over"
    (rest,) = done.result.pauses
    assert begun < rest < begun + 200
    assert away_from_the_path(tx40, done.rows["target"]) < 2.5


def test_after_the_period_means_the_next_one_once_the_arm_goes_on(tx40: Robot, truth: PlantTruth) -> None:
    whole = stream_in_process(tx40, truth, three_periods(tx40))

    class Again(Pausing):
        """Asks for the end of the period once more while it speeds up from the pause."""

        def requested(self) -> Request | None:
            found = super().requested()
            type(self).looks += found is None and self.looks >= 600
            if self.looks == 610:
                self.request(Request.PAUSE_AFTER)
            elif self.looks == 1500:
                self.resume()
            return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Pausing, "looks", 0)
        patch.setattr("drivers.simulated.in_process.Ring", Again)
        done = run(tx40, truth, {120: Request.PAUSE_AFTER})
    assert done.result is not None and done.result.outcome == "completed"
    first, second = done.result.pauses
    row = whole.rows["target"].tolist().index(done.rows["target"][first + 130].tolist())
    assert second - first > 2 * PERIOD - row, "not while it speeds up, but where the next period ends"


@pytest.mark.slow
@pytest.mark.parametrize("patience", [1, 7, 40, 90])
def test_a_pause_that_is_taken_back_on_the_way_leaves_no_gap(
    tx40: Robot, truth: PlantTruth, patience: int
) -> None:
    whole = stream_in_process(tx40, truth, three_periods(tx40))
    done = paused(tx40, truth, 200, Request.PAUSE, patience)
    assert done.result is not None and done.result.outcome == "completed"
    assert done.result.pauses == () and largest_acceleration(tx40, done) <= 1.0
    assert away_from_the_path(tx40, done.rows["target"]) < 2.5
    np.testing.assert_array_equal(done.rows["target"][-20:], whole.rows["target"][-20:])


@pytest.mark.parametrize("request_", [Request.STOP, Request.ABORT, Request.HALT])
def test_every_other_request_ends_a_pause(tx40: Robot, truth: PlantTruth, request_: Request) -> None:
    done = run(tx40, truth, {100: Request.PAUSE, 500: request_})
    assert done.result is not None and done.result.outcome == "stopped"
    assert done.bus.syncs > 500
    assert not done.bus.powered
    worst = largest_acceleration(tx40, done)
    assert worst <= 1.0, "the record has no row that does not follow from the one before"


def test_requests_come_from_any_thread_and_the_most_urgent_one_rules() -> None:
    control = StreamControl()
    ring = Ring.create(1, 4)
    try:
        control.pause()
        control.attach(ring)
        assert ring.requested() is Request.PAUSE
        control.resume()
        assert ring.requested() is None
        threads = [
            threading.Thread(target=ask) for ask in (control.pause, control.stop, control.halt, control.abort)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert ring.requested() is Request.HALT
        assert control.reason == "halt requested"
        control.resume()
        assert ring.requested() is Request.HALT, "only a pause can be taken back"
    finally:
        control.detach()
        ring.close()
    control.abort("after the end")


def test_an_event_means_abort() -> None:
    event = threading.Event()
    control = StreamControl(event)
    control.poll()
    assert control.reason is None
    event.set()
    control.poll()
    assert control.reason == "stop requested"


def test_brakes_have_their_time(tx40: Robot, truth: PlantTruth) -> None:
    slow = {"brake": tx40.drive[0].brake.model_copy(update={"release": 0.2, "engage": 0.12})}
    robot = tx40.model_copy(update={"drive": tuple(d.model_copy(update=slow) for d in tx40.drive)})
    quick = stream_in_process(tx40, truth, three_periods(tx40))
    done = stream_in_process(robot, truth, three_periods(tx40))
    assert done.result is not None and done.result.outcome == "completed", done.result
    # 0.2 s before and 0.12 s after, twice: in the drives themselves, and in the master that holds still.
    assert done.bus.syncs - quick.bus.syncs >= (0.2 + 0.12) / tx40.bus.cycle_time
    assert not done.bus.powered
