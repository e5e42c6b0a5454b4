"""``armhil doctor``: is this machine fit to drive this arm? Each check with what to do about it."""

from __future__ import annotations

import socket
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

from daq.doctor.check import Check, Status, worst
from daq.doctor.environment import machine_checks
from drivers import Budgets, BusError, Channel, DriveError, open_bus
from drivers.bus.adapters import ADAPTERS
from drivers.bus.budget import BusBudget, nominal_links
from drivers.bus.bus_lock import BusLock
from drivers.bus.multicast import RECEIVE_BUFFER
from drivers.setup.device_file import DeviceFile
from drivers.setup.eds import read_device_file
from drivers.setup.findings import Finding
from drivers.setup.foresee import foresee
from drivers.setup.mapping import refuse_shared_cob_ids
from robots import Robot


def examine(robot: Robot | None = None, channel: Channel | None = None) -> tuple[Check, ...]:
    """Look at everything that can be looked at without moving anything or sending a frame.

    Args:
        robot: the arm; only this machine is looked at where None.
        channel: where its drives are; the bus is left alone where None.
    """
    machine = machine_checks() if robot is None else machine_checks(robot.bus.cycle_time)
    if robot is None:
        return tuple(machine)
    bus = [] if channel is None else bus_checks(channel)
    nominal = channel or Channel(robot.bus.interface, robot.bus.channel)
    return (*machine, *bus, budget_check(robot, nominal), *device_file_checks(robot))


def doctor_json(robot: Robot | None, channel: Channel | None, checks: tuple[Check, ...]) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "armhil": version("armhil"),
        "robot": None if robot is None else robot.name,
        "channel": None if channel is None else str(channel),
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


# Bus -----------------------------------------------------------------------------------------


def bus_checks(channel: Channel) -> list[Check]:
    """Can the bus be opened, is it free, and is its receive buffer large enough?"""
    try:
        with open_bus(channel, []) as bus:
            buffer = _receive_buffer(bus)
    except BusError as error:
        return [Check("bus", "failed", str(error), _bus_remedy(channel, str(error)))]
    checks = [Check("bus", "ok", f"{channel} opens"), *adapter_checks(channel)]
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


def adapter_checks(channel: Channel) -> list[Check]:
    """What the interface does not tell; nothing where simulated drives are on it."""
    if channel.only_simulated:
        return []
    known = ADAPTERS.get(channel.interface)
    if known is None:
        text = f"interface {channel.interface}: not known whether it tells bus-off, error-passive and times"
        return [Check("adapter", "unknown", text)]
    lacks = []
    if not known.state:
        lacks.append("bus-off and error-passive are not told: they show as answers that stay away")
    if not known.stamps:
        lacks.append("no time stamps: recorded frames carry the time at which this program fetched them")
    if not lacks:
        return [Check("adapter", "ok", f"{channel.interface} tells the controller's state and receive times")]
    remedy = "use an adapter with a SocketCAN driver for a real arm"
    return [Check("adapter", "warning", f"{channel.interface}: {'; '.join(lacks)}", remedy)]


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
        extra = ADAPTERS[channel.interface].extra if channel.interface in ADAPTERS else ""
        return f"pip install armhil[{extra}]" if extra else "install the maker's library"
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
    told: dict[str, list[Finding]] = {}
    for axis, (joint, drive) in enumerate(zip(robot.joint, robot.drive, strict=True)):
        if drive.eds is None:
            continue
        name = f"device file of {joint.name}"
        try:
            file = files[joint.name] = read_device_file(robot.folder / drive.eds, drive.node_id)
        except DriveError as error:
            checks.append(Check(name, "failed", str(error), "give the EDS or DCF of this drive"))
            continue
        # What the master would miss is said by the rehearsal of the opening.
        wrong = [finding for finding in file.findings if not finding.text.startswith("absent")]
        try:
            foreseen = foresee(robot, axis, file)
        except DriveError as error:
            checks.append(Check(name, "failed", str(error), "correct profile in robot.toml"))
            continue
        told[joint.name] = [*wrong, *foreseen]
    checks += _of_findings(told)
    try:
        refuse_shared_cob_ids({name: file.transmitted_cob_ids() for name, file in files.items()})
    except DriveError as error:
        remedy = "write COB-IDs with $NODEID, or give each drive a file of its own"
        checks.append(Check("COB-IDs", "failed", str(error), remedy))
    return checks


def _of_findings(told: dict[str, list[Finding]]) -> list[Check]:
    """One check per finding, of all joints together whose files say the same; the worst ones first."""
    checks: list[Check] = []
    kinds: tuple[tuple[str, Status], ...] = (("refusal", "failed"), ("warning", "warning"))
    for severity, status in kinds:
        joints: dict[str, list[str]] = {}
        for joint, findings in told.items():
            for text in dict.fromkeys(str(finding) for finding in findings if finding.severity == severity):
                joints.setdefault(text, []).append(joint)
        checks += [
            Check(f"device file of {', '.join(names)}", status, text) for text, names in joints.items()
        ]
    quiet: dict[str, list[str]] = {}
    for joint, findings in told.items():
        if all(finding.severity == "info" for finding in findings):
            quiet.setdefault("; ".join(map(str, findings)) or "complete", []).append(joint)
    return checks + [Check(f"device file of {', '.join(names)}", "ok", text) for text, names in quiet.items()]
