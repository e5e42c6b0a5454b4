"""What ``armhil scan`` prints: for people, and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from drivers import Channel
from drivers.setup.scan import FoundDrive, FoundPdo


def describe_scan(channel: Channel, found: Sequence[FoundDrive]) -> str:
    """A few lines for each node."""
    if not found:
        return f"nobody answers on {channel}: check supply, cable, termination, bit rate and node ids"
    return "\n".join(line for drive in found for line in _lines(drive))


def _lines(drive: FoundDrive) -> list[str]:
    shown = ["none" if value is None else f"0x{value:08X}" for value in drive.identity]
    head = f"node {drive.node}: {drive.name or 'without a name'}, vendor {shown[0]}, product {shown[1]}"
    if not drive.is_drive:
        return [f"{head}: no CiA 402 drive (1000 = 0x{drive.device_type:08X})"]
    beats = "none" if drive.heartbeat is None else f"{drive.heartbeat} ms"
    limits = ", ".join(f"{name} {value}" for name, value in drive.limits.items()) or "none"
    torque = ", ".join(f"{index:04X}:{subindex:02X}" for index, subindex in drive.torque) or "no object known"
    return [
        f"{head}, revision {shown[2]}, serial {shown[3]}",
        f"  state {drive.state}, profile {drive.profile.name}, modes {' '.join(drive.modes) or 'not told'}",
        f"  heartbeat {beats}, watches its master: {'yes' if drive.watches else 'no'}",
        f"  units: {drive.units}; limits: {limits}",
        f"  torque: {torque}; temperature: {_warmth(drive)}",
        *[f"  {_pdo_words('RPDO', pdo)}" for pdo in drive.rpdos],
        *[f"  {_pdo_words('TPDO', pdo)}" for pdo in drive.tpdos],
    ]


def _warmth(drive: FoundDrive) -> str:
    return "not told" if drive.temperature is None else f"{drive.temperature:.4g} °C"


def _pdo_words(kind: str, pdo: FoundPdo) -> str:
    carried = " ".join(str(entry) for entry in pdo.objects) or "nothing"
    state = f"0x{pdo.cob_id:03X}" if pdo.on else "off"
    told = "not told" if pdo.type is None else str(pdo.type)
    return f"{kind} {pdo.number}: {state}, type {told}, {carried} (room for {pdo.slots})"


def _pdo_json(pdo: FoundPdo) -> dict[str, Any]:
    return {
        "number": pdo.number,
        "cob_id": pdo.cob_id,
        "on": pdo.on,
        "type": pdo.type,
        "slots": pdo.slots,
        "objects": [str(entry) for entry in pdo.objects],
    }


def scan_json(channel: Channel, found: Sequence[FoundDrive], draft: str) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "armhil": version("armhil"),
        "channel": str(channel),
        "nodes": [
            {
                "node": drive.node,
                "name": drive.name,
                "drive": drive.is_drive,
                "identity": dict(
                    zip(("vendor", "product", "revision", "serial"), drive.identity, strict=True)
                ),
                "profile": drive.profile.name,
                "state": drive.state,
                "heartbeat_ms": drive.heartbeat,
                "watches": drive.watches,
                "modes": list(drive.modes),
                "torque": [f"{index:04X}:{subindex:02X}" for index, subindex in drive.torque],
                "rpdos": [_pdo_json(pdo) for pdo in drive.rpdos],
                "tpdos": [_pdo_json(pdo) for pdo in drive.tpdos],
                "temperature": drive.temperature,
                "settings": dict(drive.settings),
            }
            for drive in found
        ],
        "draft": draft,
    }
