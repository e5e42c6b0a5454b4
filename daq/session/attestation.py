"""Somebody looked at an arm and said where it stands: kept in the catalogue, and found there again.

An absolute encoder keeps its position when the supply is off, so what was said of it counts until a drive
or the description is another. A drive that forgets is looked at again each time (``--stands-at``).
"""

from __future__ import annotations

import json

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.kept_run import kept_run
from daq.catalogue.seals import is_whole
from daq.catalogue.values import ArmIdentity, Run
from daq.session.bench import ArmOrder
from daq.session.session_error import SessionError
from robots.arrays import FloatArray

STAGE = "home"
"""Of the runs of kind ``commission`` that are attestations."""


def keep_attestation(
    catalogue: Catalogue | None, identity: ArmIdentity, posture: FloatArray, order: ArmOrder, note: str
) -> int | None:
    """Keep that the drives' positions (n,), rad or m, were compared with the arm; its run's number."""
    facts = {
        "channel": str(order.channel),
        "description": identity.description_sha256,
        "posture": json.dumps([float(position) for position in posture]),
    }
    with kept_run(catalogue, identity, "commission", stage=STAGE, facts=facts, note=note) as kept:
        kept.outcome = "completed"
    return kept.number


def last_attestation(catalogue: Catalogue | None, identity: ArmIdentity) -> Run | None:
    """The latest attestation of this arm (its drives) with this description; None where there is none."""
    arm = None if catalogue is None else arms.find(catalogue, identity)
    if catalogue is None or arm is None:
        return None
    for run in runs.every(catalogue, arm=arm.label, kind="commission", stage=STAGE):
        same = run.facts.get("description") == identity.description_sha256
        if run.outcome == "completed" and same and is_whole(run, identity):
            return run
    return None


def attested_words(catalogue: Catalogue | None, identity: ArmIdentity, order: ArmOrder) -> str:
    """Who has said where the arm stands, and when.

    Raises:
        SessionError: nobody has, and the arm is not a simulated one.
    """
    if order.stands_at is not None:
        return "posture as given by --stands-at"
    if order.simulated:
        return "posture of a simulated arm"
    found = last_attestation(catalogue, identity)
    if found is None:
        raise SessionError(
            f"nobody has compared the drives' positions with this arm ({order.robot.name}) and its"
            f" description yet: `armhil home {order.source}`, or give --stands-at"
        )
    return f"posture attested by {found.who} in run {found.id}"
