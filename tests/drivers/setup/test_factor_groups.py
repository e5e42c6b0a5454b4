"""What a drive's units are, and that a motion is the one that was asked, measured at the true angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from drivers import ArmSession, Channel, DriveError
from drivers.cia402 import objects
from drivers.session.jog import jog_path
from drivers.setup.findings import Finding
from drivers.setup.units_check import compare_units, velocity_scale
from drivers.simulated.device import Device, FactorGroup
from drivers.simulated.drive import Drive
from drivers.simulated.in_process import stream_in_process
from drivers.simulated.object_dictionary import SdoAbort
from drivers.simulated.truth import PlantTruth, nominal_truth
from robots import Robot
from tests.drivers.factor_groups import consistent, spoil
from tests.drivers.setup.test_setup import drives

HOLD = 0.3
"""s at the end of a jog."""


def settings_of(drive: Drive) -> dict[str, int | None]:
    """What the set-up would read."""
    found: dict[str, int | None] = {}
    for name, (index, subindex, signed) in objects.SETTINGS.items():
        try:
            data = drive.dictionary.read(index, subindex)
        except SdoAbort:
            found[name] = None
        else:
            found[name] = int.from_bytes(data, "little", signed=signed)
    return found


def unit_findings(robot: Robot, devices: Sequence[Device]) -> list[Finding]:
    made = [Drive(robot, axis, 1, lambda cob_id, data: None, device) for axis, device in enumerate(devices)]
    return [
        finding
        for axis, drive in enumerate(made)
        for finding in compare_units(robot, axis, settings_of(drive))
    ]


def refused(robot: Robot, devices: Sequence[Device]) -> list[Finding]:
    return [finding for finding in unit_findings(robot, devices) if finding.severity == "refusal"]


def without_dry_friction(robot: Robot) -> PlantTruth:
    """An arm whose loops come to their targets soon: Coulomb friction keeps them short of it for seconds."""
    truth = nominal_truth(robot)
    smooth = {f"Fc{axis}": 1e-3 for axis in range(1, robot.n + 1)}
    return replace(truth, parameters=truth.parameters | smooth)


def jogged(robot: Robot, devices: Sequence[Device], joint: str, degrees: float) -> np.ndarray:
    """True joint motion in degrees, (n,), from the angle of the simulated motors."""
    path = jog_path(robot, np.array(robot.home), joint, np.deg2rad(degrees))
    hold = np.repeat(path[-1:], round(HOLD / robot.bus.cycle_time), axis=0)
    began: list[np.ndarray] = []
    run = stream_in_process(
        robot,
        without_dry_friction(robot),
        np.vstack([path, hold]),
        devices=devices,
        setup=lambda bus: began.append(bus.group.bench.plant.drive_position()),
    )
    assert run.result is not None and run.result.outcome == "completed", run.result
    moved = run.bus.group.bench.plant.drive_position() - began[0]
    return np.asarray(np.rad2deg(np.linalg.solve(robot.transmission_matrix, moved)))


def arm_of(robot: Robot, device: Device, **changes: object) -> tuple[Robot, tuple[Device, ...]]:
    """The arm with one kind of drive and gear everywhere, and drives made so."""
    drive = tuple(d.model_copy(update={"sign": 1, "gear": 45.0} | changes) for d in robot.drive)
    return robot.model_copy(update={"drive": drive}), (device,) * robot.n


FULL = Device(65536, 45.0, 1, FactorGroup((65536, 1), (45, 1), (65536, 1)))
TENTHS = Device(65536, 45.0, 1, FactorGroup((65536, 1), (45, 1), None, 0xFF410000, Fraction(3600)))


def test_a_feed_constant_that_the_description_does_not_know_is_refused(tx40: Robot, channel: Channel) -> None:
    """608F 65536/1, 6091 45/1, 6092 65536/1: such a joint once moved 90 degrees for a jog of 2."""
    arm, devices = arm_of(tx40, FULL, encoder_counts=65536)
    message = (
        r"joint_1 \(node 1\): 6092: the drive counts 65536 per turn of the output \(608F 65536/1, 6091 45/1, "
        r"6092 65536/1\), robot.toml says 2949120 \(encoder_counts × gear\): write "
        r"counts_per_output_turn = 65536 into robot.toml if that is so, else set 6092 of the drive to "
        r"2949120/1 \(and 5 more\)"
    )
    with (
        drives(arm, channel, devices=devices),
        pytest.raises(DriveError, match=message),
        ArmSession(arm, channel),
    ):
        pass
    told, devices = arm_of(tx40, FULL, encoder_counts=65536, counts_per_output_turn=65536.0)
    with drives(told, channel, devices=devices), ArmSession(told, channel) as session:
        assert abs(session.actual_position() - told.home).max() < 2 * np.pi / 65536
    assert jogged(told, devices, "joint_2", 2.0) == pytest.approx([0, 2, 0, 0, 0, 0], abs=0.01)


def test_a_drive_in_tenths_of_a_degree_is_refused_or_moves_what_was_asked(
    tx40: Robot, channel: Channel
) -> None:
    arm, devices = arm_of(tx40, TENTHS, encoder_counts=65536)
    message = (
        r"60A8: the drive counts 3600 per turn of the output \(60A8 0xFF410000, 608F 65536/1, 6091 45/1\)"
    )
    with (
        drives(arm, channel, devices=devices),
        pytest.raises(DriveError, match=message),
        ArmSession(arm, channel),
    ):
        pass
    told, devices = arm_of(tx40, TENTHS, encoder_counts=None, counts_per_output_turn=3600.0)
    with drives(told, channel, devices=devices), ArmSession(told, channel):
        pass
    moved = jogged(told, devices, "joint_2", 2.0)
    # The unit itself is 0.1°: where the arm stands before the jog is between two of them.
    assert moved == pytest.approx([0, 2, 0, 0, 0, 0], abs=0.1)


def test_an_encoder_as_delivered_asks_for_the_unit(tx40: Robot, channel: Channel) -> None:
    delivered = Device(65536, 45.0, 1, FactorGroup((1, 1), (1, 1), (1, 1)))
    arm, devices = arm_of(tx40, delivered, encoder_counts=65536)
    message = (
        r"608F: is 1/1 as delivered: the drive does not know its encoder; write counts_per_output_turn of "
        r"this drive into robot.toml \(2949120 if it counts its encoder\), or configure 608F in the drive"
    )
    with (
        drives(arm, channel, devices=devices),
        pytest.raises(DriveError, match=message),
        ArmSession(arm, channel),
    ):
        pass
    told, devices = arm_of(tx40, delivered, counts_per_output_turn=2949120.0)
    with drives(told, channel, devices=devices), ArmSession(told, channel) as session:
        assert any("look at the first jog" in note for note in session.drives[0].notes)
    assert jogged(told, devices, "joint_2", -2.0) == pytest.approx([0, -2, 0, 0, 0, 0], abs=0.01)


def test_a_drive_that_says_nothing_of_its_units_is_told(tx40: Robot) -> None:
    silent = Device(65536, 45.0, 1, FactorGroup())
    arm, devices = arm_of(tx40, silent, encoder_counts=65536)
    assert {(f.severity, f.subject) for f in unit_findings(arm, devices)} == {("warning", "units")}


def test_an_encoder_behind_the_gear_is_refused_until_the_gear_is_left_out(tx40: Robot) -> None:
    """608F counts turns of the output then, and robot.toml's gear would be counted twice."""
    device = Device(524288, 1.0, 1, FactorGroup((524288, 1), (1, 1)))
    arm, devices = arm_of(tx40, device, encoder_counts=None, counts_per_output_turn=524288.0, gear=32.0)
    found = refused(arm, devices)
    assert {finding.subject for finding in found} == {"608F"}
    assert all("write gear = 1: the encoder sits behind the gear" in finding.text for finding in found)
    arm, devices = arm_of(tx40, device, encoder_counts=None, counts_per_output_turn=524288.0, gear=1.0)
    assert refused(arm, devices) == []


