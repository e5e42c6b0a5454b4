"""What a stream says of how it left the arm, compared with what the simulated drives know."""

from __future__ import annotations

import numpy as np
import pytest

from drivers import Request
from drivers.frames.samples import StreamResult
from drivers.simulated import Faults, draw_truth
from drivers.simulated.drive import Drive
from drivers.simulated.faults import BusOff, DeadAt, EmergencyAt, FrozenEncoder, LostFrames
from drivers.simulated.in_process import InProcessRun, stream_in_process
from robots import Robot

FAULT_AT = 150
OFF = "the arm is at rest and its torque is off"


def run(robot: Robot, faults: Faults, requests: dict[int, Request] | None = None) -> InProcessRun:
    time = np.arange(150) / 150
    reference = np.array(robot.home) + 0.05 * (1 - np.cos(2 * np.pi * time))[:, None] * np.ones(robot.n)
    return stream_in_process(robot, draw_truth(robot, 3), reference, faults, requests=requests)


def named(robot: Robot, *axes: int) -> tuple[str, ...]:
    return tuple(f"drive of joint {robot.joint[axis].name}" for axis in axes)


@pytest.mark.parametrize("request_", [None, Request.ABORT, Request.HALT])
def test_an_arm_that_was_brought_to_rest_is_said_to_be(tx40: Robot, request_: Request | None) -> None:
    done = run(tx40, Faults(), None if request_ is None else {FAULT_AT: request_})
    assert done.result is not None and not done.bus.powered
    assert (done.result.torque_unconfirmed, done.result.rest_unconfirmed) == ((), ())
    assert done.result.ending == OFF


def test_drives_that_can_still_speak_are_believed(tx40: Robot) -> None:
    node = tx40.drive[2].node_id
    for faults in (
        Faults(emergencies=(EmergencyAt(node, FAULT_AT, 0x2310),)),
        Faults(frozen_encoders=(FrozenEncoder(node, FAULT_AT),)),
    ):
        done = run(tx40, faults)
        assert done.result is not None and done.result.outcome in ("fault", "aborted")
        assert not done.bus.powered and done.result.ending == OFF


def test_a_drive_that_is_silent_is_named(tx40: Robot) -> None:
    """What it said last is out of date."""
    done = run(tx40, Faults(dead=(DeadAt(tx40.drive[2].node_id, FAULT_AT),)))
    assert done.result is not None
    assert done.result.torque_unconfirmed == done.result.rest_unconfirmed == named(tx40, 2)
    name = named(tx40, 2)[0]
    assert done.result.ending == f"NOT KNOWN to be at rest and without torque: {name}"


def test_a_drive_that_speaks_again_is_believed(tx40: Robot) -> None:
    """It was silent under torque; once switched off, its answers come again."""
    done = run(tx40, Faults(lost_tpdos=(LostFrames(tx40.drive[2].node_id, FAULT_AT, 100_000),)))
    assert done.result is not None and done.result.reason.startswith(f"no TPDO from {named(tx40, 2)[0]}")
    assert not done.bus.powered and done.result.ending == OFF


def test_without_a_bus_nothing_is_known(tx40: Robot) -> None:
    done = run(tx40, Faults(bus_off=(BusOff(FAULT_AT),)))
    assert done.result is not None and done.result.outcome == "aborted"
    everyone = named(tx40, *range(tx40.n))
    assert done.result.torque_unconfirmed == done.result.rest_unconfirmed == everyone


def test_a_drive_that_stays_up_is_named(tx40: Robot) -> None:
    """One drive takes no command any more once it has torque."""

    class Stubborn(Drive):
        def _obey(self) -> None:
            if not (self._axis == 2 and self._has_torque()):
                super()._obey()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("drivers.simulated.group.Drive", Stubborn)
        done = run(tx40, Faults(), {FAULT_AT: Request.ABORT})
    assert done.result is not None and done.result.outcome == "stopped", "the first reason counts"
    assert done.result.torque_unconfirmed == named(tx40, 2) and done.result.rest_unconfirmed == ()
    assert "NOT KNOWN to be without torque" in done.result.ending


def test_words() -> None:
    known = StreamResult("fault", "", 0, 0, 0, torque_unconfirmed=("drive 2",))
    assert known.ending == "the arm is at rest; NOT KNOWN to be without torque: drive 2"
    known = StreamResult("fault", "", 0, 0, 0, rest_unconfirmed=("drive 2", "drive 3"))
    assert known.ending == "torque is off; NOT KNOWN to be at rest: drive 2, drive 3"
    assert StreamResult("completed", "", 0, 0, 0).ending == OFF
