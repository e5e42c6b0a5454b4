"""Kinds of drives that differ from the standard: configured, and right in motion, or refused in one line."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from drivers import ArmSession, Channel, DriveError
from drivers.cyclic.cycle import receive_seconds
from drivers.setup.profiles import choose_profile, known_profiles
from drivers.setup.profiles.profile import Profile, StartUpWrite
from drivers.simulated import SimulatedArm
from drivers.simulated.device import described_devices
from drivers.simulated.quirks import KINDS, Quirks
from robots import Robot
from robots.description import ControlSignal, Drive
from tests.drivers.cyclic.test_loop import run, stream_job
from tests.drivers.fake_arm import FakeArm
from tests.drivers.setup.test_factor_groups import without_dry_friction
from tests.drivers.setup.test_setup import drives

FINE = {
    "fixed_cob_ids": "1400: the COB-ID is fixed, 0x201: used as it is",
    "fixed_mapping": "1A00: the mapping is used as it is",
    "immediate_rpdos": "1400: transmission type 255: set-points act as they come",
    "no_heartbeat_consumer": "1016: absent: the drive notices a lost master by its RPDO deadline only",
    "one_slot": "",
    "eight_tpdos": "",
    "interpolated_only": "6502: no csp: interpolated position mode is used",
    "absent_08000000": "6007: absent",
    "absent_06010000": "6007: absent",
    "absent_06040043": "6007: absent",
    "unsized": "",
    "sync_period_fixed": "1006: the drive expects a SYNC every 10000 µs, bus.cycle_time is 4000 µs",
    "period_fixed": "",
    "period_power_fixed": "",
    "mode_fixed": "",
    "rpdo_type_fixed": "",
    "abort_option_fixed": "6007: the drive takes no fault as abort option, it has 2 now",
}
"""Configured without a word in robot.toml; with what is noted."""
REFUSED = {
    "no_interpolation_period": r"writing 0x4 to 60C2:01: the drive refuses: the object does not exist",
    "node_guarding_only": r"1016: no heartbeat consumer \(absent\) and no RPDO deadline .* \(node guarding",
    "one_rpdo_slot": r"no RPDO can carry 6040:00 and 607A:00 alone \(1600: 6040:00\): map both into one",
    "no_torque": r"reading 6077:00: the drive refuses: the (object|subindex) does not exist",
    "mode_shown_late": r"mode 8 \(csp\) was set but 6061 shows 0",
}
"""Until robot.toml or a profile says otherwise."""


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Channel:
    return Channel("virtual", request.node.name)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FINE)
def test_a_drive_that_says_it_by_itself_is_configured(tx40: Robot, channel: Channel, kind: str) -> None:
    made = described_devices(tx40, KINDS[kind])
    with drives(tx40, channel, devices=made) as group, ArmSession(tx40, channel) as session:
        assert any(FINE[kind] in str(finding) for finding in session.drives[0].findings)
        for drive, link in zip(group.drives, session._connection.links(), strict=True):
            sending = {pdo.cob_id for pdo in drive.process_data.tpdos if pdo.valid}
            assert sending == {pdo.cob_id for pdo in link.transmitted()}, "nothing else loads the bus"
            fields = [field for pdo in link.transmitted() for field in pdo.fields]
            assert fields == ["statusword", "position", "control_signal"]
            assert drive.process_data.rpdo.cob_id == link.rpdo_cob_id and drive.process_data.rpdo.valid
        session.bus_budget().check()


def test_tpdos_that_cannot_be_switched_off_are_emptied(tx40: Robot, channel: Channel) -> None:
    """As the file of the Elmo SimplIQ has it: four TPDOs on fixed ids, with mappings that can be written."""
    made = described_devices(tx40, KINDS["fixed_cob_ids_four_tpdos"])
    with drives(tx40, channel, devices=made) as group, ArmSession(tx40, channel) as session:
        assert all(link.idle_tpdos == () for link in session._connection.links())
        session.bus_budget().check()
        for drive in group.drives:
            on = [pdo for pdo in drive.process_data.tpdos if pdo.valid]
            assert len(on) > 1 and [bool(pdo.pack()) for pdo in on] == [True] + [False] * (len(on) - 1)


@pytest.mark.parametrize("kind", REFUSED)
def test_a_drive_that_cannot_be_used_so_is_refused_in_one_line(
    tx40: Robot, channel: Channel, kind: str
) -> None:
    made = described_devices(tx40, KINDS[kind])
    with (
        drives(tx40, channel, devices=made),
        pytest.raises(DriveError, match=rf"joint_1 \(node 1\): {REFUSED[kind]}"),
        ArmSession(tx40, channel),
    ):
        pass


def of_profile(robot: Robot, profile: Profile, monkeypatch: pytest.MonkeyPatch, **changes: object) -> Robot:
    monkeypatch.setitem(known_profiles(), profile.name, profile)
    drive: tuple[Drive, ...] = tuple(
        d.model_copy(update={"profile": profile.name} | changes) for d in robot.drive
    )
    return robot.model_copy(update={"drive": drive})


NEEDS = {
    "no_interpolation_period": Profile("own", "", interpolation_period=False),
    "mode_shown_late": Profile("own", "", mode_shown_when_enabled=True),
    "needs_sync_period": Profile("own", "", sync_period=True),
    "locked": Profile("own", "", startup=(StartUpWrite(0x2F00, 0, 16, 1, "it unlocks set-points"),)),
    "warns_when_enabled": Profile("own", "", warnings=frozenset({0xFF01})),
}


@pytest.mark.parametrize("kind", NEEDS)
def test_a_profile_says_what_the_drive_does_not(
    tx40: Robot, channel: Channel, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = of_profile(tx40, NEEDS[kind], monkeypatch)
    made = described_devices(arm, KINDS[kind])
    with drives(arm, channel, devices=made) as group, ArmSession(arm, channel) as session:
        assert session.drives[0].profile.name == "own"
        assert all(link.warnings == NEEDS[kind].warnings for link in session._connection.links())
        session._connection.refuse_restarted()
        for drive in group.drives:
            assert not KINDS[kind].holds_set_points(drive.dictionary)


def test_the_page_writes_a_profile_that_works(
    tx40: Robot, channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The two blocks of docs/how-to/new-drive.md, as somebody would copy them."""
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "new-drive.md").read_text("utf-8")
    profile, kind = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    found: dict[str, Any] = {"KINDS": {}, "Quirks": Quirks}
    exec(profile, found)
    exec(kind, found)
    acme = found["PROFILE"]
    arm = of_profile(tx40, acme, monkeypatch)
    assert choose_profile(None, acme.vendor, 1).name == "acme_servo"
    made = described_devices(arm, found["KINDS"]["acme_servo"])
    with drives(arm, channel, devices=made) as group:
        assert all(made[0].quirks.holds_set_points(drive.dictionary) for drive in group.drives)
        with ArmSession(arm, channel) as session:
            assert all(link.warnings == {0xFF01} for link in session._connection.links())
            assert not any(made[0].quirks.holds_set_points(drive.dictionary) for drive in group.drives)


