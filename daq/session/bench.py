"""The one door to an arm: real drives on a bus, or simulated ones that are started for it.

Every command that may move an arm opens it here: its drives, its identity, its lease, what is unacknowledged,
how fast it may go, and who has said where it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from daq.catalogue import arms, leases
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm
from daq.catalogue.values import ArmIdentity, ArmMismatch
from daq.session.admission import (
    NOT_COMMISSIONED,
    NOTHING_MOVES,
    SIMULATED,
    STAGES,
    Admission,
    as_commissioned,
)
from daq.session.cell import Cell
from daq.session.session_error import NotMoved, SessionError
from daq.text.progress import Steps
from drivers import ArmSession, BusError, BusOccupied, Channel
from drivers.simulated import SimulatedArm, is_compiled
from drivers.simulated.group import serial_number
from robots import Robot
from robots.arrays import FloatArray

Purpose = Literal["drive", "commission", "home", "look", "demonstrate"]
"""What an arm is opened for. ``commission`` and ``home`` are on the way to a commissioned arm and have bounds
and questions of their own, ``look`` moves nothing, ``demonstrate`` is for simulated drives alone."""

GROUPS = 40
"""Multicast groups that are tried, at most."""

Look = Callable[[Robot, FloatArray], bool]


def nobody_looks(robot: Robot, posture: FloatArray) -> bool:
    """Where nobody sits in front of the arm.

    Raises:
        NotMoved: always.
    """
    raise NotMoved("somebody has to look at the arm; give --stands-at where nobody can answer")


@dataclass(frozen=True)
class ArmOrder:
    """Which arm, where.

    Attributes:
        robot: its description.
        source: its name or path, for the process of the simulated drives.
        channel: the bus.
        simulated: start simulated drives on it.
        seed: of the simulated arm.
        noise_seed: of its noise in this run; the arm's own where None.
        scenario: file that says what the simulated arm has besides.
        new_arm: accept drives that the catalogue does not know under this name.
        stands_at: (n,) posture that somebody read off the arm, for drives that do not know theirs; rad or m.
        seal: file into which the process of the simulated drives writes what only it knows.
        any_group: take the next multicast group where this one is occupied.
        not_commissioned: move it slowly although it has not been commissioned.
        look: shows the drives' positions to somebody who looks at the arm; whether it stands so.
    """

    robot: Robot
    source: str
    channel: Channel
    simulated: bool = False
    seed: int = 0
    new_arm: bool = False
    stands_at: tuple[float, ...] | None = None
    noise_seed: int | None = None
    scenario: Path | None = None
    seal: Path | None = None
    any_group: bool = False
    not_commissioned: bool = False
    look: Look = nobody_looks

    def command(self, name: str) -> str:
        """An ``armhil`` command for this arm on this bus, to be typed as it is."""
        bus = self.robot.bus
        words = [f"armhil {name} {self.source}"]
        words += [] if self.channel.interface == bus.interface else [f"--interface {self.channel.interface}"]
        words += [] if self.channel.name == bus.channel else [f"--channel {self.channel.name}"]
        return f"`{' '.join(words)}`"


@dataclass(frozen=True)
class OpenArm:
    """An arm whose drives are configured and carry no torque, and how fast it may be driven."""

    session: ArmSession
    identity: ArmIdentity
    admission: Admission
    channel: Channel
    """The bus that it is on: not the one of the order where that one was free to choose another."""
    drives: SimulatedArm | None = None
    """The simulated ones that were started for it."""


@contextmanager
def opened(
    order: ArmOrder,
    catalogue: Catalogue | None,
    steps: Steps,
    purpose: Purpose,
    cell: Cell | None = None,
) -> Iterator[OpenArm]:
    """The arm with its drives configured, known to the catalogue and leased, for the length of the block.

    Args:
        order: which arm, where.
        catalogue: None where nothing is kept.
        steps: shows what is done.
        purpose: what it is opened for.
        cell: what its motions keep clear of; None where they are too small for one to matter.

    Raises:
        BusError, DriveError: the bus is occupied, or a drive refuses.
        ArmMismatch: the drives are those of another arm than the catalogue knows under this name.
        LeaseHeld: somebody else drives it.
        SessionError: the last motion ended by itself and nobody has acknowledged it, the arm has not been
            commissioned for this, or the posture that was given is not one of this arm.
        NotMoved: nobody has said that the arm stands where its drives say.
    """
    with ExitStack() as stack:
        drives = None
        if order.simulated:
            drives, channel = _start_drives(order, steps, stack)
            order = replace(order, channel=channel)
        with steps.step("Configure drives"):
            session = ArmSession(order.robot, order.channel, allow_jog=purpose == "home")
            stack.enter_context(session)
        identity = identity_of_arm(order.robot, session.drives, simulated=order.simulated)
        _refuse_others(order, catalogue, identity)
        _refuse_unacknowledged(order, session)
        admission = _admission(order, catalogue, identity, purpose, cell)
        if catalogue is not None:
            arm = arms.register(catalogue, identity)
            if purpose != "demonstrate":  # nobody else can reach drives that this process has started for it
                leases.free_dead(catalogue, identity.name)
                stack.enter_context(leases.held(catalogue, arm.id))
        _attest(order, session, ask=purpose == "drive" and admission is NOT_COMMISSIONED)
        yield OpenArm(session, identity, admission, order.channel, drives)


def _start_drives(order: ArmOrder, steps: Steps, stack: ExitStack) -> tuple[SimulatedArm, Channel]:
    """Simulated drives on the bus, or on the next one that is free, for the length of the stack.

    Raises:
        BusError: real drives can be on that bus, or it is occupied.
    """
    if order.channel.interface == "virtual":
        raise BusError(f"{order.channel} lives inside one process; the simulated drives have their own")
    if not order.channel.only_simulated:
        raise BusError(
            f"{order.channel}: real drives can be on it; allowed for simulated drives: udp_multicast, or a"
            " vcan device of socketcan"
        )
    other = order.any_group and order.channel.interface == "udp_multicast"
    channels = [order.channel.beside(number) for number in range(GROUPS)] if other else [order.channel]
    with steps.step("Start simulated drives") as update:
        if not is_compiled():
            update(0.0, "compiled once, a minute")
        for channel in channels:
            try:
                drives = SimulatedArm(
                    order.source,
                    channel,
                    order.seed,
                    noise_seed=order.noise_seed,
                    scenario=order.scenario,
                    seal=order.seal,
                )
            except BusOccupied:
                if channel == channels[-1]:
                    raise
                continue
            return stack.enter_context(drives), channel
    raise AssertionError("there is a channel")


def _refuse_others(order: ArmOrder, catalogue: Catalogue | None, identity: ArmIdentity) -> None:
    """Are the drives that answer those that are meant?

    Raises:
        ArmMismatch: they are not.
    """
    if order.simulated:
        axes = range(order.robot.n)
        own = tuple(serial_number(order.robot, order.seed, axis) for axis in axes)
        if identity.serials != own:
            raise ArmMismatch(f"{order.channel}: other drives answer than those that were started here")
    elif catalogue is not None and not order.new_arm:
        refuse_strangers(catalogue, identity, str(order.channel))


def _refuse_unacknowledged(order: ArmOrder, session: ArmSession) -> None:
    """Raises SessionError where the last motion ended by itself and nobody has looked since."""
    if (reason := session.unacknowledged) is not None:
        raise SessionError(
            f"{order.channel}: the last motion ended by itself ({reason}); look at the arm, then"
            f" {order.command('acknowledge')}"
        )


def _admission(
    order: ArmOrder, catalogue: Catalogue | None, identity: ArmIdentity, purpose: Purpose, cell: Cell | None
) -> Admission:
    if order.simulated:
        return SIMULATED
    if purpose == "look":
        return NOTHING_MOVES
    if purpose == "commission":
        return STAGES
    if order.not_commissioned:
        return NOT_COMMISSIONED
    return as_commissioned(catalogue, identity, cell, order.command("commission"))


def refuse_strangers(catalogue: Catalogue, identity: ArmIdentity, source: str) -> None:
    """Are these the drives that are known under this name?

    Raises:
        ArmMismatch: the catalogue knows an arm of this name, and not with these drives.
    """
    if arms.find(catalogue, identity) is not None:
        return
    known = [arm for arm in arms.every(catalogue, name=identity.name) if not arm.simulated and arm.serials]
    for arm in known:
        try:
            arms.require_same_drives(arm, identity.serials, source)
        except ArmMismatch as mismatch:
            raise ArmMismatch(f"{mismatch}; where it is meant to be, give --new-arm") from None


def _attest(order: ArmOrder, session: ArmSession, *, ask: bool) -> None:
    """By what --stands-at says, or by a look at an arm that has not been commissioned.

    Raises:
        DriveError, SessionError: the arm stands elsewhere than --stands-at says.
        NotMoved: nobody looks, or who looks says no.
    """
    posture = order.stands_at
    if posture is not None:
        if len(posture) != order.robot.n:
            raise SessionError(f"--stands-at has {len(posture)} positions; allowed: {order.robot.n}")
        session.attest_position(np.array(posture))
    elif ask:
        seen = session.actual_position()
        if not order.look(order.robot, seen):
            raise NotMoved("not attested: the drives' positions are not those of the arm; nothing moved")
        session.attest_position(seen)
