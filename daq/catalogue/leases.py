"""Leases: one holder at a time may drive an arm; the lease of a holder that died runs out."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from threading import Event, Thread
from typing import Any

from sqlalchemy import Row, delete, select, update
from sqlalchemy.dialects import postgresql, sqlite

from daq.catalogue.arms import every as every_arm
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import arms, leases
from daq.catalogue.values import CatalogueError, Lease, LeaseHeld
from daq.recording.who import is_gone, now, this_process

log = logging.getLogger(__name__)


def take(
    catalogue: Catalogue,
    arm_id: int,
    seconds: float,
    *,
    holder: str | None = None,
    at: datetime | None = None,
) -> Lease:
    """Take the lease of an arm, or lengthen the one that this holder has.

    One statement decides, so of any number of processes that ask at once one gets it.

    Args:
        arm_id: of the arm.
        seconds: how long it holds without being renewed.
        holder: who; this process where None.
        at: the time now; the clock's where None. Hosts that share a catalogue keep their clocks by NTP.

    Raises:
        LeaseHeld: somebody else has it.
    """
    holder, at = holder or this_process(), at or now()
    values = {"arm_id": arm_id, "holder": holder, "taken": at, "expires": at + timedelta(seconds=seconds)}
    with catalogue.writing() as connection:
        dialect: Any = postgresql if connection.dialect.name == "postgresql" else sqlite
        free = (leases.c.expires <= at) | (leases.c.holder == holder)
        statement = dialect.insert(leases).values(values)
        statement = statement.on_conflict_do_update(index_elements=["arm_id"], set_=values, where=free)
        connection.execute(statement)
        held = _lease_of(connection.execute(select(leases).where(leases.c.arm_id == arm_id)).one())
        if held.holder != holder:
            label = connection.execute(select(arms.c.label).where(arms.c.id == arm_id)).scalar_one()
            raise LeaseHeld(
                f"arm {label}: is driven by {held.holder}, since {held.taken:%Y-%m-%d %H:%M:%S} UTC and until"
                f" {held.expires:%H:%M:%S} UTC at the latest"
            )
    return held


def renew(catalogue: Catalogue, lease: Lease, seconds: float, *, at: datetime | None = None) -> Lease:
    """Hold a lease for longer.

    Raises:
        LeaseHeld: it ran out, and somebody else took it.
        CatalogueError: it was released.
    """
    at = at or now()
    expires = at + timedelta(seconds=seconds)
    mine = (leases.c.arm_id == lease.arm_id) & (leases.c.holder == lease.holder)
    with catalogue.writing() as connection:
        if connection.execute(update(leases).where(mine).values(expires=expires)).rowcount:
            return Lease(lease.arm_id, lease.holder, lease.taken, expires)
        row = connection.execute(select(leases).where(leases.c.arm_id == lease.arm_id)).one_or_none()
    if row is None:
        raise CatalogueError(f"arm {lease.arm_id}: the lease of {lease.holder} was released")
    raise LeaseHeld(f"arm {lease.arm_id}: the lease of {lease.holder} ran out; {row.holder} has the arm now")


def release(catalogue: Catalogue, lease: Lease) -> bool:
    """Give a lease back; False where it was this holder's no longer."""
    mine = (leases.c.arm_id == lease.arm_id) & (leases.c.holder == lease.holder)
    with catalogue.writing() as connection:
        return bool(connection.execute(delete(leases).where(mine)).rowcount)


def holder_of(catalogue: Catalogue, arm_id: int, *, at: datetime | None = None) -> Lease | None:
    """The lease of an arm that holds now; None where it is free."""
    with catalogue.reading() as connection:
        row = connection.execute(select(leases).where(leases.c.arm_id == arm_id)).one_or_none()
    held = None if row is None else _lease_of(row)
    return held if held is not None and held.expires > (at or now()) else None


def free_dead(catalogue: Catalogue, name: str) -> tuple[str, ...]:
    """Give back the leases of arms of a name whose holder on this host is gone; labels of those arms.

    The lease of a holder on another host runs out by itself.
    """
    freed = []
    for arm in every_arm(catalogue, name=name):
        lease = holder_of(catalogue, arm.id)
        if lease is not None and is_gone(lease.holder) and release(catalogue, lease):
            log.warning("arm %s: the process that held it is gone; its lease was given back", arm.label)
            freed.append(arm.label)
    return tuple(freed)


@contextmanager
def leased(catalogue: Catalogue, arm_id: int, seconds: float) -> Iterator[Lease]:
    """Hold the lease of an arm inside the block.

    Raises:
        LeaseHeld: somebody else has it.
    """
    lease = take(catalogue, arm_id, seconds)
    try:
        yield lease
    finally:
        release(catalogue, lease)


@contextmanager
def held(catalogue: Catalogue, arm_id: int, seconds: float = 60.0) -> Iterator[Lease]:
    """Hold the lease of an arm for as long as the block lasts, however long that is.

    A thread renews it; where this process dies, nobody does, and it runs out after ``seconds``.

    Raises:
        LeaseHeld: somebody else has it.
    """
    ended = Event()

    def renew_until_ended(lease: Lease) -> None:
        while not ended.wait(seconds / 3):
            try:
                lease = renew(catalogue, lease, seconds)
            except CatalogueError as error:
                log.warning("%s", error)

    with leased(catalogue, arm_id, seconds) as lease:
        renewing = Thread(target=renew_until_ended, args=(lease,), name="lease", daemon=True)
        renewing.start()
        try:
            yield lease
        finally:
            ended.set()
            renewing.join()


def _lease_of(row: Row[Any]) -> Lease:
    return Lease(**row._mapping)
