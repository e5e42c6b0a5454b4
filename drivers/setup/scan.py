"""Who is on a bus: identity, units, limits, modes and PDOs of each drive, by SDO uploads alone."""

from __future__ import annotations

import time
from dataclasses import dataclass

import can

from drivers.bus.access import describe_cob_id, listen_for_traffic, open_bus
from drivers.bus.bus_lock import BusLock
from drivers.cia402 import objects
from drivers.cia402.states import state_of
from drivers.errors import BusError
from drivers.frames.channel import Channel
from drivers.frames.layout import MappedObject, master_cob_ids, sdo_answer_cob_id, sdo_request_cob_id
from drivers.setup.drive import read_settings
from drivers.setup.mapping import DISABLED, mapped_objects, pdo_numbers
from drivers.setup.profiles import Profile, choose_profile
from drivers.setup.sdo import SdoAccess, SdoNetwork
from drivers.setup.told_units import FactorGroup, Settings

NODES = range(1, 128)
ANSWER_SECONDS = 0.5
_SPACING = 0.001
"""s between two requests: 127 of them must not fill a bus."""
_DEVICE_NAME = 0x1008
MOST_SLOTS = 8
_DRIVE_PROFILE = 402
_MODES = {0: "pp", 2: "pv", 3: "tq", 5: "hm", 6: "ip", 7: "csp", 8: "csv", 9: "cst"}
_LIMITS = ("6065", "6066", "6072", "6073", "6076", "607D:01", "607D:02", "607F", "6080")


@dataclass(frozen=True)
class FoundPdo:
    """One PDO as the node has it now.

    Attributes:
        number: from 1.
        cob_id: where it is sent or heard.
        on: whether it exists (bit 31 of its COB-ID entry).
        type: transmission type; None where the node does not say.
        slots: entries that its mapping has room for.
        objects: what is mapped.
    """

    number: int
    cob_id: int
    on: bool
    type: int | None
    slots: int
    objects: tuple[MappedObject, ...]


@dataclass(frozen=True)
class FoundDrive:
    """One node that answered.

    Attributes:
        node: its id.
        device_type: 1000; its lower half is 402 for a drive.
        name: 1008; empty where it has none.
        identity: vendor, product, revision and serial (1018).
        profile: the kind of drive that armhil takes it for.
        state: of its power state machine, in words; None where it is no drive.
        heartbeat: ms (1017); None where it has none.
        watches: whether it has 1016 or 1400:05.
        modes: that it supports (6502), by their short names.
        torque: objects that may carry the control signal, as index and subindex.
        rpdos, tpdos: its PDOs as they are; whether they can be mapped otherwise, only writing would show.
        temperature: °C, where this kind of drive is known to tell; else None.
        settings: units and limits as read.
    """

    node: int
    device_type: int
    name: str
    identity: tuple[int | None, ...]
    profile: Profile
    state: str | None
    heartbeat: int | None
    watches: bool
    modes: tuple[str, ...]
    torque: tuple[tuple[int, int], ...]
    rpdos: tuple[FoundPdo, ...]
    tpdos: tuple[FoundPdo, ...]
    temperature: float | None
    settings: Settings

    @property
    def is_drive(self) -> bool:
        """Whether it says that it is a CiA 402 device."""
        return self.device_type & 0xFFFF == _DRIVE_PROFILE

    @property
    def units(self) -> str:
        """What it says of its position unit."""
        words = FactorGroup.read(self.settings).words
        return ", ".join(words.values()) or "nothing"

    @property
    def limits(self) -> dict[str, int]:
        """Limits that it has, by object."""
        return {name: value for name in _LIMITS if (value := self.settings.get(name)) is not None}


def scan(channel: Channel, bitrate: int = 1_000_000) -> tuple[FoundDrive, ...]:
    """Ask every node id; read what those who answer are.

    Args:
        channel: which bus.
        bitrate: bit/s.

    Raises:
        BusError: the bus cannot be opened, or has a master already.
        DriveError: a node stops to answer.
    """
    with BusLock(channel):
        heard = listen_for_traffic(channel, cob_ids=master_cob_ids(tuple(NODES)))
        if heard:
            frames = ", ".join(describe_cob_id(cob_id) for cob_id in sorted(heard))
            raise BusError(
                f"{channel} is occupied: another master is on it, heard {frames}; take it off the bus first"
            )
        nodes = _answering(channel, bitrate)
        if not nodes:
            return ()
        network = SdoNetwork(channel, nodes, tuple(f"node {node}" for node in nodes), bitrate)
        try:
            return tuple(_read(node, sdo) for node, sdo in zip(nodes, network.drives, strict=True))
        finally:
            network.close()