@pytest.mark.parametrize(
    ("factors", "changes", "subject"),
    [
        (FactorGroup((65536, 1), (45, 1), (1, 1)), {}, "6092"),
        (FactorGroup((1, 1), (45, 1), (3600, 1)), {"counts_per_output_turn": 3600.0}, "608F"),
        (FactorGroup((65536, 1), (50, 1)), {}, "6091"),
        (FactorGroup((65536, 2), (45, 1)), {}, "608F"),
        (
            FactorGroup((65536, 1), (45, 1), (7200, 1), 0xFF410000, Fraction(3600)),
            {"counts_per_output_turn": 7200.0},
            "60A8",
        ),
        (FactorGroup((65536, 1), (1, 1), (3600, 1)), {"counts_per_output_turn": 3600.0}, "6092"),
        (FactorGroup((65536, 1), (45, 1), (36001, 10)), {"counts_per_output_turn": 3600.0 * 1.0002}, "6092"),
    ],
)
def test_each_contradiction_is_refused(
    tx40: Robot, factors: FactorGroup, changes: dict[str, float], subject: str
) -> None:
    described = {"encoder_counts": 65536} | changes
    arm, devices = arm_of(tx40, Device(65536, 45.0, 1, factors), **described)
    assert {finding.subject for finding in refused(arm, devices)} == {subject}


