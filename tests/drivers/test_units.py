from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drivers import DriveError
from drivers.frames.layout import MappedObject, tpdo_layouts, tpdo_objects
from drivers.frames.units import Units
from robots import Robot
from robots.description import VelocityObject

FACTORS = st.floats(1.0, 1e6) | st.floats(-1e6, -1.0)


@st.composite
def some_units(draw: st.DrawFn) -> Units:
    n = draw(st.integers(1, 6))
    lower = np.tril(draw(arrays(float, (n, n), elements=st.floats(-1, 1))), -1)
    diagonal = np.diag(draw(arrays(float, n, elements=st.sampled_from([-1.0, 0.5, 1.0, 2.0]))))
    counts = draw(arrays(float, n, elements=FACTORS))
    return Units(lower + diagonal, counts, np.full(n, 0.01), tuple(f"j{i}" for i in range(n)))


@given(some_units(), st.data())
def test_counts_survive_the_way_to_joints_and_back(units: Units, data: st.DataObject) -> None:
    n = len(units.joints)
    counts = data.draw(arrays(np.int32, (3, n), elements=st.integers(-(2**31) + 2, 2**31 - 3)))
    back = units.counts(units.position(counts))
    # 32 lower-triangular steps of rounding stay far below one count.
    assert np.abs(back.astype(np.int64) - counts).max() <= 1


@given(some_units(), st.data())
def test_joints_survive_the_way_to_counts_within_a_count(units: Units, data: st.DataObject) -> None:
    q = data.draw(arrays(float, len(units.joints), elements=st.floats(-3, 3)))
    error = units.position(units.counts(q)) - q
    assert np.all(np.abs(units.transmission @ error * units.counts_per_output_unit) <= 0.5 + 1e-6)


def test_tx40_wrist_is_coupled(tx40: Robot) -> None:
    units = Units.of(tx40)
    counts = units.counts(np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0]))
    assert counts[4] != 0 and counts[5] != 0
    np.testing.assert_allclose(
        counts, tx40.transmission_matrix @ [0, 0, 0, 0, 0.1, 0] * tx40.counts_per_output_unit, atol=0.5
    )


