"""Pause, stop, abort and halt, against the simulated drives in virtual time."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from drivers import Request, StreamControl
from drivers.cyclic.ring import Ring
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.fault_matrix import largest_acceleration
from drivers.simulated.in_process import InProcessRun, stream_in_process
from robots import Robot

PERIOD = 150
"""Rows."""


@pytest.fixture(scope="module")
def truth(tx40: Robot) -> PlantTruth:
    return draw_truth(tx40, 3)


def three_periods(robot: Robot) -> np.ndarray:
    """Three periods of a sine with a smooth beginning and end: the arm is in motion where they meet."""
    t = np.arange(3 * PERIOD) / PERIOD
    window = np.clip(np.minimum(t, t[-1] - t) / 0.4, 0, 1)
    window = window**3 * (10 - 15 * window + 6 * window**2)
    return np.array(robot.home) + 0.08 * (window * np.sin(2 * np.pi * t))[:, None] * np.ones(robot.n)


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


def test_a_pause_rests_at_the_end_of_a_period_and_the_record_goes_on_without_a_jump(
    tx40: Robot, truth: PlantTruth
) -> None:
    whole = stream_in_process(tx40, truth, three_periods(tx40))

    class Pausing(Ring):
        """Takes the pause back after it was looked at so often."""

        looks = 0

        def requested(self) -> Request | None:
            found = super().requested()
            if found is Request.PAUSE:
                self.looks += 1
                if self.looks == 400:
                    self.resume()
            return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("drivers.simulated.in_process.Ring", Pausing)
        done = run(tx40, truth, {150: Request.PAUSE})
    assert done.result is not None and whole.result is not None
    assert done.result.outcome == "completed"
    assert done.result.pauses == (PERIOD - 1,) or done.result.pauses == (2 * PERIOD - 1,)
    assert done.bus.syncs > whole.bus.syncs + 200
    np.testing.assert_array_equal(done.rows["target"], whole.rows["target"])
    row = done.result.pauses[0]
    before, after = done.rows["position"][row - 2 : row], done.rows["position"][row : row + 2]
    step = np.abs(after[0] - before[1]) / np.abs(tx40.counts_per_output_unit)
    assert step.max() < 0.02, "it came back to where it had been"


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
