"""Streams to drives that are not the usual ones: interpolated position mode, a wide control signal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from drivers import ArmSession, Channel, Samples, StreamResult
from drivers.simulated.group import DriveGroup
from robots import ControlSignal, Robot
from tests.drivers.setup.test_setup import drives, drives_changed

CYCLES = 250


def streamed(
    robot: Robot, channel: Channel, change: Callable[[DriveGroup], None] | None = None
) -> tuple[StreamResult, Samples, DriveGroup]:
    """Out and back, with drives in a thread of this process and the master in its own."""
    batches: list[Samples] = []
    t = np.linspace(0.0, 1.0, CYCLES)[:, None]
    with drives(robot, channel, change) as group, ArmSession(robot, channel) as session:
        reference = np.array(robot.home) + 0.1 * (64 * (t * (1 - t)) ** 3)
        result = session.stream(reference, batches.append)
        assert {drive.machine.state.name for drive in group.drives} == {"SWITCH_ON_DISABLED"}
    return result, Samples.concatenate(batches), group


@pytest.fixture
def slow(tx40: Robot) -> Robot:
    """A cycle that drives in a thread beside a test can keep up with."""
    return tx40.model_copy(update={"bus": tx40.bus.model_copy(update={"cycle_time": 0.008})})


@pytest.mark.slow
def test_interpolated_position_and_a_second_tpdo_move_the_arm_as_csp_does(
    slow: Robot, new_channel: Callable[[], Channel]
) -> None:
    usual, ours, _ = streamed(slow, new_channel())
    assert (usual.outcome, usual.cycles) == ("completed", CYCLES), usual.reason

    def only_interpolated(group: DriveGroup) -> None:
        for drive in group.drives:
            drive.dictionary.set(0x6502, 0, 1 << 6)

    result, samples, group = streamed(slow, new_channel(), only_interpolated)
    assert (result.outcome, result.cycles) == ("completed", CYCLES), result.reason
    for axis, drive in enumerate(group.drives):
        last = round(float(slow.counts_per_output_unit[axis] * (slow.transmission_matrix @ slow.home)[axis]))
        assert drive.dictionary.integer(0x60C1, 1) == pytest.approx(last, abs=1000)
        assert drive.dictionary.integer(0x607A) == 0, "never written"
    good = samples.complete.all(axis=1)
    assert (samples.statusword[good] & 0x1000 == 0x1000).all(), "interpolation is active"
    np.testing.assert_array_equal(samples.reference, ours.reference)
    whole = good & ours.complete.all(axis=1)
    np.testing.assert_allclose(samples.position[whole], ours.position[whole], atol=1e-3)

    signal = ControlSignal(index=0x30D1, subindex=2, per_count=slow.drive[0].control_signal.per_count)
    wide = drives_changed(slow, control_signal=signal)
    result, samples, group = streamed(wide, new_channel())
    assert (result.outcome, result.cycles) == ("completed", CYCLES), result.reason
    assert all(drive.process_data.second_tpdo.maps(0x30D1) for drive in group.drives)
    whole = samples.complete.all(axis=1) & ours.complete.all(axis=1)
    np.testing.assert_allclose(samples.position[whole], ours.position[whole], atol=1e-3)
    # The same signal, in 32 bits of a frame of its own.
    np.testing.assert_allclose(
        samples.control_signal[whole], ours.control_signal[whole], atol=0.03 * np.ptp(ours.control_signal)
    )
    assert (samples.control_signal[whole].std(axis=0) > 0.01).all()
