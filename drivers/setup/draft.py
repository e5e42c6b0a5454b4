"""The draft of the drives' tables of a robot.toml, from what a scan found."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.setup.scan import FoundDrive
from drivers.setup.told_units import FactorGroup

_OPEN = "# to be filled in:"


def draft(found: Sequence[FoundDrive]) -> str:
    """``[[drive]]`` tables, one for each drive in the order of node ids.

    Args:
        found: of a scan; what is no drive is left out.
    """
    tables = [_table(drive) for drive in found if drive.is_drive]
    head = "# Draft from a scan of the bus: order, gears, gains and dynamics are to be filled in.\n"
    return head + "\n".join(tables)


def _table(drive: FoundDrive) -> str:
    vendor, product, revision, _serial = drive.identity
    entries = {"vendor": vendor, "product": product, "revision": revision}
    identity = ", ".join(f"{key} = 0x{value:08X}" for key, value in entries.items() if value is not None)
    index, subindex = drive.torque[0] if drive.torque else (0x6077, 0)
    lines = [
        "[[drive]]",
        f"node_id = {drive.node}  # {drive.name or 'without a name'}",
        *_units(drive),
        f"{_OPEN} sign = 1, gain, gain_relative_uncertainty, dynamics",
        f"{_OPEN} control_signal.per_count",
        f"control_signal = {{ index = 0x{index:04X}, subindex = {subindex}, per_count = 0.001 }}",
        f"identity = {{ {identity} }}",
        *_temperature(drive),
        f'profile = "{drive.profile.name}"',
    ]
    return "\n".join(lines) + "\n"


def _temperature(drive: FoundDrive) -> list[str]:
    if drive.temperature is None or drive.profile.temperature is None:
        return []
    index, subindex, per_count = drive.profile.temperature
    where = f"index = 0x{index:04X}, subindex = {subindex}, per_count = {per_count:g}"
    return [f"temperature = {{ {where} }}"]


def _units(drive: FoundDrive) -> list[str]:
    group = FactorGroup.read(drive.settings)
    lines = [f"# it says of its unit: {drive.units}; as delivered: {drive.profile.unit}"]
    if group.resolution is not None:
        lines.append(f"encoder_counts = {round(group.resolution)}")
    else:
        lines.append(f"{_OPEN} encoder_counts, or counts_per_output_turn")
    gear = group.gear_ratio
    told = group.told(None, gear, revolute=True) if gear is not None else []
    if gear is not None and gear != 1:
        lines.append(f"gear = {gear:.10g}")
        if told:
            lines.append(f"counts_per_output_turn = {told[0].counts:.10g}")
    else:
        lines.append(f"{_OPEN} gear")
    return lines
