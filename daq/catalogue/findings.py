"""Findings in the catalogue: the missing effects that diagnoses named."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from sqlalchemy import Row, insert, select

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import findings
from daq.catalogue.values import CatalogueFinding, NewFinding


def add(
    catalogue: Catalogue, run_id: int, new: tuple[NewFinding, ...], model_id: int | None = None
) -> tuple[CatalogueFinding, ...]:
    """Keep what a diagnosis of a run's recording found, all or nothing.

    Args:
        run_id: of the run.
        new: in the order in which they were made.
        model_id: of the model that has them.

    Raises:
        CatalogueError: there is no such run.
    """
    with catalogue.writing() as connection:
        run = runs.get_in(connection, run_id)
        kept = []
        for finding in new:
            values = asdict(finding) | {
                "arm_id": run.arm_id,
                "run_id": run_id,
                "model_id": model_id,
                "created": runs.time_of(catalogue, run),
                "joints": list(finding.joints),
                "parameters": [dict(parameter) for parameter in finding.parameters],
            }
            number = connection.execute(insert(findings).values(values)).inserted_primary_key
            kept.append(int(number[0]))  # type: ignore[index]
        rows = connection.execute(select(findings).where(findings.c.id.in_(kept)).order_by(findings.c.id))
        return tuple(_finding_of(row) for row in rows)


def of_run(catalogue: Catalogue, run_id: int) -> tuple[CatalogueFinding, ...]:
    """What was found in the recording of a run, in that order."""
    with catalogue.reading() as connection:
        rows = connection.execute(select(findings).where(findings.c.run_id == run_id).order_by(findings.c.id))
        return tuple(_finding_of(row) for row in rows)


def of_arm(catalogue: Catalogue, arm_id: int, *, limit: int | None = None) -> tuple[CatalogueFinding, ...]:
    """What was found in the recordings of an arm, newest first."""
    wanted = select(findings).where(findings.c.arm_id == arm_id).order_by(findings.c.id.desc()).limit(limit)
    with catalogue.reading() as connection:
        return tuple(_finding_of(row) for row in connection.execute(wanted))


def _finding_of(row: Row[Any]) -> CatalogueFinding:
    fields = dict(row._mapping)
    fields["joints"] = tuple(fields["joints"])
    fields["parameters"] = tuple(fields["parameters"])
    return CatalogueFinding(**fields)
