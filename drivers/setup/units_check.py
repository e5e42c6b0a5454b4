"""The drive's units beside the description's: where they differ, the arm would move by the wrong amount."""

from __future__ import annotations

from fractions import Fraction

from drivers.setup.findings import Finding
from drivers.setup.told_units import INCREMENTS, FactorGroup, Settings, Told, velocity_unit
from robots.description import Drive, Robot

NEAR = 1e-4
"""Relative difference below which two units are the same: 0.01° in a motion of 100°."""

_POSITION_POLARITY = 0x80
"""Bit of 607E."""


def compare_units(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    """What the drive of an axis says of encoder, gear, position unit, sign and velocity unit.

    Args:
        robot: the description.
        axis: from 0.
        settings: read from the drive.
    """
    drive = robot.drive[axis]
    revolute = robot.joint[axis].kind == "revolute"
    group = FactorGroup.read(settings)
    found = [*_encoder(drive, group), *_gear(drive, group, revolute)]
    if not any(finding.severity == "refusal" for finding in found):
        found += _position(robot, axis, group)
    if (settings.get("607E") or 0) & _POSITION_POLARITY:
        text = (
            "the drive turns the sign of its positions (bit 7), not that of its torque: sign is that of the"
            " positions as they are counted, control_signal.sign that of the torque"
        )
        found.append(Finding("warning", "607E", text))
    return [*found, *_velocity(drive, settings)]


def _encoder(drive: Drive, group: FactorGroup) -> list[Finding]:
    if group.unconfigured and (group.feed is not None or group.unit not in (None, INCREMENTS << 16)):
        used = " and ".join(group.words[index] for index in ("6092", "60A8") if index in group.words)
        text = (
            f"is 1/1 as delivered, but {used} asks for the encoder: configure 608F in the drive (increments "
            "per motor turn)"
        )
        return [Finding("refusal", "608F", text)]
    if group.unconfigured and drive.counts_per_output_turn is None:
        guess = f" ({drive.output_counts:.10g} if it counts its encoder)" if drive.encoder_counts else ""
        text = (
            "is 1/1 as delivered: the drive does not know its encoder; write counts_per_output_turn of this "
            f"drive into robot.toml{guess}, or configure 608F in the drive"
        )
        return [Finding("refusal", "608F", text)]
    resolution, described = group.resolution, drive.encoder_counts
    if resolution is None or described is None or _same(resolution, described):
        return []
    text = (
        f"the drive counts {resolution:.10g} per motor revolution, encoder_counts is {described}: "
        "correct the one that is wrong"
    )
    return [Finding("refusal", "608F", text)]


def _gear(drive: Drive, group: FactorGroup, revolute: bool) -> list[Finding]:
    ratio = group.gear_ratio
    if ratio is None or not revolute or _same(ratio, drive.gear):
        return []
    if ratio == 1:
        return [Finding("info", "6091", "gear ratio 1: the drive's positions are the motor's")]
    text = f"the drive's gear ratio is {ratio:.10g}, gear is {drive.gear:.10g}: correct the one that is wrong"
    return [Finding("refusal", "6091", text)]


def _position(robot: Robot, axis: int, group: FactorGroup) -> list[Finding]:
    drive = robot.drive[axis]
    revolute = robot.joint[axis].kind == "revolute"
    told = group.told(drive.encoder_counts, drive.gear, revolute=revolute)
    per = "turn" if revolute else "metre"
    if not told and group.unknown_unit(revolute=revolute) and drive.counts_per_output_turn is None:
        text = (
            f"{group.words['60A8']} is no unit that is known here: write counts_per_output_turn of this "
            "drive into robot.toml, or set 60A8 to increments (0x00B50000)"
        )
        return [Finding("refusal", "60A8", text)]
    if not told or (group.unconfigured and group.factor is None):
        why = "608F is 1/1 as delivered" if group.unconfigured else "no 608F, 6092 or 60A8 with a value"
        text = (
            f"{why}: that the drive counts {drive.output_counts:.10g} per {per} of the output stands in "
            "robot.toml alone; look at the first jog"
        )
        return [Finding("warning", "units", text)]
    if (contradiction := _contradiction(told, per)) is not None:
        return [contradiction]
    first = told[0]
    if _same(first.counts, drive.output_counts):
        return []
    explicit = drive.counts_per_output_turn is not None
    source = "counts_per_output_turn" if explicit else "encoder_counts × gear"
    text = (
        f"the drive counts {first.counts:.10g} per {per} of the output ({first.by}), robot.toml says "
        f"{drive.output_counts:.10g} ({source}): write counts_per_output_turn = {first.counts:.10g} into "
        f"robot.toml if that is so, else {_remedy(first, drive, group)}"
    )
    return [Finding("refusal", first.subject, text)]


def _remedy(told: Told, drive: Drive, group: FactorGroup) -> str:
    if told.subject == "608F" and _same(group.resolution or 0.0, drive.output_counts):
        return "write gear = 1: the encoder sits behind the gear"
    if told.subject != "6092":
        return f"correct {told.subject} in the drive"
    feed = Fraction(told.feed * drive.output_counts / told.counts).limit_denominator(10_000)
    return f"set 6092 of the drive to {feed.numerator}/{feed.denominator}"


def _contradiction(told: list[Told], per: str) -> Finding | None:
    first = told[0]
    for other in told[1:]:
        if not _same(first.counts, other.counts):
            text = (
                f"says {other.counts:.10g} counts per {per} of the output ({other.by}), {first.subject} "
                f"{first.counts:.10g} ({first.by}): correct one of them in the drive"
            )
            return Finding("refusal", other.subject, text)
    return None


def velocity_scale(robot: Robot, axis: int, settings: Settings) -> float:
    """Position units per second in one unit of the drive's velocity objects (606C, 607F, 6099).

    As the drive says (60A9, 6096), else as the description does for 606C, else 1 (CiA 402-2, no factor).

    Args:
        robot: the description.
        axis: from 0.
        settings: read from the drive.
    """
    drive = robot.drive[axis]
    told = velocity_unit(settings, drive.output_counts, drive.gear)
    if told is not None:
        return told
    standard = drive.velocity is not None and drive.velocity.index == 0x606C
    return drive.velocity.counts_per_second if drive.velocity is not None and standard else 1.0


def unknown_velocity_unit(robot: Robot, axis: int, settings: Settings) -> bool:
    """Whether the drive names a unit of velocity (60A9) that nothing here can convert."""
    drive = robot.drive[axis]
    return bool(settings.get("60A9")) and velocity_unit(settings, drive.output_counts, drive.gear) is None


def _velocity(drive: Drive, settings: Settings) -> list[Finding]:
    if drive.velocity is None or drive.velocity.index != 0x606C:
        return []
    told = velocity_unit(settings, drive.output_counts, drive.gear)
    described = drive.velocity.counts_per_second
    if told is None or abs(told - described) <= 1e-3 * described:
        return []
    subject = "60A9" if settings.get("60A9") else "6096"
    text = (
        f"one unit of 606C is {told:.7g} position units per second, velocity.counts_per_second is "
        f"{described:.7g}: correct the one that is wrong"
    )
    return [Finding("refusal", subject, text)]


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= NEAR * abs(b)
