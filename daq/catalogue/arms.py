"""Arms in the catalogue: which one this is, and whether a file or a bus is of another one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import count
from typing import Any

from sqlalchemy import Connection, Row, select, update

from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description, difference, keep_in
from daq.catalogue.inserting import insert_unless_there
from daq.catalogue.schema import arms
from daq.catalogue.values import Arm, ArmIdentity, ArmMismatch, CatalogueError
from daq.recording.who import now


def register(catalogue: Catalogue, identity: ArmIdentity) -> Arm:
    """The arm of that name and those serial numbers, which from now on is known.

    The description that it is run with now is kept as its last one.
    """
    with catalogue.writing() as connection:
        return register_in(connection, identity)


def register_in(connection: Connection, identity: ArmIdentity) -> Arm:
    """As :func:`register`, inside a transaction."""
    keep_in(connection, Description(identity.description_sha256, identity.parts))
    found = _matching(connection, identity)
    if found is None:
        return _added(connection, identity)
    if found.description_sha256 != identity.description_sha256:
        changed = update(arms).where(arms.c.id == found.id)
        connection.execute(changed.values(description_sha256=identity.description_sha256))
        found = get_in(connection, found.id)
    return found


def find(catalogue: Catalogue, identity: ArmIdentity) -> Arm | None:
    """The arm of that name and those serial numbers; None where it is not known."""
    with catalogue.reading() as connection:
        return _matching(connection, identity)


def get(catalogue: Catalogue, arm_id: int) -> Arm:
    """The arm of a number.

    Raises:
        CatalogueError: there is none.
    """
    with catalogue.reading() as connection:
        return get_in(connection, arm_id)


def get_in(connection: Connection, arm_id: int) -> Arm:
    """As :func:`get`, inside a transaction."""
    row = connection.execute(select(arms).where(arms.c.id == arm_id)).one_or_none()
    if row is None:
        raise CatalogueError(f"arm {arm_id}: is not in the catalogue")
    return arm_of(row)


def by_label(catalogue: Catalogue, label: str) -> Arm:
    """The arm of a label.

    Raises:
        CatalogueError: there is none; names those that there are.
    """
    known = every(catalogue)
    for arm in known:
        if arm.label == label:
            return arm
    allowed = ", ".join(arm.label for arm in known) or "none, nothing has been run yet"
    raise CatalogueError(f"arm {label}: is not in the catalogue; allowed: {allowed}")


def every(catalogue: Catalogue, *, name: str | None = None) -> tuple[Arm, ...]:
    """All arms, or those of a name, by label."""
    wanted = select(arms).order_by(arms.c.label)
    if name is not None:
        wanted = wanted.where(arms.c.name == name)
    with catalogue.reading() as connection:
        return tuple(arm_of(row) for row in connection.execute(wanted))


def require_same_drives(arm: Arm, serials: Sequence[int | None], source: str) -> None:
    """Are the drives those of the arm? Where either side has no serial number, nothing can be said.

    Args:
        arm: the one that is meant.
        serials: of the drives that are there, in the order of the joints.
        source: where they were read, for the message.

    Raises:
        ArmMismatch: one line that names the first drive that differs.
    """
    if not serials or not arm.serials:
        return
    if len(serials) != len(arm.serials):
        raise ArmMismatch(
            f"{source}: has {len(serials)} drives; arm {arm.label} of the catalogue has {len(arm.serials)}"
        )
    for joint, (there, known) in enumerate(zip(serials, arm.serials, strict=True), start=1):
        if there is not None and known is not None and there != known:
            raise ArmMismatch(
                f"{source}: the drive of joint {joint} has serial number {there};"
                f" arm {arm.label} of the catalogue has {known}: this is another arm"
            )


def require_same_description(
    catalogue: Catalogue, arm: Arm, known_sha256: str, now: Description, source: str
) -> None:
    """Is a description the one that something in the catalogue was made with?

    Args:
        catalogue: where the parts of descriptions are kept.
        arm: whose.
        known_sha256: of the description that it was made with.
        now: the one that is used now.
        source: what was made with it, for the message.

    Raises:
        ArmMismatch: one line that says what of it differs.
    """
    differs = difference(catalogue, known_sha256, now)
    if differs:
        raise ArmMismatch(
            f"{source}: was made with description {known_sha256[:12]}… of arm {arm.label}, it is"
            f" {now.sha256[:12]}… now: {differs}"
        )


def _matching(connection: Connection, identity: ArmIdentity) -> Arm | None:
    row = connection.execute(
        select(arms).where(
            arms.c.name == identity.name,
            arms.c.serials == _serials_text(identity.serials),
            arms.c.simulated == identity.simulated,
        )
    ).one_or_none()
    return None if row is None else arm_of(row)


def _added(connection: Connection, identity: ArmIdentity) -> Arm:
    """A new row under the first label that is free; another process may take one meanwhile."""
    values = {
        "name": identity.name,
        "serials": _serials_text(identity.serials),
        "simulated": identity.simulated,
        "description_sha256": identity.description_sha256,
        "first_seen": now(),
    }
    base = f"{identity.name}-sim" if identity.simulated else identity.name
    for number in count(1):
        label = base if number == 1 else f"{base}-{number}"
        if connection.execute(select(arms.c.id).where(arms.c.label == label)).first() is not None:
            continue
        added = insert_unless_there(connection, arms, {**values, "label": label})
        if added:
            break
        found = _matching(connection, identity)
        if found is not None:
            return found
    found = _matching(connection, identity)
    if found is None:
        raise AssertionError("an arm that was just added is there")
    return found


def _serials_text(serials: tuple[int | None, ...]) -> str:
    return json.dumps(serials, separators=(",", ":"))


def arm_of(row: Row[Any]) -> Arm:
    """The value of a row of ``arms``."""
    fields = row._mapping
    return Arm(
        id=fields["id"],
        label=fields["label"],
        name=fields["name"],
        serials=tuple(json.loads(fields["serials"])),
        simulated=fields["simulated"],
        description_sha256=fields["description_sha256"],
        first_seen=fields["first_seen"],
    )