def old_settings(numerator: int, divisor: int, **others: int) -> dict[str, int | None]:
    """Of a drive with the position factor of DSP 402, version 2."""
    factors: dict[str, int | None] = {"6093:01": numerator, "6093:02": divisor}
    return {"608F:01": 1_280_000, "608F:02": 1} | factors | others


def test_an_older_drive_divides_its_increments_by_6093(tx40: Robot) -> None:
    """As electronic gears are delivered: 1 280 000 increments a turn, 128/10 of them in a unit."""
    arm, _ = arm_of(tx40, FULL, encoder_counts=1_280_000, gear=45.0)
    (found,) = (f for f in compare_units(arm, 0, old_settings(128, 10)) if f.severity == "refusal")
    assert found.subject == "6093"
    assert "counts 4500000 per turn of the output (6093 128/10, 608F 1280000/1)" in found.text
    assert "robot.toml says 57600000" in found.text and "counts_per_output_turn = 4500000" in found.text
    neutral = compare_units(arm, 0, old_settings(1, 1))
    assert not [f for f in neutral if f.severity == "refusal"], "1/1: its unit is the increment"
    told, _ = arm_of(tx40, FULL, encoder_counts=1_280_000, counts_per_output_turn=4_500_000.0, gear=45.0)
    assert not [f for f in compare_units(told, 0, old_settings(128, 10)) if f.severity == "refusal"]
    both = compare_units(told, 0, old_settings(128, 10) | {"6092:01": 3600, "6091:01": 45})
    assert [f.subject for f in both if f.severity == "refusal"] == ["6093"], "they contradict"


@pytest.mark.parametrize("unit", [0x00AC_0000, 0x00C0_0000, 0x00C1_0000, 0x0001_0000])
def test_a_unit_that_says_nothing_of_a_turn_is_not_taken_for_increments(tx40: Robot, unit: int) -> None:
    """Steps, electrical poles, inches, metres of a joint that turns: the encoder does not tell then."""
    settings: dict[str, int | None] = {"608F:01": 65536, "608F:02": 1, "60A8": unit}
    arm, _ = arm_of(tx40, FULL, encoder_counts=65536)
    (found,) = (f for f in compare_units(arm, 0, settings) if f.severity == "refusal")
    assert found.subject == "60A8" and f"60A8 0x{unit:08X} is no unit that is known here" in found.text
    told, _ = arm_of(tx40, FULL, encoder_counts=65536, counts_per_output_turn=200.0)
    assert [f.severity for f in compare_units(told, 0, settings) if f.subject == "units"] == ["warning"]


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        (0x00B44700, 65536 / 60),  # rev/min of the shaft
        (0xFDB44700, 65536 / 60_000),
        (0x00B50300, 65536 / (65536 * 45)),  # increments/s
        (0x00410300, 65536 / 360),
        (0x00990300, 1.0),  # nothing that is known
        (None, 1.0),
    ],
)
def test_the_unit_of_velocities(tx40: Robot, unit: int | None, expected: float) -> None:
    group = replace(FULL.factors, velocity_unit=unit)
    arm, devices = arm_of(tx40, replace(FULL, factors=group), counts_per_output_turn=65536.0)
    settings = settings_of(Drive(arm, 0, 1, lambda cob_id, data: None, devices[0]))
    assert velocity_scale(arm, 0, settings) == pytest.approx(expected)


def test_a_velocity_factor_is_units_per_position_unit_a_second(tx40: Robot) -> None:
    arm, _ = arm_of(tx40, FULL, counts_per_output_turn=65536.0)
    assert velocity_scale(arm, 0, {"6096:01": 60, "6096:02": 65536}) == pytest.approx(65536 / 60)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_consistent_units_move_what_was_asked(tx40: Robot, seed: int) -> None:
    """Five arms each, six drives of other kinds in each; one joint of each arm moves."""
    rng = np.random.default_rng([18, seed])
    for _ in range(5):
        arm, devices = consistent(tx40, rng)
        assert refused(arm, devices) == []
        joint = int(rng.integers(arm.n))
        degrees = float(rng.uniform(0.5, 3.0) * rng.choice([-1, 1]))
        expected = np.zeros(arm.n)
        expected[joint] = degrees
        assert jogged(arm, devices, arm.joint[joint].name, degrees) == pytest.approx(expected, abs=0.01)


def test_inconsistent_units_are_refused(tx40: Robot) -> None:
    for seed in range(200):
        rng = np.random.default_rng([19, seed])
        arm, devices = consistent(tx40, rng)
        axis = int(rng.integers(arm.n))
        wrong = (*devices[:axis], spoil(arm.drive[axis], devices[axis], rng), *devices[axis + 1 :])
        findings = refused(arm, wrong)
        assert findings, (seed, arm.drive[axis], wrong[axis])


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Channel:
    return Channel("virtual", request.node.name)
