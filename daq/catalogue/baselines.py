"""Baselines: which model counts as what an arm is, who said so and why; nothing said is ever erased."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Row, Select, insert, select, update

from daq.catalogue import models
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import arms, baseline_events, baselines, runs
from daq.catalogue.schema import models as models_table
from daq.catalogue.values import Baseline, BaselineEvent, BaselineState, CatalogueError
from daq.recording.who import now


def accept(
    catalogue: Catalogue, model_id: int, author: str, reason: str, report: str | None = None
) -> Baseline:
    """A model becomes the baseline of its arm.

    Args:
        model_id: of the model.
        author, reason: who says so, and why.
        report: path of the page that this rests on.

    Raises:
        CatalogueError: there is no such model.
    """
    with catalogue.writing() as connection:
        model = models.get_in(connection, model_id)
        lock_arm(connection, model.arm_id)
        values = {
            "arm_id": model.arm_id,
            "model_id": model_id,
            "run_id": model.run_id,
            "state": "accepted",
            "description_sha256": model.description_sha256,
            "accepted": now(),
        }
        number = connection.execute(insert(baselines).values(values)).inserted_primary_key
        baseline_id = int(number[0])  # type: ignore[index]
        _note(connection, baseline_id, "accepted", author, reason, report)
        return get_in(connection, baseline_id)


def suspect(
    catalogue: Catalogue, arm_id: int, author: str, reason: str, report: str | None = None
) -> Baseline:
    """The baseline of an arm stays in use and is doubted.

    Raises:
        CatalogueError: the arm has no baseline.
    """
    return _set_state(catalogue, arm_id, "suspect", author, reason, report)


def trust(catalogue: Catalogue, arm_id: int, author: str, reason: str, report: str | None = None) -> Baseline:
    """The baseline of an arm is doubted no longer.

    Raises:
        CatalogueError: the arm has no baseline.
    """
    return _set_state(catalogue, arm_id, "accepted", author, reason, report)


def roll_back(
    catalogue: Catalogue, arm_id: int, author: str, reason: str, report: str | None = None
) -> Baseline | None:
    """The baseline of an arm is taken back; returns the one before it, which counts again, or None.

    Raises:
        CatalogueError: the arm has no baseline.
    """
    _set_state(catalogue, arm_id, "rolled_back", author, reason, report)
    return current(catalogue, arm_id)


def current(catalogue: Catalogue, arm_id: int) -> Baseline | None:
    """The baseline of an arm: the one accepted last that was not taken back, doubted or not."""
    with catalogue.reading() as connection:
        return _current(connection, arm_id)


def of_arm(catalogue: Catalogue, arm_id: int) -> tuple[Baseline, ...]:
    """All baselines that an arm had, newest first."""
    with catalogue.reading() as connection:
        return found_in(connection, select(baselines).where(baselines.c.arm_id == arm_id))


def get(catalogue: Catalogue, baseline_id: int) -> Baseline:
    """The baseline of a number.

    Raises:
        CatalogueError: there is none.
    """
    with catalogue.reading() as connection:
        return get_in(connection, baseline_id)


def get_in(connection: Connection, baseline_id: int) -> Baseline:
    """The baseline of a number, inside a transaction.

    Raises:
        CatalogueError: there is none.
    """
    found = found_in(connection, select(baselines).where(baselines.c.id == baseline_id))
    if not found:
        raise CatalogueError(f"baseline {baseline_id}: is not in the catalogue")
    return found[0]


def guarded_captures(catalogue: Catalogue) -> frozenset[str]:
    """Checksums of the recordings that some baseline rests on, taken back or not: never to be deleted."""
    with catalogue.reading() as connection:
        return guarded_captures_in(connection)


def guarded_captures_in(connection: Connection) -> frozenset[str]:
    """As :func:`guarded_captures`, inside a transaction."""
    listed = select(models_table.c.sources).join(baselines, baselines.c.model_id == models_table.c.id)
    recorded = select(runs.c.capture_sha256).join(baselines, baselines.c.run_id == runs.c.id)
    of_models = {s["sha256"] for sources in connection.execute(listed).scalars() for s in sources}
    of_runs = set(connection.execute(recorded).scalars())
    return frozenset(sha256 for sha256 in of_models | of_runs if sha256)


def _set_state(
    catalogue: Catalogue, arm_id: int, state: BaselineState, author: str, reason: str, report: str | None
) -> Baseline:
    with catalogue.writing() as connection:
        lock_arm(connection, arm_id)
        found = _current(connection, arm_id)
        if found is None:
            label = connection.execute(select(arms.c.label).where(arms.c.id == arm_id)).scalar_one_or_none()
            raise CatalogueError(
                f"arm {label or arm_id}: has no baseline; `armhil baseline accept RUN --reason WHY` makes one"
            )
        connection.execute(update(baselines).where(baselines.c.id == found.id).values(state=state))
        _note(connection, found.id, state, author, reason, report)
        return get_in(connection, found.id)


def lock_arm(connection: Connection, arm_id: int) -> None:
    """Nobody else changes the baselines of an arm until this transaction ends."""
    connection.execute(select(arms.c.id).where(arms.c.id == arm_id).with_for_update())


def _note(
    connection: Connection,
    baseline_id: int,
    state: BaselineState,
    author: str,
    reason: str,
    report: str | None,
) -> None:
    values = {"baseline_id": baseline_id, "state": state, "author": author, "reason": reason}
    connection.execute(insert(baseline_events).values(**values, report=report, at=now()))


def _current(connection: Connection, arm_id: int) -> Baseline | None:
    wanted = select(baselines).where(baselines.c.arm_id == arm_id, baselines.c.state != "rolled_back")
    found = found_in(connection, wanted.limit(1))
    return found[0] if found else None


def found_in(connection: Connection, wanted: Select[Any]) -> tuple[Baseline, ...]:
    """Baselines of a query on their table, newest first, each with its events, oldest first."""
    rows = connection.execute(wanted.order_by(baselines.c.id.desc())).all()
    events: dict[int, list[BaselineEvent]] = {row.id: [] for row in rows}
    e = baseline_events.c
    listed = select(e.baseline_id, e.state, e.author, e.reason, e.report, e.at)
    for baseline_id, *values in connection.execute(listed.where(e.baseline_id.in_(events)).order_by(e.id)):
        events[baseline_id].append(BaselineEvent(*values))
    return tuple(_baseline_of(row, tuple(events[row.id])) for row in rows)


def _baseline_of(row: Row[Any], events: tuple[BaselineEvent, ...]) -> Baseline:
    return Baseline(**row._mapping, events=events)
