"""Runs in the catalogue: begun, ended, noted, found again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, cast, get_args

from sqlalchemy import Connection, Row, Select, insert, select, update

from daq.catalogue import arms
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import OWED, runs
from daq.catalogue.schema import arms as arms_table
from daq.catalogue.seals import SEAL, SEALED_KINDS, seal_of
from daq.catalogue.values import ArmIdentity, CatalogueError, Run, RunKind, RunOutcome
from daq.recording.steady_clock import SteadyClock
from daq.recording.who import is_gone, now, this_process, user

_clocks: dict[tuple[str, int], SteadyClock] = {}
"""Of the runs that this process has begun, by catalogue and number."""

UNJUDGED = "recorded to the end, but the check ended before its verdict"
"""Reason of a check whose process has ended between the recording and the verdict."""


def begin(
    catalogue: Catalogue,
    identity: ArmIdentity,
    kind: RunKind,
    *,
    stage: str = "",
    capture: str | None = None,
    trajectory: str = "",
    facts: Mapping[str, Any] | None = None,
    note: str = "",
) -> Run:
    """A run has begun; the arm is registered where it is new.

    Args:
        identity: of the arm.
        stage: of commissioning.
        capture: path of the recording that is being made.
        trajectory: in words or as a path.
        facts: what else is known; values that JSON has.
        note: the operator's.
    """
    clock = SteadyClock()
    with catalogue.writing() as connection:
        arm = arms.register_in(connection, identity)
        values = {
            "arm_id": arm.id,
            "kind": kind,
            "stage": stage,
            "description_sha256": identity.description_sha256,
            "started": clock.moment(),
            "who": user(),
            "process": this_process(),
            "capture": capture,
            "trajectory": trajectory,
            "state": "running",
            "facts": dict(facts or {}),
            "note": note,
        }
        number = connection.execute(insert(runs).values(values)).inserted_primary_key
        begun = get_in(connection, int(number[0]))  # type: ignore[index]
    _clocks[str(catalogue.url), begun.id] = clock
    return begun


def time_of(catalogue: Catalogue, run: Run) -> datetime:
    """The time, UTC, as it passes for a run: never back, also where the host's clock is set meanwhile."""
    clock = _clocks.get((str(catalogue.url), run.id))
    return max(run.started, now() if clock is None else clock.moment())


def finish(
    catalogue: Catalogue,
    run_id: int,
    outcome: RunOutcome,
    *,
    reason: str = "",
    capture: str | None = None,
    capture_sha256: str | None = None,
    trajectory: str | None = None,
    facts: Mapping[str, Any] | None = None,
) -> Run:
    """A run has ended.

    Args:
        run_id: of the run.
        outcome: how.
        reason: in words, where it was not completed.
        capture, capture_sha256, trajectory: where they were not known before.
        facts: added to those of the beginning.

    Raises:
        CatalogueError: there is no such run.
    """
    with catalogue.writing() as connection:
        known = get_in(connection, run_id, change=True)
        values: dict[str, Any] = {
            "state": "finished",
            "finished": time_of(catalogue, known),
            "outcome": outcome,
            "reason": reason,
        }
        if known.kind != "check" or known.stage or outcome != "completed":
            values["process"] = ""  # of a check that was recorded, the verdict is still owed
        given = {"capture": capture, "capture_sha256": capture_sha256, "trajectory": trajectory}
        values |= {key: value for key, value in given.items() if value is not None}
        told = {**known.facts, **(facts or {})}
        if known.kind in SEALED_KINDS:
            arm = arms.get_in(connection, known.arm_id)
            told[SEAL] = seal_of(arm, known.kind, known.stage, outcome, json.loads(json.dumps(told)))
        values["facts"] = told
        connection.execute(update(runs).where(runs.c.id == run_id).values(values))
        return get_in(connection, run_id)


def note(catalogue: Catalogue, run_id: int, text: str) -> Run:
    """Add a line to the note of a run; what was noted before stays.

    Raises:
        CatalogueError: there is no such run.
    """
    with catalogue.writing() as connection:
        before = get_in(connection, run_id, change=True).note
        changed = f"{before}\n{text}" if before else text
        connection.execute(update(runs).where(runs.c.id == run_id).values(note=changed))
        return get_in(connection, run_id)


def forget_capture_in(connection: Connection, run_id: int) -> None:
    """The recording of a run was deleted; its checksum stays, so that it is known again."""
    connection.execute(update(runs).where(runs.c.id == run_id).values(capture=None))


def get(catalogue: Catalogue, run_id: int) -> Run:
    """The run of a number.

    Raises:
        CatalogueError: there is none.
    """
    with catalogue.reading() as connection:
        return get_in(connection, run_id)


