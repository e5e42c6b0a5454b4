"""Which bus: the name of a python-can interface and the channel on it."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path

from can.interfaces import VALID_INTERFACES

from drivers.errors import BusError
from robots import Robot

DEFAULT_PORT = 43113
"""The port that python-can's udp_multicast uses when none is given."""

NETWORK = Path("/sys/class/net")
"""A network interface that is hardware has ``device`` here."""


@dataclass(frozen=True)
class Channel:
    """A python-can interface by name and the channel on it.

    Args:
        interface: ``udp_multicast``, ``socketcan``, ``virtual`` or any other python-can interface.
        name: the channel as that interface writes it; for ``udp_multicast`` an IPv4 group, alone
            or with a port: ``239.74.163.40`` or ``239.74.163.40:43113``.

    Raises:
        BusError: unknown interface, or a name that this interface cannot have.
    """

    interface: str
    name: str

    def __post_init__(self) -> None:
        if self.interface not in VALID_INTERFACES:
            allowed = ", ".join(sorted(VALID_INTERFACES))
            raise BusError(f"unknown interface {self.interface!r}; allowed: {allowed}")
        if not self.name:
            raise BusError(f"interface {self.interface} needs a channel, got an empty name")
        if self.interface == "udp_multicast":
            self.group_and_port()

    @classmethod
    def of(cls, robot: Robot, interface: str | None = None, name: str | None = None) -> Channel:
        """The bus that was asked for, else the arm's own.

        Raises:
            MissingFromDescription: the arm has no drives, so nothing can be driven on any bus.
        """
        robot.require_drives("driving an arm, or simulating its drives,")
        bus = robot.bus
        return cls(bus.interface if interface is None else interface, bus.channel if name is None else name)

    @classmethod
    def parse(cls, text: str, interface: str = "udp_multicast") -> Channel:
        """Read ``interface:name``, or a bare name on the given interface.

        ``str()`` of a channel is read back as the same channel.
        """
        prefix, colon, rest = text.partition(":")
        if colon and prefix in VALID_INTERFACES:
            return cls(prefix, rest)
        return cls(interface, text)

    def __str__(self) -> str:
        return f"{self.interface}:{self.name}"

    @property
    def only_simulated(self) -> bool:
        """Whether no real drive can be on it: it leads nowhere outside this machine.

        An adapter may have been given any name, so one that is hardware is none of these.
        """
        named = self.interface == "socketcan" and self.name.startswith(("vcan", "vxcan"))
        virtual_device = named and not (NETWORK / self.name / "device").exists()
        return virtual_device or self.interface in ("udp_multicast", "virtual")

    def beside(self, number: int) -> Channel:
        """The multicast group so many further, with the same port; the groups of one network in a circle."""
        group, port = self.group_and_port()
        network, _, host = group.rpartition(".")
        with_port = f":{port}" if ":" in self.name else ""
        return Channel(self.interface, f"{network}.{1 + (int(host) - 1 + number) % 254}{with_port}")

    def group_and_port(self) -> tuple[str, int]:
        """The multicast group and the UDP port of a ``udp_multicast`` channel."""
        group, colon, port_text = self.name.partition(":")
        try:
            is_group = ipaddress.IPv4Address(group).is_multicast
        except ipaddress.AddressValueError:
            is_group = False
        if not is_group:
            raise BusError(
                f"channel {self.name!r} is not an IPv4 multicast group; "
                "allowed: 224.0.0.0 to 239.255.255.255, alone or with a port "
                f"as in 239.74.163.40:{DEFAULT_PORT}"
            )
        if not colon:
            return group, DEFAULT_PORT
        if not (port_text.isascii() and port_text.isdigit() and 1 <= int(port_text) <= 65535):
            raise BusError(
                f"channel {self.name!r}: port {port_text!r} is not a UDP port; allowed: 1 to 65535"
            )
        return group, int(port_text)