def test_a_start_up_write_that_is_refused_says_who_wants_it(
    tx40: Robot, channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = of_profile(tx40, NEEDS["locked"], monkeypatch)
    message = r"writing 0x1 to 2F00:00: .*does not exist.*; profile own needs it: it unlocks set-points"
    with drives(arm, channel), pytest.raises(DriveError, match=message), ArmSession(arm, channel):
        pass


def test_a_mapping_that_is_fixed_and_lacks_the_set_point_is_refused(tx40: Robot, channel: Channel) -> None:
    made = described_devices(tx40, Quirks(fixed_mapping=True, modes=1 << 6))
    message = r"no RPDO can carry 6040:00 and 60C1:01 alone \(1600: 6040:00 607A:00\): map both into one"
    with (
        drives(tx40, channel, devices=made),
        pytest.raises(DriveError, match=message),
        ArmSession(tx40, channel),
    ):
        pass


def test_no_torque_object_but_a_makers_own(tx40: Robot, channel: Channel) -> None:
    signal = ControlSignal(index=0x2022, subindex=0, per_count=0.0005)
    drive = tuple(d.model_copy(update={"control_signal": signal}) for d in tx40.drive)
    arm = tx40.model_copy(update={"drive": drive})
    made = described_devices(arm, replace(KINDS["no_torque"], tpdo_slots=1, tpdos=4))
    with drives(arm, channel, devices=made), ArmSession(arm, channel) as session:
        layouts = [pdo.layout.size for pdo in session._connection.links()[0].transmitted()]
        assert layouts == [2, 4, 4]


def test_profiles_are_chosen_by_identity_or_by_name() -> None:
    assert choose_profile(None, 0xFB, 0x65520000).name == "maxon_epos4"
    assert choose_profile(None, 0x1A3, 0).name == "technosoft"
    assert choose_profile(None, 0x9A, 1).name == "elmo_gold"
    assert choose_profile(None, 0, 0x402).name == "cia402"
    assert choose_profile("schunk_lwa4d", None, None).name == "schunk_lwa4d"
    with pytest.raises(
        DriveError, match="drive 1: no profile 'elmo'; allowed: canopennode, cia402, elmo_gold"
    ):
        choose_profile("elmo", None, None, "drive 1")
    assert all(profile.name == name and profile.summary for name, profile in known_profiles().items())


MOVES = (
    "fixed_cob_ids",
    "fixed_cob_ids_four_tpdos",
    "immediate_rpdos",
    "one_slot",
    "eight_tpdos",
    "interpolated_only",
    "unsized",
    "sync_period_fixed",
    "period_fixed",
    "period_power_fixed",
    "period_fixed_when_enabled",
    "mode_fixed",
    "rpdo_type_fixed",
    "abort_option_fixed",
    "late_tpdos",
)
PLAIN = Profile("own", "")
MOVES_WITH = {
    **NEEDS,
    "fixed_mapping": PLAIN,
    "no_heartbeat_consumer": PLAIN,
    "absent_08000000": PLAIN,
    "absent_06010000": PLAIN,
    "absent_06040043": PLAIN,
    "late_tpdos": Profile("own", "", tpdo_delay=0.003),
}
TOLERANCE = np.deg2rad(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MOVES)
def test_the_motion_is_the_one_that_was_asked(
    tx40: Robot, new_channel: Callable[[], Channel], kind: str
) -> None:
    jogs_by_two_degrees(tx40, tx40, new_channel(), kind)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MOVES_WITH)
