"""What an arm may do rests on runs that are as they were kept, and of this arm."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.session.admission import as_commissioned
from daq.session.session_error import SessionError
from tests.daq.accepted_meanings import ARMS, SPEEDS, fill_catalogue, read_catalogue, said_by_catalogue

FULL_RUN = "stage = 'full run' AND arm_id ="


@pytest.fixture
def path(tmp_path: Path) -> Path:
    fill_catalogue(tmp_path / "catalogue.db")
    return tmp_path / "catalogue.db"


def changed(path: Path, *statements: str) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        for statement in statements:
            connection.execute(statement)


def speed(path: Path, number: int) -> float:
    with Catalogue(f"sqlite:///{path}") as catalogue:
        return as_commissioned(catalogue, ARMS[number - 1], None, "armhil commission").speed


def test_passes_count_as_they_were_kept(path: Path) -> None:
    found = read_catalogue(path)
    said_by_catalogue(path, found)
    assert found.speeds == (SPEEDS[1], SPEEDS[2], 0.0, 0.0)
    assert [len(stages) for stages in found.stages] == [7, 7, 6, 0]


@pytest.mark.parametrize(
    ("number", "statement"),
    [
        (1, f"UPDATE runs SET facts = replace(facts, '\"0.3\"', '\"0.9\"') WHERE {FULL_RUN} 1"),
        (1, f"UPDATE runs SET facts = json_remove(facts, '$.speed_share') WHERE {FULL_RUN} 1"),
        (1, f"UPDATE runs SET facts = json_remove(facts, '$.seal') WHERE {FULL_RUN} 1"),
        (4, f"UPDATE runs SET arm_id = 4 WHERE {FULL_RUN} 2"),
        (4, "UPDATE runs SET arm_id = 4 WHERE kind = 'commission' AND arm_id = 2"),
        (3, "UPDATE runs SET stage = 'full run' WHERE stage = 'slow run' AND arm_id = 3"),
        (2, f"UPDATE runs SET facts = json_set(facts, '$.cell_sha256', 'ab') WHERE {FULL_RUN} 2"),
    ],
)
def test_a_pass_that_was_changed_or_is_another_arm_s_lets_nothing_move(
    path: Path, number: int, statement: str
) -> None:
    changed(path, statement)
    with pytest.raises(SessionError, match=r"run \d+ of its full run is not as it was kept") as caught:
        speed(path, number)
    assert "\n" not in str(caught.value)
    said_by_catalogue(path, read_catalogue(path))


def test_a_run_that_did_not_come_to_its_end_is_no_pass_by_another_word(path: Path) -> None:
    with Catalogue(f"sqlite:///{path}") as catalogue:
        begun = runs.begin(catalogue, ARMS[3], "commission", stage="full run", facts={"speed_share": "0.5"})
        runs.finish(catalogue, begun.id, "aborted")
    changed(path, f"UPDATE runs SET outcome = 'completed' WHERE id = {begun.id}")
    with pytest.raises(SessionError, match="not as it was kept"):
        speed(path, 4)


@pytest.mark.parametrize("sealed", [True, False])
def test_what_an_older_armhil_kept_is_sealed_once(path: Path, sealed: bool) -> None:
    version = 4 if sealed else 5
    changed(
        path,
        "UPDATE runs SET facts = json_remove(facts, '$.seal')",
        f"UPDATE schema_version SET version = {version}",
    )
    if not sealed:
        with pytest.raises(SessionError, match="not as it was kept"):
            speed(path, 1)
        return
    assert (speed(path, 1), speed(path, 2)) == (SPEEDS[1], SPEEDS[2])
    with closing(sqlite3.connect(path)) as connection:
        facts = [json.loads(row[0]) for row in connection.execute("SELECT facts FROM runs")]
    assert sum("seal" in one for one in facts) == 7 + 7 + 6, "runs of other kinds have none"
