"""The arm of a session: real drives on a bus, or simulated ones that are started for it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.catalogue import arms, leases
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm
from daq.catalogue.values import ArmIdentity, ArmMismatch
from daq.progress import Steps
from daq.session.session_error import SessionError
from drivers import ArmSession, BusError, Channel
from drivers.simulated import SimulatedArm
from robots import Robot


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


@dataclass(frozen=True)
class OpenArm:
    """An arm whose drives are configured and carry no torque."""

    session: ArmSession
    identity: ArmIdentity


@contextmanager
def opened(
    order: ArmOrder, catalogue: Catalogue | None, steps: Steps, *, allow_homing: bool = False
) -> Iterator[OpenArm]:
    """The arm with its drives configured, known to the catalogue and leased, for the length of the block.

    Args:
        order: which arm, where.
        catalogue: None where nothing is kept.
        steps: shows what is done.
        allow_homing: whether its drives may search their home.

    Raises:
        BusError, DriveError: the bus is occupied, or a drive refuses.
        ArmMismatch: the drives are those of another arm than the catalogue knows under this name.
        LeaseHeld: somebody else drives it.
        SessionError: the posture that was given is not one of this arm.
    """
    with ExitStack() as stack:
        if order.simulated:
            if order.channel.interface == "virtual":
                raise BusError(
                    f"{order.channel} lives inside one process; the simulated drives have their own"
                )
            with steps.step("Start simulated drives"):
                drives = SimulatedArm(
                    order.source,
                    order.channel,
                    order.seed,
                    noise_seed=order.noise_seed,
                    scenario=order.scenario,
                )
                stack.enter_context(drives)
        with steps.step("Configure drives"):
            session = stack.enter_context(ArmSession(order.robot, order.channel, allow_jog=allow_homing))
        identity = identity_of_arm(order.robot, session.drives, simulated=order.simulated)
        if catalogue is not None:
            if not (order.simulated or order.new_arm):
                refuse_strangers(catalogue, identity, str(order.channel))
            arm = arms.register(catalogue, identity)
            stack.enter_context(leases.held(catalogue, arm.id))
        if order.stands_at is not None:
            _attest(session, order.stands_at)
        yield OpenArm(session, identity)


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


def _attest(session: ArmSession, posture: tuple[float, ...]) -> None:
    if len(posture) != session.robot.n:
        raise SessionError(f"--stands-at has {len(posture)} positions; allowed: {session.robot.n}")
    session.attest_position(np.array(posture))
