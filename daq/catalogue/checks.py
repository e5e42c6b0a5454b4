"""Checks in the catalogue: verdicts of an arm against its baseline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, Row, Select, case, func, insert, select, true, update

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import checks
from daq.catalogue.values import Baseline, CheckRecord
from daq.recording.who import now

TOLD = "told"
"""Key of the details of a check: when everybody had been told of it."""
INCREASED = "grown"
"""Key of the details of a check: joints whose residual torque had grown."""


def add(
    catalogue: Catalogue,
    run_id: int,
    verdict: str,
    sentence: str,
    details: Mapping[str, Any],
    *,
    model_id: int | None = None,
    baseline_id: int | None = None,
) -> CheckRecord:
    """Keep the verdict of a check.

    Args:
        run_id: of the run that it judged.
        verdict: in a word.
        sentence: what an operator reads.
        details: what the verdict rests on; values that JSON has.
        model_id, baseline_id: what was compared with what.

    Raises:
        CatalogueError: there is no such run.
    """
    with catalogue.writing() as connection:
        run = runs.get_in(connection, run_id)
        values = {
            "arm_id": run.arm_id,
            "run_id": run_id,
            "model_id": model_id,
            "baseline_id": baseline_id,
            "created": runs.time_of(catalogue, run),
            "verdict": verdict,
            "sentence": sentence,
            "details": dict(details),
        }
        number = connection.execute(insert(checks).values(values)).inserted_primary_key
        runs.judged_in(connection, run_id)
        row = connection.execute(select(checks).where(checks.c.id == number[0])).one()  # type: ignore[index]
        return _check_of(row)


def mark_told(catalogue: Catalogue, check_id: int) -> None:
    """Everybody who is to be told of a verdict has been reached."""
    with catalogue.writing() as connection:
        wanted = select(checks).where(checks.c.id == check_id).with_for_update()
        row = connection.execute(wanted).one_or_none()
        if row is not None:
            details = {**row.details, TOLD: now().isoformat()}
            connection.execute(update(checks).where(checks.c.id == check_id).values(details=details))


def last_told(catalogue: Catalogue, arm_id: int) -> str:
    """The latest verdict on an arm that somebody was told; empty where nobody ever was."""
    return next((record.verdict for record in of_arm(catalogue, arm_id) if TOLD in record.details), "")


def verdicts_of(catalogue: Catalogue, run_ids: Sequence[int]) -> dict[int, str]:
    """The last verdict on each of several runs; those without one are left out."""
    wanted = select(checks.c.run_id, checks.c.verdict).where(checks.c.run_id.in_(run_ids))
    with catalogue.reading() as connection:
        return {row.run_id: row.verdict for row in connection.execute(wanted.order_by(checks.c.id))}


def clean_models(catalogue: Catalogue, baseline: Baseline) -> frozenset[int]:
    """Models of the nights since a baseline on which nothing was found, and the baseline's own."""
    state, grown = checks.c.details["state"].as_string(), checks.c.details[INCREASED].as_string()
    unchanged = (state == "unchanged") & func.coalesce(grown, "[]").in_(("[]", "null"))
    # Details are long: they stay in the database, and it reads only those of the nights that were not fine.
    clean = case((checks.c.verdict == "ok", true()), else_=unchanged)
    wanted = select(checks.c.model_id).where(checks.c.arm_id == baseline.arm_id, clean)
    wanted = wanted.where(checks.c.baseline_id == baseline.id)
    with catalogue.reading() as connection:
        found = connection.execute(wanted).scalars().all()
    return frozenset(number for number in (*found, baseline.model_id) if number is not None)


def of_run(catalogue: Catalogue, run_id: int) -> tuple[CheckRecord, ...]:
    """The verdicts on a run, oldest first."""
    with catalogue.reading() as connection:
        rows = connection.execute(select(checks).where(checks.c.run_id == run_id).order_by(checks.c.id))
        return tuple(_check_of(row) for row in rows)


def of_arm(
    catalogue: Catalogue, arm_id: int, *, limit: int | None = None, keys: Sequence[str] | None = None
) -> tuple[CheckRecord, ...]:
    """The verdicts on an arm, newest first.

    Args:
        catalogue: where.
        arm_id: of the arm.
        limit: at most so many.
        keys: the database picks these out of the details; all of them where None.
    """
    columns = (checks,) if keys is None else WITHOUT_DETAILS
    wanted = select(*columns).where(checks.c.arm_id == arm_id).order_by(checks.c.id.desc()).limit(limit)
    with catalogue.reading() as connection:
        return found_in(connection, wanted, *((key,) for key in keys or ()))


def of_numbers(catalogue: Catalogue, numbers: Sequence[int]) -> tuple[CheckRecord, ...]:
    """Several verdicts, as many of them as there are."""
    if not numbers:
        return ()
    with catalogue.reading() as connection:
        return found_in(connection, select(checks).where(checks.c.id.in_(numbers)))


def listed(catalogue: Catalogue, arm_id: int, *, limit: int) -> tuple[CheckRecord, ...]:
    """As :func:`of_arm`, without their details."""
    wanted = select(*WITHOUT_DETAILS).where(checks.c.arm_id == arm_id).order_by(checks.c.id.desc())
    with catalogue.reading() as connection:
        return found_in(connection, wanted.limit(limit))


def found_in(connection: Connection, wanted: Select[Any], *paths: tuple[str, ...]) -> tuple[CheckRecord, ...]:
    """Verdicts of a query on their table, inside a transaction.

    Args:
        connection: to read with.
        wanted: selects the table, or ``WITHOUT_DETAILS`` of it.
        paths: in the details, that the database picks out of them; each is then where it was.
    """
    picked = [checks.c.details[path].label(f"part{k}") for k, path in enumerate(paths)]
    return tuple(_check_of(row, paths) for row in connection.execute(wanted.add_columns(*picked)))


WITHOUT_DETAILS = tuple(column for column in checks.c if column is not checks.c.details)
"""Columns of a list of verdicts: the details of one night are tens of kilobytes."""


def _check_of(row: Row[Any], paths: tuple[tuple[str, ...], ...] = ()) -> CheckRecord:
    fields = dict(row._mapping)
    kept = fields.get("details")
    details: dict[str, Any] = kept if isinstance(kept, dict) else {}
    fields["details"] = details
    for k, path in enumerate(paths):
        part, inner = fields.pop(f"part{k}"), details
        for key in path[:-1]:
            inner = inner.setdefault(key, {})
        inner[path[-1]] = part
    return CheckRecord(**fields)
