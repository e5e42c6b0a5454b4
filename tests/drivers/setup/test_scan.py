"""A scan of a bus: who is there, and a draft of the drives' tables; nothing is written to anybody."""

from __future__ import annotations

import tomllib

import pytest

from daq.doctor.scan_words import describe_scan, scan_json
from drivers import Channel
from drivers.setup.draft import draft
from drivers.setup.profiles import Profile, known_profiles
from drivers.setup.scan import scan
from drivers.simulated.device import described_devices
from drivers.simulated.group import DriveGroup
from drivers.simulated.quirks import Quirks
from robots import Robot
from tests.drivers.setup.test_setup import drives


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Channel:
    return Channel("virtual", request.node.name)


def test_everybody_is_found_and_nothing_is_written(tx40: Robot, channel: Channel) -> None:
    written: list[int] = []

    def watch(group: DriveGroup) -> None:
        for drive in group.drives:
            whole = drive.dictionary.write

            def write(index: int, subindex: int, data: bytes, whole: object = whole) -> None:
                written.append(index)

            drive.dictionary.write = write  # type: ignore[method-assign]

    with drives(tx40, channel, watch) as group:
        found = scan(channel)
        before = [drive.machine.state for drive in group.drives]
    assert written == [] and len(set(before)) == 1
    assert [drive.node for drive in found] == [1, 2, 3, 4, 5, 6]
    first = found[0]
    assert first.is_drive and first.state == "switch on disabled" and first.watches
    assert first.units == "608F 196608/1, 6091 32/1, 6092 6291456/1"
    assert {"ip", "csp", "hm"} <= set(first.modes) and first.torque[0] == (0x6077, 0)
    assert first.limits["607D:01"] < 0 < first.limits["607D:02"]
    (rpdo,), tpdo = first.rpdos, first.tpdos[0]
    assert (rpdo.cob_id, rpdo.on, rpdo.type, rpdo.slots) == (0x201, True, 1, 8)
    assert [str(entry) for entry in rpdo.objects] == ["6040:00", "607A:00"]
    assert [str(entry) for entry in tpdo.objects] == ["6041:00", "6064:00", "6077:00"]
    assert not first.tpdos[1].on and first.temperature is None
    tables = tomllib.loads(draft(found))["drive"]
    assert [table["node_id"] for table in tables] == [1, 2, 3, 4, 5, 6]
    assert (tables[0]["encoder_counts"], tables[0]["gear"]) == (196608, 32)
    assert tables[0]["counts_per_output_turn"] == pytest.approx(tx40.drive[0].output_counts)
    assert tables[3]["identity"]["vendor"] == found[3].identity[0]


def test_what_a_drive_does_not_say_is_left_open(tx40: Robot, channel: Channel) -> None:
    silent = Quirks(absent=(0x608F, 0x6091, 0x6092, 0x6077, 0x1016, 0x1017), tpdos=8)
    with drives(tx40, channel, devices=described_devices(tx40, silent)):
        found = scan(channel)
    assert found[0].units == "nothing" and found[0].torque == () and found[0].heartbeat is None
    assert [pdo.number for pdo in found[0].tpdos] == list(range(1, 9))
    text = draft(found)
    assert "# to be filled in: encoder_counts, or counts_per_output_turn" in text
    assert "gear" not in tomllib.loads(text)["drive"][0]


def test_a_temperature_that_this_kind_of_drive_tells(
    tx40: Robot, channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = Profile("own", "", vendor=0, temperature=(0x2200, 0, 0.1))
    monkeypatch.setitem(known_profiles(), "own", kind)
    with drives(tx40, channel):
        found = scan(channel)
    assert found[0].profile.name == "own" and found[0].temperature == pytest.approx(25.0, abs=5.0)
    assert tomllib.loads(draft(found))["drive"][0]["temperature"]["index"] == 0x2200
    (node, *_) = scan_json(channel, found, "")["nodes"]
    assert node["temperature"] == found[0].temperature and node["tpdos"][1]["on"] is False
    assert "temperature: 2" in describe_scan(channel, found)
    assert "TPDO 1: 0x181, type 1, 6041:00 6064:00 6077:00 (room for 8)" in describe_scan(channel, found)


def test_nobody_is_found_on_an_empty_bus(channel: Channel) -> None:
    assert scan(channel) == ()
