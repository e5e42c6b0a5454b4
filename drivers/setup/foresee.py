"""What the opening of a drive would say, from its EDS or DCF: each step of the set-up, tried on the file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from drivers.cia402 import objects
from drivers.errors import DriveError
from drivers.frames.layout import MappedObject
from drivers.setup.device_file import DeviceFile
from drivers.setup.drive import other_signal_words, read_settings
from drivers.setup.file_drive import FileDrive, consumer_limit_findings
from drivers.setup.findings import Finding
from drivers.setup.guarding import (
    no_consumer,
    set_abort_option,
    set_deadline,
    set_heartbeat,
    watch_findings,
)
from drivers.setup.limits import compare_limits
from drivers.setup.mapping import map_pdos
from drivers.setup.mode import choose_mode, set_mode, set_period, start_up
from drivers.setup.profiles import Profile, choose_profile
from drivers.setup.synchronisation import sync_findings
from robots.description import Robot

_WATCH_SECONDS = 0.1
T = TypeVar("T")


def foresee(robot: Robot, axis: int, file: DeviceFile) -> list[Finding]:
    """Everything that the opening would refuse or note at the drive of an axis.

    Args:
        robot: the description.
        axis: from 0.
        file: the EDS or DCF of its drive.
    """
    return _Rehearsal(robot, axis, file).run()


class _Rehearsal:
    """The steps of :func:`drivers.setup.drive.configure`, each on its own: none hides another."""

    def __init__(self, robot: Robot, axis: int, file: DeviceFile) -> None:
        self._robot, self._axis, self._file = robot, axis, file
        self._drive = robot.drive[axis]
        self._sdo = FileDrive(file, robot.joint[axis].name)
        self._findings: list[Finding] = []

    def run(self) -> list[Finding]:
        """All findings, in the order of the set-up."""
        found, sdo = self._findings, self._sdo
        identity = self._drive.identity
        vendor = self._file.vendor if self._file.vendor is not None else identity.vendor
        product = self._file.product if self._file.product is not None else identity.product
        profile = choose_profile(self._drive.profile, vendor, product, sdo.drive)
        cycle_time = self._robot.bus.cycle_time
        self._try("start-up", lambda: start_up(sdo, profile, cycle_time, found))
        mode = self._mode()
        self._pdos(mode, profile)
        self._try("mode", lambda: set_mode(sdo, mode, shown=False))
        self._try("60C2", lambda: set_period(sdo, cycle_time, profile, found))
        self._try("1017", lambda: set_heartbeat(sdo, found))
        self._try("6007", lambda: found.extend(set_abort_option(sdo)))
        found += consumer_limit_findings(self._file)
        unwatched = no_consumer(sdo, self._robot.bus.master_node_id, _WATCH_SECONDS)
        found += watch_findings(unwatched, set_deadline(sdo, _WATCH_SECONDS))
        found += sync_findings(sdo, cycle_time)
        found += compare_limits(self._robot, self._axis, read_settings(sdo))
        return found

    def _mode(self) -> int:
        """The mode that the opening would take; a file need not say which ones there are."""
        sdo, csp = self._sdo, objects.CYCLIC_SYNCHRONOUS_POSITION
        if sdo.tells(objects.SUPPORTED_MODES):
            modes = sdo.read_int(objects.SUPPORTED_MODES)
            chosen = self._try("6502", lambda: choose_mode(sdo, modes, self._findings))
            return csp if chosen is None else chosen
        text = "the file does not say which modes there are: csp is supposed (the drive tells by 6502)"
        self._findings.append(Finding("info", "6502", text))
        return csp if self._file.has(objects.TARGET_POSITION) else objects.INTERPOLATED_POSITION

    def _pdos(self, mode: int, profile: Profile) -> None:
        signal, velocity = self._drive.control_signal, self._drive.velocity
        carried = self._object(signal.index, signal.subindex)
        if carried is None:
            self._no_signal(signal.index, profile)
            return
        if not self._file.objects[signal.index, signal.subindex].whole:
            text = "is no whole number, control_signal wants counts: name another object, or a data type"
            self._findings.append(Finding("refusal", f"{signal.index:04X}", text))
            return
        speed = None if velocity is None else self._object(velocity.index, velocity.subindex)
        interpolated = mode == objects.INTERPOLATED_POSITION
        plan = self._try(
            "PDO", lambda: map_pdos(self._sdo, self._drive.node_id, carried, interpolated, speed)
        )
        if plan is not None:
            self._findings += plan.findings

    def _object(self, index: int, subindex: int) -> MappedObject | None:
        entry = self._file.objects.get((index, subindex))
        return None if entry is None else MappedObject(index, subindex, entry.bits or 0)

    def _no_signal(self, index: int, profile: Profile) -> None:
        there = [key for key in profile.torque if self._file.has(*key)]
        text = f"absent: the control signal has no object; {other_signal_words(there)}"
        self._findings.append(Finding("refusal", f"{index:04X}", text))

    def _try(self, subject: str, step: Callable[[], T]) -> T | None:
        try:
            return step()
        except DriveError as error:
            text = str(error).removeprefix(f"{self._sdo.drive}: ")
            self._findings.append(Finding("refusal", subject, text))
            return None
