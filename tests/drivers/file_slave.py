"""A drive that is its maker's EDS or DCF, served over SDO by the library canopen: objects, access rights,
limits.

What a file cannot hold is added here: the mode display follows the mode, mappings keep the rules of CiA 301
(7.5.2.36), a lost heartbeat is EMCY 8130. Nothing here is of the master or of the simulated drives.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import ODVariable
from canopen.sdo.exceptions import SdoAbortedError

READ_ONLY, NO_OBJECT, NOT_MAPPABLE, TOO_LONG = 0x06010002, 0x06020000, 0x06040041, 0x06040042
TOO_HIGH, TOO_LOW, NOT_ALLOWED, NOT_NOW = 0x06090031, 0x06090032, 0x06090030, 0x08000022
SWITCH_ON_DISABLED = 0x0040
_INVALID = 1 << 31


class FileSlave:
    """One node.

    Args:
        network: connected.
        path: of the file.
        node_id: its own; COB-IDs that the file has relative to it follow it.
    """

    def __init__(self, network: canopen.Network, path: Path, node_id: int) -> None:
        dictionary = canopen.import_od(str(path), node_id)
        self.node = canopen.LocalNode(node_id, dictionary)
        self._network, self._due = network, float("inf")
        self._values = self.node.data_store
        for index, entry in list(dictionary.items()):
            variables = [entry] if isinstance(entry, ODVariable) else list(entry.values())
            for variable in variables:
                # A DCF holds the COB-IDs of the node that it was taken from.
                if index == 0x1014 or (0x1400 <= index < 0x1A00 and variable.subindex == 1):
                    variable.value = variable.default if variable.default is not None else variable.value
        self.node.add_read_callback(self._tell)
        self.node.add_write_callback(self._judge)
        network.add_node(self.node)

    def _number(self, index: int, subindex: int = 0) -> int:
        try:
            data = self.node.get_data(index, subindex)
        except SdoAbortedError:
            return 0
        return int.from_bytes(data, "little")

    def _tell(self, index: int, subindex: int, od: ODVariable) -> int | None:
        if index == 0x6041:
            return SWITCH_ON_DISABLED
        if index == 0x6061:
            return self._number(0x6060)
        if subindex in self._values.get(index, {}) or od.value is not None or od.default is not None:
            return None
        # Process values and communication objects have one in any drive; of others the file tells nothing.
        return 0 if od.pdo_mappable or index < 0x2000 or index == 0x6060 else None

    def _judge(self, index: int, subindex: int, od: ODVariable, data: bytes) -> None:
        value = int.from_bytes(data, "little")
        signed = int.from_bytes(data, "little", signed=True)
        if od.max is not None and min(value, signed) > od.max:
            raise SdoAbortedError(TOO_HIGH)
        if od.min is not None and max(value, signed) < od.min:
            raise SdoAbortedError(TOO_LOW)
        if 0x1400 <= index < 0x1600 or 0x1800 <= index < 0x1A00:
            word = self._number(index, 1)
            if subindex == 1 and not (value | word) & _INVALID and (value ^ word) & 0x7FF:
                raise SdoAbortedError(NOT_NOW)
        elif 0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00:
            self._judge_mapping(index, subindex, value)
        elif index == 0x6060 and 0x6502 in self.node.object_dictionary:
            modes = self._number(0x6502)
            if modes and value and not modes >> (value - 1) & 1:
                raise SdoAbortedError(NOT_ALLOWED)
        elif index == 0x1016:
            self._due = float("inf")

    def _judge_mapping(self, index: int, subindex: int, value: int) -> None:
        # Where nobody can switch a PDO off, it is mapped while it is on.
        fixed = not self.node.object_dictionary[index - 0x200][1].writable
        if not fixed and not self._number(index - 0x200, 1) & _INVALID:
            raise SdoAbortedError(NOT_NOW)
        if subindex:
            if self._number(index):
                raise SdoAbortedError(NOT_NOW)
            self._mappable(value, received=index < 0x1800)
            return
        words = []
        for k in range(value):
            if k + 1 not in self.node.object_dictionary[index]:
                raise SdoAbortedError(TOO_LONG)
            words.append(self._number(index, k + 1))
        if sum(word & 0xFF for word in words) > 64:
            raise SdoAbortedError(TOO_LONG)

    def _mappable(self, word: int, received: bool) -> None:
        mapped = self.node._find_object(word >> 16, word >> 8 & 0xFF)  # raises as absent
        if not mapped.pdo_mappable or len(mapped) != word & 0xFF or (received and not mapped.writable):
            raise SdoAbortedError(NOT_MAPPABLE)

    def hear(self, cob_id: int, data: bytes, timestamp: float) -> None:
        """A heartbeat of the master."""
        if 0x1016 not in self.node.object_dictionary:
            return
        word = self._number(0x1016, 1)
        if word >> 16 & 0x7F == cob_id - 0x700 and word & 0xFFFF:
            self._due = time.monotonic() + (word & 0xFFFF) / 1000

    def tick(self) -> None:
        """Misses the master's heartbeat."""
        if time.monotonic() > self._due:
            self._due = float("inf")
            self.node.emcy.send(0x8130, 0x11)


@contextmanager
def file_slaves(path: Path, nodes: tuple[int, ...], **bus: Any) -> Iterator[list[FileSlave]]:
    """Nodes of one file on a bus, until the block ends."""
    network = canopen.Network()
    network.connect(**bus)
    slaves = [FileSlave(network, path, node) for node in nodes]
    for slave in slaves:
        network.subscribe(0x77F, slave.hear)
    done = threading.Event()

    def watch() -> None:
        while not done.wait(0.01):
            for slave in slaves:
                slave.tick()

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield slaves
    finally:
        done.set()
        thread.join()
        for slave in slaves:
            slave.node.nmt.stop_heartbeat()
        network.disconnect()
