"""``armhil doctor``: is this machine fit to drive this arm? Each check with what to do about it."""

from __future__ import annotations

import importlib.util
import os
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from drivers import Budgets, BusError, Channel, DriveError, open_bus
from drivers.bus.access import BusLock
from drivers.bus.budget import BusBudget, nominal_links
from drivers.bus.multicast import RECEIVE_BUFFER
from drivers.cyclic.realtime import MASTER_PRIORITY
from drivers.setup.eds import DeviceFile, read_device_file
from drivers.setup.findings import Finding
from drivers.setup.mapping import refuse_shared_cob_ids
from robots import Robot

Status = Literal["ok", "warning", "failed", "unknown"]
CODES: dict[Status, int] = {"ok": 0, "warning": 1, "failed": 2, "unknown": 3}
"""Exit codes; the worst check decides, and failed is worse than unknown."""
_RANK: dict[Status, int] = {"ok": 0, "warning": 1, "unknown": 2, "failed": 3}

PACKAGES = ("robots", "drivers", "trajectories", "ident", "daq")
LIBRARIES = ("numpy", "scipy", "pin", "ruckig", "python-can", "canopen", "mcap", "numba")
TIMER_TRIES = 100
TIMER_SECONDS = 0.002


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: of the check.
        status: what it found.
        detail: in words.
        remedy: what to do; empty where nothing is to be done.
    """

    name: str
    status: Status
    detail: str
    remedy: str = ""


def examine(robot: Robot, channel: Channel) -> tuple[Check, ...]:
    """Look at everything that can be looked at without moving anything or sending a frame.

    Args:
        robot: the arm.
        channel: where its drives are.
    """
    checks: list[Check] = [*environment_checks(), *shadowing_checks()]
    checks += [*bus_checks(channel), budget_check(robot, channel), *device_file_checks(robot)]
    checks += [priority_check(), memory_check(), clock_check(), timer_check(robot.bus.cycle_time)]
    return tuple(checks)


def worst(checks: Iterable[Check]) -> Status:
    """The status that decides."""
    return max((check.status for check in checks), key=lambda status: _RANK[status], default="ok")


def doctor_json(robot: Robot, channel: Channel, checks: tuple[Check, ...]) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "armhil": version("armhil"),
        "robot": robot.name,
        "channel": str(channel),
        "status": worst(checks),
        "checks": [asdict(check) for check in checks],
    }


def describe(checks: tuple[Check, ...]) -> str:
    """One line per check, and one below it where something is to be done."""
    lines = []
    for check in checks:
        lines.append(f"{check.status:8} {check.name}: {check.detail}")
        if check.remedy and check.status != "ok":
            lines.append(f"         → {check.remedy}")
    return "\n".join(lines)


# Environment ---------------------------------------------------------------------------------


def environment_checks() -> list[Check]:
    """Python and the libraries."""
    python = ".".join(str(part) for part in sys.version_info[:3])
    fit = sys.version_info >= (3, 11)
    checks = [
        Check("python", "ok" if fit else "failed", python, "" if fit else "install Python 3.11 or newer")
    ]
    found, lacking = [], []
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            lacking.append(name)
    if lacking:
        remedy = "install armhil anew with its dependencies"
        return [*checks, Check("libraries", "failed", f"missing: {', '.join(lacking)}", remedy)]
    return [*checks, Check("libraries", "ok", ", ".join(found))]


def shadowing_checks(path: list[str] | None = None) -> list[Check]:
    """Do our packages, whose names are plain words, come from one place, and from ours?"""
    home = Path(__file__).resolve().parents[1]
    strangers = []
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        origin = Path(spec.origin).resolve() if spec is not None and spec.origin else None
        if origin is None or not origin.is_relative_to(home):
            strangers.append(f"{name} from {origin}")
    others = [
        str(Path(entry or ".") / name)
        for entry in (sys.path if path is None else path)
        for name in PACKAGES
        if _is_package(Path(entry or ".") / name) and (Path(entry or ".")).resolve() != home
    ]
    if strangers:
        remedy = "leave the folder that holds the other package, or take it off PYTHONPATH"
        return [Check("packages", "failed", f"another package is in the way: {strangers[0]}", remedy)]
    if others:
        remedy = "take it off PYTHONPATH, or uninstall it, before something imports the wrong one"
        return [Check("packages", "warning", f"a second package of the same name: {others[0]}", remedy)]
    return [Check("packages", "ok", f"{', '.join(PACKAGES)} come from one place")]


def _is_package(path: Path) -> bool:
    return (path / "__init__.py").is_file() or path.with_suffix(".py").is_file()


# Bus -----------------------------------------------------------------------------------------


def bus_checks(channel: Channel) -> list[Check]:
    """Can the bus be opened, is it free, and is its receive buffer large enough?"""
    try:
        with open_bus(channel, []) as bus:
            buffer = _receive_buffer(bus)
    except BusError as error:
        return [Check("bus", "failed", str(error), _bus_remedy(channel, str(error)))]
    checks = [Check("bus", "ok", f"{channel} opens")]
    try:
        BusLock(channel).release()
    except BusError as error:
        checks.append(Check("master", "failed", str(error), "end the other run first"))
    if buffer is None:
        checks.append(Check("receive buffer", "unknown", f"interface {channel.interface} does not tell"))
    elif buffer < RECEIVE_BUFFER // 4:
        remedy = f"as root: sysctl -w net.core.rmem_max={RECEIVE_BUFFER}"
        text = f"{buffer} bytes: a stall of the machine may lose frames"
        checks.append(Check("receive buffer", "warning", text, remedy))
    else:
        checks.append(Check("receive buffer", "ok", f"{buffer} bytes"))
    return checks


def _receive_buffer(bus: Any) -> int | None:
    sock = bus.sockets[0] if hasattr(bus, "sockets") else getattr(bus, "socket", None)
    if not isinstance(sock, socket.socket):
        return None
    return sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


def _bus_remedy(channel: Channel, message: str) -> str:
    if "no CAN device" in message:
        return f"plug the adapter in, or: ip link add {channel.name} type vcan"
    if "device is down" in message:
        return f"as root: ip link set {channel.name} up type can bitrate 1000000"
    if "kernel has no CAN" in message:
        return "use a kernel with SocketCAN, or interface udp_multicast with simulated drives"
    if "driver of interface" in message:
        return "install the maker's library"
    if "permission" in message:
        return "run as a user who may open the device"
    return "name another --interface or --channel"


def budget_check(robot: Robot, channel: Channel) -> Check:
    """The worst-case load of the bus with the mapping that the description asks for."""
    budgets = Budgets.on(channel, robot.bus.cycle_time)
    budget = BusBudget.of(robot, nominal_links(robot), budgets)
    fastest = budget.fastest_cycle()
    text = (
        f"{100 * budget.load:.0f} % of {budget.bitrate / 1000:g} kbit/s at worst with a cycle of "
        f"{1e3 * budget.cycle_time:g} ms; allowed: {100 * budget.limit:.0f} %"
    )
    advice = f"set bus.cycle_time to {fastest:g} s or more" if fastest else "raise bus.bitrate"
    if budget.load > budget.limit:
        return Check("bus load", "failed", text, advice)
    return Check("bus load", "ok", text + (f"; fastest safe cycle {1e3 * fastest:g} ms" if fastest else ""))


def device_file_checks(robot: Robot) -> list[Check]:
    """The EDS and DCF files that the description names."""
    checks, files = [], dict[str, DeviceFile]()
    for joint, drive in zip(robot.joint, robot.drive, strict=True):
        if drive.eds is None:
            continue
        name = f"device file of {joint.name}"
        try:
            file = files[joint.name] = read_device_file(robot.folder / drive.eds, drive.node_id)
        except DriveError as error:
            checks.append(Check(name, "failed", str(error), "give the EDS or DCF of this drive"))
            continue
        checks.append(_of_findings(name, file.findings))
    try:
        refuse_shared_cob_ids({name: file.transmitted_cob_ids() for name, file in files.items()})
    except DriveError as error:
        remedy = "write COB-IDs with $NODEID, or give each drive a file of its own"
        checks.append(Check("COB-IDs", "failed", str(error), remedy))
    return checks


def _of_findings(name: str, findings: tuple[Finding, ...]) -> Check:
    for severity, status in (("refusal", "failed"), ("warning", "warning")):
        chosen = [str(finding) for finding in findings if finding.severity == severity]
        if chosen:
            remedy = "see the maker's manual for these objects"
            return Check(name, status, "; ".join(chosen), remedy)  # type: ignore[arg-type]
    return Check(name, "ok", "; ".join(str(finding) for finding in findings) or "complete")


# System --------------------------------------------------------------------------------------


def priority_check() -> Check:
    """Would the system give the cyclic process SCHED_FIFO? Asked for in a process of its own."""
    if not hasattr(os, "sched_setscheduler"):
        return Check(
            "real-time priority", "warning", "this system has no SCHED_FIFO", "use Linux for real arms"
        )
    asking = "from drivers.cyclic.realtime import *; print(take_priority(MASTER_PRIORITY) or '')"
    home = str(Path(__file__).resolve().parents[1])
    answer = subprocess.run(
        [sys.executable, "-c", asking], cwd=home, capture_output=True, text=True, check=False
    )
    refused = answer.stdout.strip() or answer.stderr.strip().rpartition("\n")[2]
    if not refused:
        return Check("real-time priority", "ok", f"SCHED_FIFO {MASTER_PRIORITY} is permitted")
    remedy = "in /etc/security/limits.conf: <user> - rtprio 50, then log in anew"
    return Check("real-time priority", "warning", refused, remedy)


def memory_check() -> Check:
    """May memory be locked, so that no page of the cyclic process is ever waited for?"""
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    if limit == resource.RLIM_INFINITY or os.geteuid() == 0:
        return Check("locked memory", "ok", "unlimited")
    remedy = "in /etc/security/limits.conf: <user> - memlock unlimited, then log in anew"
    return Check("locked memory", "warning", f"limited to {limit} bytes", remedy)


def clock_check() -> Check:
    """The clock that SYNC goes by."""
    info = time.get_clock_info("monotonic")
    source = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    name = source.read_text().strip() if source.is_file() else info.implementation
    if info.resolution > 1e-6:
        return Check("clock", "failed", f"{name}, resolution {info.resolution:g} s", "use another system")
    if name in ("acpi_pm", "jiffies", "refined-jiffies"):
        return Check("clock", "warning", f"clock source {name} is slow", "boot with clocksource=tsc or hpet")
    return Check("clock", "ok", f"{name}, resolution {info.resolution:g} s")


def timer_check(cycle_time: float) -> Check:
    """How late this machine wakes an ordinary process now, beside the SYNC period."""
    late = []
    for _ in range(TIMER_TRIES):
        due = time.monotonic() + TIMER_SECONDS
        time.sleep(TIMER_SECONDS)
        late.append(time.monotonic() - due)
    worst_of_ten = float(np.quantile(late, 0.9))
    text = f"woken {1e3 * worst_of_ten:.2f} ms late (90 %), {1e3 * max(late):.2f} ms at worst"
    if worst_of_ten > 0.5 * cycle_time:
        remedy = "end other programs, or permit real-time priority"
        return Check("timer", "warning", f"{text}; a cycle is {1e3 * cycle_time:g} ms", remedy)
    return Check("timer", "ok", text)
