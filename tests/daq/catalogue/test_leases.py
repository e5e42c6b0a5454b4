"""Of all who ask for an arm one gets it; the lease of a holder that died runs out."""

from __future__ import annotations

import threading
import time
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from daq.catalogue import arms, leases
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError, Lease, LeaseHeld
from tests.daq.catalogue.entries import identity

T0 = datetime(2026, 3, 1, 2, 0, tzinfo=UTC)


def test_one_holder_at_a_time(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())
    lease = leases.take(catalogue, arm.id, 60, holder="night check", at=T0)
    with pytest.raises(LeaseHeld) as told:
        leases.take(catalogue, arm.id, 60, holder="somebody", at=T0 + timedelta(seconds=59))
    assert str(told.value) == (
        "arm tx40: is driven by night check, since 2026-03-01 02:00:00 UTC"
        " and until 02:01:00 UTC at the latest"
    )
    other = arms.register(catalogue, identity(first=200))
    leases.take(catalogue, other.id, 60, holder="somebody", at=T0)
    assert leases.release(catalogue, lease)
    assert leases.take(catalogue, arm.id, 60, holder="somebody", at=T0).holder == "somebody"


def test_a_lease_runs_out(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())
    dead = leases.take(catalogue, arm.id, 60, holder="killed", at=T0)
    assert leases.holder_of(catalogue, arm.id, at=T0 + timedelta(seconds=59)) == dead
    late = T0 + timedelta(seconds=60)
    assert leases.holder_of(catalogue, arm.id, at=late) is None
    taken = leases.take(catalogue, arm.id, 10, holder="next", at=late)
    assert (taken.holder, taken.taken, taken.expires) == ("next", late, late + timedelta(seconds=10))
    with pytest.raises(LeaseHeld, match="the lease of killed ran out; next has the arm now"):
        leases.renew(catalogue, dead, 60, at=late)
    assert not leases.release(catalogue, dead)
    assert leases.holder_of(catalogue, arm.id, at=late) == taken


def test_a_lease_is_lengthened_while_its_holder_lives(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())
    lease = leases.take(catalogue, arm.id, 60, at=T0)
    longer = leases.renew(catalogue, lease, 60, at=T0 + timedelta(seconds=50))
    assert longer.expires == T0 + timedelta(seconds=110)
    assert leases.holder_of(catalogue, arm.id, at=T0 + timedelta(seconds=100)) == longer
    leases.release(catalogue, longer)
    with pytest.raises(CatalogueError, match="was released"):
        leases.renew(catalogue, longer, 60)


def test_a_block_gives_its_lease_back_whatever_happens(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())

    def drive() -> None:
        with leases.leased(catalogue, arm.id, 60) as lease:
            assert leases.holder_of(catalogue, arm.id) == lease
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        drive()
    assert leases.holder_of(catalogue, arm.id) is None


def test_a_lease_is_renewed_for_as_long_as_a_block_lasts(catalogue: Catalogue) -> None:
    arm = arms.register(catalogue, identity())
    with leases.held(catalogue, arm.id, seconds=0.3) as first:
        deadline = time.monotonic() + 20.0
        while (now := leases.holder_of(catalogue, arm.id, at=first.taken)) is None or now.expires < (
            first.expires + timedelta(seconds=0.3)
        ):
            assert time.monotonic() < deadline, "nobody renews it"
            time.sleep(0.02)
        with pytest.raises(LeaseHeld):
            leases.take(catalogue, arm.id, 60, holder="somebody", at=first.expires)
    assert leases.holder_of(catalogue, arm.id) is None


def test_a_lease_of_a_minute_is_renewed_every_twenty_seconds(
    catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that two renewals may fail before it runs out."""
    asked: list[float | None] = []

    class Waits(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            asked.append(timeout)
            return super().wait(timeout)

    monkeypatch.setattr(leases, "Event", Waits)
    with leases.held(catalogue, arms.register(catalogue, identity()).id) as lease:
        assert lease.expires - lease.taken == timedelta(seconds=60)
    assert asked[0] == 20.0


def test_a_lease_is_not_given_back_before_its_renewal_has_ended(
    catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else what renews it would take the arm again, after it was given back."""
    done: list[str] = []
    renewing, renew, release = threading.Event(), leases.renew, leases.release

    def slowly(*asked: Any) -> Lease:
        renewing.set()
        time.sleep(0.2)
        done.append("renewed")
        return renew(*asked)

    def released(*asked: Any) -> bool:
        done.append("released")
        return release(*asked)

    monkeypatch.setattr(leases, "renew", slowly)
    monkeypatch.setattr(leases, "release", released)
    with leases.held(catalogue, arms.register(catalogue, identity()).id, seconds=0.03):
        assert renewing.wait(20.0)
    assert done[-2:] == ["renewed", "released"]


def test_leases_of_processes_that_are_gone_are_given_back_by_name(
    catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    of_dead, of_living = (arms.register(catalogue, identity(first=first)) for first in (100, 200))
    leases.take(catalogue, of_dead.id, 600.0, holder="gone")
    leases.take(catalogue, of_living.id, 600.0, holder="here")
    monkeypatch.setattr(leases, "is_gone", lambda holder: holder == "gone")
    assert leases.free_dead(catalogue, "tx40") == (of_dead.label,)
    assert leases.holder_of(catalogue, of_dead.id) is None
    assert leases.holder_of(catalogue, of_living.id) is not None
    assert leases.free_dead(catalogue, "tx40") == ()
