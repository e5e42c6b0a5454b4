"""Configuration of one drive over SDO: identity, mapping, mode, period, watch. It never enables torque."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from drivers.cia402 import objects
from drivers.cia402.emcy import describe_emcy
from drivers.cia402.states import TORQUE_STATES, State, state_of
from drivers.errors import DriveError
from drivers.frames.layout import DriveLink, MappedObject
from drivers.setup.device_needs import compare_identity
from drivers.setup.eds import read_device_file
from drivers.setup.findings import Finding
from drivers.setup.guarding import (
    no_consumer,
    set_abort_option,
    set_deadline,
    set_heartbeat,
    watch_findings,
)
from drivers.setup.limits import compare_limits
from drivers.setup.mapping import PdoPlan, map_pdos
from drivers.setup.mode import choose_mode, set_mode, set_period, start_up
from drivers.setup.profiles import Profile, choose_profile
from drivers.setup.sdo import SdoAccess
from drivers.setup.synchronisation import sync_findings
from robots.description import Drive, Robot

READY_TIMEOUT = 3.0
"""s that a drive may take for its self-test."""


@dataclass(frozen=True)
class DriveReport:
    """What the set-up found at one drive."""

    joint: str
    node_id: int
    vendor: int
    product: int | None
    revision: int | None
    serial: int | None
    device_type: int
    supported_modes: int | None
    mode: int
    """6060h: 8 is csp, 7 is ip."""
    control_signal_bits: int
    velocity_bits: int
    """0 where the velocity is not sent."""
    heartbeat: float
    """s between its heartbeats; 0 where it sends none."""
    watches: bool
    """Whether it has a heartbeat consumer."""
    deadline: bool
    """Whether it has an RPDO deadline."""
    statusword: int
    settings: dict[str, int | None] = field(default_factory=dict)
    """Objects for safety and units, by index (and subindex); None where the drive does not have one."""
    findings: tuple[Finding, ...] = ()
    profile: Profile = field(default_factory=lambda: choose_profile(None, None, None))
    """Which kind of drive it was taken for."""
    plan: PdoPlan | None = None
    """Its PDOs as they are mapped."""
    signals: tuple[MappedObject | None, MappedObject | None] = (None, None)
    """Control signal and velocity."""

    @property
    def notes(self) -> tuple[str, ...]:
        """The findings that somebody should know of."""
        return tuple(str(finding) for finding in self.findings if finding.severity != "info")

    def link(self, name: str) -> DriveLink:
        """How the cycle speaks to this drive."""
        return DriveLink(
            node=self.node_id,
            name=name,
            control_signal_bits=self.control_signal_bits,
            velocity_bits=self.velocity_bits,
            interpolated=self.mode == objects.INTERPOLATED_POSITION,
            heartbeat=self.heartbeat,
            watches=self.watches,
            rpdo=0 if self.plan is None else self.plan.rpdo,
            tpdos=() if self.plan is None else self.plan.tpdos,
            control_signal=self.signals[0],
            velocity=self.signals[1],
            idle_tpdos=() if self.plan is None else self.plan.idle,
            warnings=self.profile.warnings,
            tpdo_delay=self.profile.tpdo_delay,
        )

    @property
    def state(self) -> State:
        """The power state at the end of the set-up."""
        return state_of(self.statusword)


def configure(sdo: SdoAccess, robot: Robot, axis: int, watch_seconds: float) -> DriveReport:
    """Bring one drive, in NMT pre-operational, to where the cyclic process can take over.

    Every setting is written and read back.

    Args:
        sdo: its object dictionary.
        robot: the arm's description.
        axis: which drive of it, from 0.
        watch_seconds: how long the drive may hear no RPDO, where it can watch for that.

    Raises:
        DriveError: no answer, another identity, a refused or changed value, a drive that carries torque or
            has no mode for set-points at each SYNC.
    """
    drive = robot.drive[axis]
    findings: list[Finding] = []
    _refuse_torque(sdo)
    identity = _identity(sdo, drive, findings)
    profile = choose_profile(drive.profile, identity[0], identity[1], sdo.drive)
    start_up(sdo, profile, robot.bus.cycle_time, findings)
    modes = sdo.read_optional(objects.SUPPORTED_MODES)
    control_signal = _control_signal(sdo, drive, profile)
    wanted = drive.velocity
    velocity = None if wanted is None else _mapped(sdo, wanted.index, wanted.subindex)
    mode = choose_mode(sdo, modes, findings)
    interpolated = mode == objects.INTERPOLATED_POSITION
    plan = map_pdos(sdo, drive.node_id, control_signal, interpolated, velocity)
    findings += plan.findings
    set_mode(sdo, mode, shown=not profile.mode_shown_when_enabled)
    set_period(sdo, robot.bus.cycle_time, profile, findings)
    heartbeat = set_heartbeat(sdo, findings)
    findings += set_abort_option(sdo)
    deadline = set_deadline(sdo, watch_seconds)
    unwatched = no_consumer(sdo, robot.bus.master_node_id, watch_seconds)
    findings += file_findings(robot, axis, identity)
    settings = read_settings(sdo)
    findings += watch_findings(unwatched, deadline)
    findings += sync_findings(sdo, robot.bus.cycle_time)
    findings += _standing_error(settings)
    findings += compare_limits(robot, axis, settings)
    return DriveReport(
        joint=robot.joint[axis].name,
        node_id=drive.node_id,
        vendor=identity[0] or 0,
        product=identity[1],
        revision=identity[2],
        serial=identity[3],
        device_type=sdo.read_int(objects.DEVICE_TYPE),
        supported_modes=modes,
        mode=mode,
        control_signal_bits=control_signal.bits,
        velocity_bits=0 if velocity is None else velocity.bits,
        heartbeat=heartbeat,
        watches=unwatched is None,
        deadline=deadline,
        statusword=sdo.read_int(objects.STATUSWORD),
        settings=settings,
        findings=tuple(findings),
        profile=profile,
        plan=plan,
        signals=(control_signal, velocity),
    )


def read_settings(sdo: SdoAccess) -> dict[str, int | None]:
    """Objects for safety and units, by index (and subindex); None where the drive does not have one."""
    return {
        name: sdo.read_optional(index, subindex, signed=signed)
        for name, (index, subindex, signed) in objects.SETTINGS.items()
    }


def file_findings(robot: Robot, axis: int, identity: tuple[int | None, ...]) -> list[Finding]:
    """What the drive's EDS or DCF says beside the drive; nothing where the description names none.

    Args:
        robot: the description.
        axis: which drive of it, from 0.
        identity: vendor, product and revision that the drive itself tells.

    Raises:
        DriveError: the file cannot be read.
    """
    drive = robot.drive[axis]
    if drive.eds is None:
        return []
    file = read_device_file(robot.folder / drive.eds, drive.node_id)
    vendor, product, revision = identity[:3]
    compared = compare_identity(file, (vendor, product, revision))
    # What the drive lacks is told by the drive; of the file, what is wrong with it.
    return compared + [finding for finding in file.findings if not finding.text.startswith("absent")]


def refuse(reports: tuple[DriveReport, ...], names: tuple[str, ...]) -> None:
    """Refuse an arm one of whose drives has a finding that forbids to enable it.

    Raises:
        DriveError: the first one, with the number of the others.
    """
    forbidding = [
        f"{name}: {finding}"
        for report, name in zip(reports, names, strict=True)
        for finding in report.findings
        if finding.severity == "refusal"
    ]
    if forbidding:
        more = f" (and {len(forbidding) - 1} more)" if len(forbidding) > 1 else ""
        raise DriveError(forbidding[0] + more)


def _standing_error(settings: dict[str, int | None]) -> list[Finding]:
    code = settings.get("603F")
    if not code or not settings.get("1001"):
        return []
    return [Finding("warning", "603F", f"an error stands: {describe_emcy(code)}")]


def _refuse_torque(sdo: SdoAccess) -> None:
    """Wait for the end of the self-test; a drive that carries torque already has another master."""
    deadline = time.monotonic() + READY_TIMEOUT
    while True:
        state = state_of(sdo.read_int(objects.STATUSWORD))
        if state is not State.NOT_READY:
            break
        if time.monotonic() > deadline:
            raise DriveError(f"{sdo.drive} is still {state.value!r} after {READY_TIMEOUT:g} s")
        time.sleep(0.02)
    if state in TORQUE_STATES:
        raise DriveError(f"{sdo.drive} is in state {state.value!r}: something else controls it")


def _identity(sdo: SdoAccess, drive: Drive, findings: list[Finding]) -> tuple[int | None, ...]:
    """Vendor id (mandatory), product code, revision and serial number (1018h), as described.

    Raises:
        DriveError: an entry that the description names is another.
    """
    vendor = sdo.read_int(objects.IDENTITY, 1)
    found = (vendor, *(sdo.read_optional(objects.IDENTITY, subindex) for subindex in (2, 3, 4)))
    wanted = drive.identity
    entries = ("vendor", "product", "revision", "serial")
    for entry, value in zip(entries, found, strict=True):
        expected = getattr(wanted, entry)
        if expected is not None and value != expected:
            shown = "nothing" if value is None else f"0x{value:08X}"
            raise DriveError(
                f"{sdo.drive}: another drive than described: its {entry} (1018) is {shown}, "
                f"identity.{entry} is 0x{expected:08X}"
            )
    if wanted.vendor is None and wanted.product is None:
        text = f"not described; vendor = 0x{vendor:08X}, product = 0x{found[1] or 0:08X} were found"
        findings.append(Finding("info", "identity", text))
    return found


def _control_signal(sdo: SdoAccess, drive: Drive, profile: Profile) -> MappedObject:
    """The object that carries the torque.

    Raises:
        DriveError: the drive does not have it; with those that it has.
    """
    signal = drive.control_signal
    try:
        return _mapped(sdo, signal.index, signal.subindex)
    except DriveError as error:
        there = [key for key in profile.torque if sdo.read_optional(*key) is not None]
        raise DriveError(f"{error}; {other_signal_words(there)}") from error


def other_signal_words(there: list[tuple[int, int]]) -> str:
    """What to write where the described control signal is absent, from the objects that a drive has."""
    which = " or ".join(f"index = 0x{index:04X}, subindex = {subindex}" for index, subindex in there)
    return f"write control_signal with {which or 'another object of the drive'} into robot.toml"


def _mapped(sdo: SdoAccess, index: int, subindex: int) -> MappedObject:
    """An object with the width that the drive itself gives it."""
    return MappedObject(index, subindex, 8 * len(sdo.read(index, subindex)))