def test_the_motion_is_the_one_that_was_asked_of_the_others_too(
    tx40: Robot, new_channel: Callable[[], Channel], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = of_profile(tx40, MOVES_WITH[kind], monkeypatch)
    jogs_by_two_degrees(tx40, arm, new_channel(), kind)


def jogs_by_two_degrees(tx40: Robot, arm: Robot, channel: Channel, kind: str, source: str = "tx40") -> None:
    """Drives of a kind, under an arm that is described for them."""
    with (
        SimulatedArm(source, channel, truth=without_dry_friction(tx40), profile=kind),
        ArmSession(arm, channel, allow_jog=True) as session,
    ):
        began = session.actual_position()
        result = session.jog("joint_5", np.deg2rad(2.0))
        assert result.outcome == "completed", result
        moved = session.actual_position() - began
        assert moved == pytest.approx([0, 0, 0, 0, np.deg2rad(2.0), 0], abs=TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize("index", [0x6078, 0x6074, 0x2022])
def test_the_motion_with_the_torque_of_another_object(
    tx40: Robot, tmp_path: Path, new_channel: Callable[[], Channel], index: int
) -> None:
    """Drives without 6077, under an arm that names what they have."""
    folder = tmp_path / "arm"
    shutil.copytree(tx40.folder, folder)
    file = folder / "robot.toml"
    text = file.read_text("utf-8")
    file.write_text(text.replace("index = 0x6077", f"index = 0x{index:X}"), "utf-8")
    jogs_by_two_degrees(tx40, robots.load(folder), new_channel(), "no_torque", str(folder))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["locked", "needs_sync_period", "warns_when_enabled"])
def test_without_its_profile_nothing_moves_far_and_the_end_is_no_success(
    tx40: Robot, new_channel: Callable[[], Channel], kind: str
) -> None:
    channel = new_channel()
    with (
        SimulatedArm("tx40", channel, truth=without_dry_friction(tx40), profile=kind),
        ArmSession(tx40, channel, allow_jog=True) as session,
    ):
        began = session.actual_position()
        result = session.jog("joint_5", np.deg2rad(2.0))
        assert result.outcome != "completed" and result.reason
        moved = np.abs(np.rad2deg(session.actual_position() - began))
        assert moved.max() < 0.2 and np.delete(moved, 4).max() < 0.01


@pytest.mark.parametrize(("codes", "outcome"), [({0xFF01}, "completed"), (set(), "fault")])
def test_a_warning_of_this_kind_of_drive_stops_nothing(codes: set[int], outcome: str) -> None:
    def warn(number: int, arm: FakeArm) -> None:
        if number == 60:
            arm.put(0x080 + arm.axes[1].node, (0xFF01).to_bytes(2, "little") + bytes(6))

    links = tuple(replace(link, warnings=frozenset(codes)) for link in stream_job().links)
    assert run(warn, links=links).result.outcome == outcome


@pytest.mark.parametrize(("delay", "complete"), [(0.0, False), (0.003, True)])
def test_answers_of_a_slow_kind_of_drive_are_waited_for(delay: float, complete: bool) -> None:
    """TPDOs that come 3 ms after a SYNC, every 4 ms."""

    def slow(number: int, arm: FakeArm) -> None:
        arm.axes[2].delay = 0.003

    links = tuple(replace(link, tpdo_delay=delay) for link in stream_job().links)
    done = run(slow, links=links).result
    assert (done.outcome == "completed" and done.incomplete_cycles == 0) == complete
    assert receive_seconds(replace(stream_job(), links=links)) == pytest.approx(0.0034 if delay else 0.0024)


def test_a_kind_of_drive_that_is_too_slow_for_the_cycle_is_refused(
    tx40: Robot, channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = of_profile(tx40, Profile("own", "", tpdo_delay=0.0035), monkeypatch)
    message = r"up to 3.5 ms after the SYNC \(profile own\); bus.cycle_time must be at least 4.375 ms"
    with drives(arm, channel), pytest.raises(DriveError, match=message), ArmSession(arm, channel):
        pass