def get_in(connection: Connection, run_id: int, *, change: bool = False) -> Run:
    """As :func:`get`, inside a transaction; with ``change`` nobody else changes it until that ends."""
    wanted = _select().where(runs.c.id == run_id)
    row = connection.execute(wanted.with_for_update(of=runs) if change else wanted).one_or_none()
    if row is None:
        raise CatalogueError(f"run {run_id}: is not in the catalogue; `armhil runs` lists those that are")
    return _run_of(row)


def every(
    catalogue: Catalogue,
    *,
    arm: str | None = None,
    kind: RunKind | None = None,
    stage: str | None = None,
    since: datetime | None = None,
    before: datetime | None = None,
    limit: int | None = None,
) -> tuple[Run, ...]:
    """Runs, the one that began last first.

    Args:
        arm: label of the arm.
        kind, stage: only these.
        since, before: started at or after, and before.
        limit: at most so many.
    """
    wanted = _select().order_by(runs.c.id.desc())
    for column, value in ((arms_table.c.label, arm), (runs.c.kind, kind), (runs.c.stage, stage)):
        if value is not None:
            wanted = wanted.where(column == value)
    if since is not None:
        wanted = wanted.where(runs.c.started >= since)
    if before is not None:
        wanted = wanted.where(runs.c.started < before)
    if limit is not None:
        wanted = wanted.limit(limit)
    with catalogue.reading() as connection:
        return tuple(_run_of(row) for row in connection.execute(wanted))


def of_capture(catalogue: Catalogue, sha256: str) -> Run | None:
    """The run that a recording is of, by its checksum; the first where there are several."""
    wanted = _select().where(runs.c.capture_sha256 == sha256).order_by(runs.c.id).limit(1)
    with catalogue.reading() as connection:
        row = connection.execute(wanted).one_or_none()
    return None if row is None else _run_of(row)


def kind_of(text: str | None) -> RunKind | None:
    """The kind of that name; None stays None.

    Raises:
        CatalogueError: there is none.
    """
    if text is not None and text not in get_args(RunKind):
        raise CatalogueError(f"--kind {text}; allowed: {', '.join(get_args(RunKind))}")
    return cast("RunKind | None", text)


def unjudged(run: Run | None, judged: int) -> Run | None:
    """A check that has ended without a verdict, else None.

    Args:
        run: the newest check of an arm.
        judged: number of the arm's run that was judged last; 0 where none was.
    """
    if run is None or run.id <= judged or run.state == "running":
        return None
    ended = run.state == "abandoned" or run.outcome != "completed" or run.reason == UNJUDGED
    return run if ended else None


def of_numbers(catalogue: Catalogue, numbers: Sequence[int]) -> dict[int, Run]:
    """The runs of several numbers, as many of them as there are."""
    with catalogue.reading() as connection:
        found = connection.execute(_select().where(runs.c.id.in_(numbers)))
        return {row.id: _run_of(row) for row in found}


def found_in(connection: Connection, numbers: Select[Any]) -> tuple[Run, ...]:
    """The runs of the numbers that a query gives, inside a transaction."""
    return tuple(_run_of(row) for row in connection.execute(_select().where(runs.c.id.in_(numbers))))


def settle_abandoned(catalogue: Catalogue) -> tuple[Run, ...]:
    """Mark the runs of this host whose process is gone without having said how they ended; returns them.

    Checks that were recorded and never judged are marked too, and are not among those that are returned.
    """
    with catalogue.reading() as connection:
        owed = [_run_of(row) for row in connection.execute(_select().where(OWED))]
    gone = [run for run in owed if is_gone(run.process)]
    if not gone:
        return ()
    ended = "the process that made this run ended without saying how"
    left = [run.id for run in gone if run.state == "running"]
    unjudged = [run.id for run in gone if run.state != "running"]
    with catalogue.writing() as connection:
        for numbers, state, values in (
            (left, "running", {"state": "abandoned", "reason": ended}),
            (unjudged, "finished", {"reason": UNJUDGED}),
        ):
            still = runs.c.id.in_(numbers) & (runs.c.state == state) & OWED
            connection.execute(update(runs).where(still).values(process="", **values))
        return tuple(get_in(connection, run_id) for run_id in left)


def judged_in(connection: Connection, run_id: int) -> None:
    """A check has its verdict: its process owes nothing any more."""
    connection.execute(update(runs).where(runs.c.id == run_id).values(process=""))


def _select() -> Select[Any]:
    return select(runs, arms_table.c.label).join(arms_table, arms_table.c.id == runs.c.arm_id)


def _run_of(row: Row[Any]) -> Run:
    fields = dict(row._mapping)
    facts = fields.pop("facts")
    seal = str(facts.get(SEAL, ""))
    others = {key: value for key, value in facts.items() if key != SEAL}
    return Run(arm=fields.pop("label"), facts=others, seal=seal, **fields)
