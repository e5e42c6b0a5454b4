"""Is a kept run of commissioning what was kept? Its checksum covers arm, stage, outcome and facts.

What an arm may do rests on such runs. A value that was damaged and is plausible, or a run that has come to
another arm, would let it do what it has never done.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from sqlalchemy import Connection, select, update

from daq.catalogue.schema import arms, runs
from daq.catalogue.values import Arm, ArmIdentity, Run

SEAL = "seal"
"""Among the facts of a run."""
SEALED_KINDS = ("commission",)


def seal_of(arm: Arm | ArmIdentity, kind: str, stage: str, outcome: str, facts: Mapping[str, Any]) -> str:
    """SHA-256 of what a run counts for; facts as JSON keeps them."""
    others = {key: value for key, value in facts.items() if key != SEAL}
    said = [arm.name, list(arm.serials), bool(arm.simulated), kind, stage, outcome, others]
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def is_whole(run: Run, arm: Arm | ArmIdentity) -> bool:
    """Whether a run is as it was kept, and of this arm."""
    return run.seal == seal_of(arm, run.kind, run.stage, run.outcome, run.facts)


def seal_kept_in(connection: Connection) -> None:
    """Runs from before there were seals get theirs, once: what stands there now is believed."""
    of_run = (runs.c.id, runs.c.kind, runs.c.stage, runs.c.outcome, runs.c.facts)
    wanted = select(*of_run, arms.c.name, arms.c.serials, arms.c.simulated)
    wanted = wanted.join(arms, arms.c.id == runs.c.arm_id)
    wanted = wanted.where(runs.c.kind.in_(SEALED_KINDS), runs.c.state == "finished")
    for row in connection.execute(wanted).all():
        arm = ArmIdentity(row.name, tuple(json.loads(row.serials)), "", row.simulated)
        facts = {**row.facts, SEAL: seal_of(arm, row.kind, row.stage, row.outcome, row.facts)}
        connection.execute(update(runs).where(runs.c.id == row.id).values(facts=facts))
