"""What is listened to on the bus, and what others do there that only a master does."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.frames.layout import (
    NMT_COB_ID,
    SYNC_COB_ID,
    DriveLink,
    emcy_cob_id,
    heartbeat_cob_id,
    sdo_answer_cob_id,
    sdo_request_cob_id,
)

_WRITTEN, _ABORTED = 0x60, 0x80
"""First byte of an SDO answer: a write that was done, and an abort (CiA 301, 7.2.4.3)."""
_READING = (2, 3, 4, 5)
"""Command specifiers of an SDO client that uploads, or gives up; all others download."""
_FIRST = (1, 6)
"""Those that name the object that they are about to write."""


def is_answer(data: bytes, asked: bytes) -> bool:
    """Whether an SDO answer says that a write of this object (3 bytes) was done, or refused for good.

    A drive that has no such object has nothing to be written.
    """
    return len(data) == 8 and data[0] in (_WRITTEN, _ABORTED) and data[1:4] == asked


def written_object(data: bytes) -> str | None:
    """What an SDO request of somebody else writes; None where it reads, and changes nothing.

    A drive whose controlword, home offset or mapping another program writes is not this master's any more.
    """
    if not data or data[0] >> 5 in _READING:
        return None
    if data[0] >> 5 not in _FIRST or len(data) < 4:
        return "an object"
    return f"object {data[2]:02X}{data[1]:02X}:{data[3]:02X}"


def own_cob_ids(links: Sequence[DriveLink], master_node: int) -> list[int]:
    """COB-IDs of this master; own frames are not received, so one that is comes from another master."""
    rpdos = [link.rpdo_cob_id for link in links]
    return [NMT_COB_ID, SYNC_COB_ID, heartbeat_cob_id(master_node), *rpdos]


def receive_cob_ids(links: Sequence[DriveLink], master_node: int) -> list[int]:
    """What the cyclic process listens to: what drives send, and what nobody but itself may send."""
    kinds = (emcy_cob_id, heartbeat_cob_id, sdo_answer_cob_id, sdo_request_cob_id)
    answers = [pdo.cob_id for link in links for pdo in link.transmitted()]
    return [
        *answers,
        *(kind(link.node) for link in links for kind in kinds),
        *own_cob_ids(links, master_node),
    ]