def _answering(channel: Channel, bitrate: int) -> tuple[int, ...]:
    """Node ids that answer an upload of 1000h."""
    found = set()
    request = bytes([0x40, 0x00, 0x10, 0x00]) + bytes(4)
    with open_bus(channel, [sdo_answer_cob_id(node) for node in NODES], bitrate) as bus:
        for node in NODES:
            cob_id = sdo_request_cob_id(node)
            bus.send(can.Message(arbitration_id=cob_id, data=request, is_extended_id=False))
            time.sleep(_SPACING)
        deadline = time.monotonic() + ANSWER_SECONDS
        while (left := deadline - time.monotonic()) > 0:
            message = bus.recv(timeout=left)
            if message is not None and not message.is_error_frame:
                found.add(message.arbitration_id - sdo_answer_cob_id(0))
    return tuple(sorted(found & set(NODES)))


def _read(node: int, sdo: SdoAccess) -> FoundDrive:
    device_type = sdo.read_optional(objects.DEVICE_TYPE) or 0
    identity = tuple(sdo.read_optional(objects.IDENTITY, subindex) for subindex in (1, 2, 3, 4))
    profile = choose_profile(None, identity[0], identity[1])
    for key, bits in profile.widths:
        sdo.widths[key] = bits // 8
    word = sdo.read_optional(objects.STATUSWORD)
    modes = sdo.read_optional(objects.SUPPORTED_MODES) or 0
    consumer = sdo.read_optional(objects.HEARTBEAT_CONSUMER, 1)
    deadline = sdo.read_optional(objects.RPDO_COMMUNICATION, 5)
    return FoundDrive(
        node=node,
        device_type=device_type,
        name=_name(sdo),
        identity=identity,
        profile=profile,
        state=None if word is None else state_of(word).value,
        heartbeat=sdo.read_optional(objects.HEARTBEAT_PRODUCER),
        watches=consumer is not None or deadline is not None,
        modes=tuple(name for bit, name in _MODES.items() if modes >> bit & 1),
        torque=tuple(key for key in profile.torque if sdo.read_optional(*key) is not None),
        rpdos=_pdos(sdo, objects.RPDO_COMMUNICATION, objects.RPDO_MAPPING),
        tpdos=_pdos(sdo, objects.TPDO_COMMUNICATION, objects.TPDO_MAPPING),
        temperature=_temperature(sdo, profile),
        settings=read_settings(sdo),
    )


def _pdos(sdo: SdoAccess, communication: int, mapping: int) -> tuple[FoundPdo, ...]:
    return tuple(_pdo(sdo, number, communication, mapping) for number in pdo_numbers(sdo, communication))


def _pdo(sdo: SdoAccess, number: int, communication: int, mapping: int) -> FoundPdo:
    word = sdo.read_int(communication + number, 1)
    slots = 0
    while slots < MOST_SLOTS and sdo.read_optional(mapping + number, slots + 1) is not None:
        slots += 1
    return FoundPdo(
        number=number + 1,
        cob_id=word & 0x7FF,
        on=not word & DISABLED,
        type=sdo.read_optional(communication + number, 2),
        slots=slots,
        objects=mapped_objects(sdo, mapping + number),
    )


def _temperature(sdo: SdoAccess, profile: Profile) -> float | None:
    if profile.temperature is None:
        return None
    index, subindex, per_count = profile.temperature
    value = sdo.read_optional(index, subindex, signed=True)
    return None if value is None else value * per_count


def _name(sdo: SdoAccess) -> str:
    if sdo.read_optional(_DEVICE_NAME) is None:
        return ""
    text = sdo.read(_DEVICE_NAME).decode("latin-1")
    return "".join(character for character in text if character.isprintable()).strip()
