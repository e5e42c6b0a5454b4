"""Every arm with what is newest of it, in as many queries for two hundred arms as for one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Table, func, select

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
        check: the last verdict, with as much of its details as was asked for; None where there is none.
        baseline: that counts; None where none does.
        run: the newest of any kind.
        unfinished: the newest check, where it has ended without a verdict, so that the verdict is older.
    """

    arm: Arm
    check: CheckRecord | None
    baseline: Baseline | None
    run: Run | None
    unfinished: Run | None


def every(
    catalogue: Catalogue,
    label: str | None = None,
    details: tuple[tuple[str, ...], ...] | None = (),
) -> tuple[ArmNow, ...]:
    """All arms by label, or the one of a label.

    Args:
        catalogue: where.
        label: of one arm.
        details: paths of what is wanted of the details of the checks; None for all of them.
    """
    with catalogue.reading() as connection:
        wanted = select(arms_table).order_by(arms_table.c.label)
        if label is not None:
            wanted = wanted.where(arms_table.c.label == label)
        listed = [arms.arm_of(row) for row in connection.execute(wanted)]

        def newest(table: Table, *where: Any) -> Any:
            """The largest number of each arm, asked arm by arm, so that an index answers at its first row."""
            of_arm = select(func.max(table.c.id)).where(table.c.arm_id == arms_table.c.id, *where)
            numbers = select(of_arm.correlate(arms_table).scalar_subquery()).select_from(arms_table)
            return numbers if label is None else numbers.where(arms_table.c.label == label)

        columns = checks_table.c if details is None else checks.WITHOUT_DETAILS
        judged_last = select(*columns).where(checks_table.c.id.in_(newest(checks_table)))
        last = {
            record.arm_id: record for record in checks.found_in(connection, judged_last, *(details or ()))
        }
        b = baselines_table.c  # a table of few rows, which is read faster than it is searched
        still = select(func.max(b.id)).where(b.state != "rolled_back").group_by(b.arm_id)
        if label is not None:
            still = still.where(b.arm_id.in_([arm.id for arm in listed]))
        counting = baselines.found_in(
            connection, select(baselines_table).where(baselines_table.c.id.in_(still))
        )
        run_of = _by_arm(runs.found_in(connection, newest(runs_table)))
        check_of = _by_arm(runs.found_in(connection, newest(runs_table, runs_table.c.kind == "check")))
    by_arm = {baseline.arm_id: baseline for baseline in counting}
    return tuple(
        ArmNow(
            arm,
            last.get(arm.id),
            by_arm.get(arm.id),
            run_of.get(arm.id),
            runs.unjudged(check_of.get(arm.id), last[arm.id].run_id if arm.id in last else 0),
        )
        for arm in listed
    )


def _by_arm(found: Iterable[Run]) -> dict[int, Run]:
    return {run.arm_id: run for run in found}