def test_positions_outside_32_bits_are_refused(tx40: Robot) -> None:
    units = Units.of(tx40)
    with pytest.raises(DriveError, match=r"drive 2 \(joint_2\) does not fit into 32-bit counts"):
        units.counts([[0.0, 1e6, 0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(DriveError, match="does not fit"):
        units.counts([[0.0, np.nan, 0.0, 0.0, 0.0, 0.0]])


def plain(*counts_per_unit: float) -> Units:
    """Drives that each move their own joint."""
    n = len(counts_per_unit)
    return Units(np.eye(n), np.array(counts_per_unit), np.full(n, 0.25), tuple(f"j{k + 1}" for k in range(n)))


def test_the_32_bits_end_where_they_end() -> None:
    units = plain(1.0, 1.0)
    ends = np.array([[2**31 - 1, -(2**31)], [-(2**31), 2**31 - 1]])
    assert units.counts(ends).tolist() == ends.tolist()
    assert units.counts(ends).dtype == np.int32
    for q, drive in (([2.0**31, 0.0], 1), ([0.0, -(2.0**31) - 1], 2)):
        with pytest.raises(DriveError, match=rf"drive {drive} \(j{drive}\).*: -2147483648 to 2147483647$"):
            units.counts(q)
    with pytest.raises(DriveError, match="drive 3"):
        plain(1.0, 1.0, 1.0).counts([0.0, 0.0, 3e9])


def test_counts_are_the_nearest_and_signals_scale_by_count() -> None:
    units = plain(-10.0, 4.0)
    assert units.counts([[0.26, 0.4], [-0.24, -0.3]]).tolist() == [[-3, 2], [2, -1]]
    np.testing.assert_allclose(units.position([[-3, 2]]), [[0.3, 0.5]], rtol=1e-15)
    np.testing.assert_allclose(units.control_signal(np.array([[8, -2]])), [[2.0, -0.5]], rtol=1e-15)


def test_the_largest_motion_of_a_drive_takes_both_joints_at_their_worst() -> None:
    coupled = Units(np.array([[1.0, 0.0], [-2.0, 3.0]]), np.ones(2), np.ones(2), ("a", "b"))
    np.testing.assert_allclose(coupled.output_span(np.array([0.5, 0.25])), [0.5, 1.75], rtol=1e-15)


def test_without_velocity_objects_no_velocity_is_known() -> None:
    found = plain(10.0, 4.0).velocity(np.zeros((3, 2)))
    assert found.shape == (3, 2) and np.isnan(found).all()


@given(st.integers(0, 0xFFFF), st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1))
def test_layout_is_little_endian_without_gaps(status: int, position: int, signal: int) -> None:
    data = tpdo_layouts(16)[0].pack(status, position, signal)
    assert data[:2] == status.to_bytes(2, "little")
    assert data[2:6] == position.to_bytes(4, "little", signed=True)
    assert data[6:] == signal.to_bytes(2, "little", signed=True)


def test_mapping_words_and_the_room_in_a_tpdo() -> None:
    words = [[e.word for e in entries] for entries in tpdo_objects(MappedObject(0x6077, 0, 16))]
    assert words == [[0x60410010, 0x60640020, 0x60770010]]
    words = [[e.word for e in entries] for entries in tpdo_objects(MappedObject(0x30D1, 2, 32))]
    assert words == [[0x60410010, 0x60640020], [0x30D10220]], "a second one where the first is full"
    assert [layout.size for layout in tpdo_layouts(32)] == [6, 4]
    velocity = MappedObject(0x606C, 0, 32)
    words = [[e.word for e in entries] for entries in tpdo_objects(MappedObject(0x6077, 0, 16), velocity)]
    assert words == [[0x60410010, 0x60640020, 0x60770010], [0x606C0020]]
    assert [layout.size for layout in tpdo_layouts(16, 32)] == [8, 4]
    words = [[e.word for e in entries] for entries in tpdo_objects(MappedObject(0x30D1, 2, 32), velocity)]
    assert words == [[0x60410010, 0x60640020], [0x30D10220, 0x606C0020]]
    assert [layout.size for layout in tpdo_layouts(32, 32)] == [6, 8]
    with pytest.raises(DriveError, match="velocity object 606C:00 has 64 bits; allowed: 8, 16, 32"):
        tpdo_objects(MappedObject(0x6077, 0, 16), MappedObject(0x606C, 0, 64))
    with pytest.raises(DriveError, match="30D1:02 has 24 bits; allowed: 8, 16, 32"):
        tpdo_objects(MappedObject(0x30D1, 2, 24))


def test_velocities_go_the_way_of_positions(tx40: Robot) -> None:
    """In rev/min of the motor, signs, gears and the coupled wrist as for positions."""
    rate = np.array([0.3, -1.2, 0.7, 2.0, -0.4, 1.1])
    per_minute = tuple(VelocityObject(counts_per_second=d.encoder_counts / 60) for d in tx40.drive)
    told = with_velocity(tx40, per_minute)
    motors = tx40.transmission_matrix @ rate * tx40.counts_per_output_unit
    raw = motors / [v.counts_per_second for v in per_minute]
    np.testing.assert_allclose(Units.of(told).velocity(raw), rate, rtol=1e-12)
    # Joint 6 is moved by the drives of joints 5 and 6.
    some = Units.of(with_velocity(tx40, (*per_minute[:4], None, per_minute[5]))).velocity(raw)
    np.testing.assert_allclose(some[:4], rate[:4], rtol=1e-12)
    assert np.isnan(some[4:]).all()
    assert np.isnan(Units.of(tx40).velocity(raw)).all()


def with_velocity(robot: Robot, velocities: Sequence[VelocityObject | None]) -> Robot:
    pairs = zip(robot.drive, velocities, strict=True)
    return robot.model_copy(update={"drive": tuple(d.model_copy(update={"velocity": v}) for d, v in pairs)})
