"""Every arm with what is newest of it, in as many queries for two hundred arms as for one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Column, Connection, Select, Table, func, select

from daq.catalogue import arms, baselines, checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import arms as arms_table
from daq.catalogue.schema import baselines as baselines_table
from daq.catalogue.schema import checks as checks_table
from daq.catalogue.schema import runs as runs_table
from daq.catalogue.values import Arm, Baseline, CheckRecord, Run


@dataclass(frozen=True)
class ArmNow:
    """One arm.

    Attributes:
        arm: which.
        check: the last verdict; None where there is none.
        baseline: that counts; None where none does.
        run: the newest of any kind.
        unfinished: the newest check, where it has ended without a verdict, so that the verdict is older.
    """

    arm: Arm
    check: CheckRecord | None
    baseline: Baseline | None
    run: Run | None
    unfinished: Run | None


def every(catalogue: Catalogue, label: str | None = None) -> tuple[ArmNow, ...]:
    """All arms by label, or the one of a label."""
    with catalogue.reading() as connection:
        wanted = select(arms_table).order_by(arms_table.c.label)
        if label is not None:
            wanted = wanted.where(arms_table.c.label == label)
        listed = [arms.arm_of(row) for row in connection.execute(wanted)]
        last = {
            record.arm_id: record
            for record in checks.found_in(connection, _newest(checks_table, checks_table.c.id))
        }
        still = baselines_table.c.state != "rolled_back"
        counting = baselines.found_in(connection, _newest(baselines_table, baselines_table.c.id, still))
        newest = _runs(connection)
        judged = _runs(connection, runs_table.c.kind == "check")
    by_arm = {baseline.arm_id: baseline for baseline in counting}
    return tuple(
        ArmNow(
            arm,
            last.get(arm.id),
            by_arm.get(arm.id),
            newest.get(arm.id),
            runs.unjudged(judged.get(arm.id), last[arm.id].run_id if arm.id in last else 0),
        )
        for arm in listed
    )


def _newest(table: Table, number: Column[Any], *where: Any) -> Select[Any]:
    """Rows of a table with the largest number of each arm."""
    return select(table).where(number.in_(select(func.max(number)).where(*where).group_by(table.c.arm_id)))


def _runs(connection: Connection, *where: Any) -> dict[int, Run]:
    return {run.arm_id: run for run in runs.newest_in(connection, *where)}
