"""Many processes at once, migrations, killed writers, and what goes wrong in one line."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
import sqlalchemy
from sqlalchemy import Connection, text

from daq.catalogue import arms, baselines, checks, findings, models, runs, schema
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description, difference
from daq.catalogue.location import catalogue_url
from daq.catalogue.migrations import bring_up_to_date, found_version
from daq.catalogue.values import CatalogueError, NewFinding
from ident.effects.entry import EffectEntry
from tests.daq.catalogue.entries import OTHER_SHA, SHA, identity, model

ROOT = Path(__file__).parents[3]
WRITERS, RUNS = 5, 6


def start(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
def test_many_processes_write_at_once(url: str) -> None:
    """They even make the catalogue together; nothing is lost, nothing is there twice, one gets the lease."""
    module = "tests.daq.catalogue.writer_process"
    writers = [start("-m", module, url, number, RUNS) for number in range(WRITERS)]
    answers = [writer.communicate(timeout=120) for writer in writers]
    assert [writer.returncode for writer in writers] == [0] * WRITERS, answers
    with Catalogue(url) as catalogue:
        (arm,) = arms.every(catalogue)
        made = runs.every(catalogue)
        expected = {(number, k) for number in range(WRITERS) for k in range(RUNS)}
        assert len(made) == len(expected)
        assert {(run.facts["writer"], run.facts["k"]) for run in made} == expected
        assert {run.state for run in made} == {"finished"}
        for run in made:
            (kept,) = models.of_run(catalogue, run.id)
            written = model(run.facts["writer"] * 100 + run.facts["k"])
            assert kept.parameters == written.parameters
        assert len(baselines.of_arm(catalogue, arm.id)) == len(expected)
        notes = runs.get(catalogue, 1).note.split("\n")
        assert sorted(notes) == sorted(f"{number}.{k}" for number, k in expected)
    assert sum(int(out) for out, _ in answers) == 1


def test_what_was_told_to_be_kept_outlives_a_power_cut(
    sqlite_set_up: Callable[[sqlite3.Connection, object], None], tmp_path: Path
) -> None:
    """WAL syncs at each commit only where ``synchronous`` is FULL (2)."""
    with closing(sqlite3.connect(tmp_path / "catalogue.db")) as connection:
        sqlite_set_up(connection, None)
        found = [
            connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("synchronous", "journal_mode")
        ]
    assert found == [2, "wal"]


def test_a_killed_process_leaves_whole_entries_and_a_run_that_is_told_abandoned(url: str) -> None:
    program = (
        "import sys\n"
        "from daq.catalogue import runs\n"
        "from daq.catalogue.database import Catalogue\n"
        "from tests.daq.catalogue.entries import identity\n"
        "catalogue = Catalogue(sys.argv[1])\n"
        "run = runs.begin(catalogue, identity(), 'run')\n"
        "transaction = catalogue.writing()\n"
        "connection = transaction.__enter__()\n"
        "connection.exec_driver_sql(\"UPDATE runs SET note = 'half'\")\n"
        "print('ready', flush=True)\n"
        "sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, url],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGKILL)
        process.wait(30)
    with Catalogue(url) as catalogue:
        mine = runs.begin(catalogue, identity(), "run")
        (gone,) = runs.settle_abandoned(catalogue)
        assert (gone.state, gone.outcome, gone.note) == ("abandoned", "", "")
        assert gone.reason and gone.id != mine.id
        assert runs.get(catalogue, mine.id).state == "running"
        assert runs.settle_abandoned(catalogue) == ()


def test_old_catalogues_are_carried_forward_step_by_step(url: str) -> None:
    with Catalogue(url) as catalogue:
        run = runs.begin(catalogue, identity(), "run", note="kept")
    steps: list[int] = []
    first, last = schema.VERSION + 1, schema.VERSION + 2

    def add_column(connection: Connection) -> None:
        steps.append(first)
        connection.execute(text("ALTER TABLE runs ADD COLUMN temperature FLOAT"))

    def fill_column(connection: Connection) -> None:
        steps.append(last)
        connection.execute(text("UPDATE runs SET temperature = 25.5"))

    migrations = {first: add_column, last: fill_column}
    with Catalogue(url) as catalogue:
        with catalogue.writing() as connection:
            bring_up_to_date(connection, last, migrations)
            bring_up_to_date(connection, last, migrations)
        assert steps == [first, last]
        with catalogue.reading() as connection:
            assert found_version(connection) == last
            assert connection.execute(text("SELECT temperature, note FROM runs")).one() == (25.5, "kept")
    with pytest.raises(
        CatalogueError, match=rf"has version {last} of a newer armhil; allowed: up to \d+; install"
    ):
        Catalogue(url)
    assert run.note == "kept"


def test_a_step_that_fails_changes_nothing(url: str) -> None:
    def fails(connection: Connection) -> None:
        connection.execute(text("ALTER TABLE runs ADD COLUMN temperature FLOAT"))
        raise ValueError("half way")

    with Catalogue(url) as catalogue:
        with pytest.raises(ValueError, match="half way"), catalogue.writing() as connection:
            bring_up_to_date(connection, schema.VERSION + 1, {schema.VERSION + 1: fails})
        with catalogue.reading() as connection:
            assert found_version(connection) == schema.VERSION
            columns = {column["name"] for column in sqlalchemy.inspect(connection).get_columns("runs")}
        assert columns == {column.name for column in schema.runs.columns}


def test_a_catalogue_of_version_1_takes_whole_sentences(url: str) -> None:
    """PostgreSQL had 40 letters for what a covariance assumes, and identifications say more."""
    with Catalogue(url) as catalogue, catalogue.writing() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("ALTER TABLE models ALTER COLUMN covariance_kind TYPE VARCHAR(40)"))
        connection.execute(text("ALTER TABLE models DROP COLUMN found"))
        connection.execute(text("UPDATE schema_version SET version = 1"))
    said = "Ω per joint, errors independent in time (eq. 7)"
    assert len(said) > 40
    with Catalogue(url) as catalogue:
        with catalogue.reading() as connection:
            assert found_version(connection) == schema.VERSION
        run = runs.begin(catalogue, identity(), "run")
        kept = models.add(catalogue, run.id, replace(model(), covariance_kind=said))
        assert models.get(catalogue, kept.id).covariance_kind == said


def test_a_diagnosis_of_version_2_has_its_effects_from_its_findings(url: str) -> None:
    """Models had only names, those found twice; the findings beside them said where, and with what shape."""
    usual = ("rigid_body", "viscous_friction")
    shape = {"name": "length", "value": 0.002, "sigma": 1e-4, "unit": "rad", "shape": True}
    linear = {"name": "hysteresis2", "value": 3.0, "sigma": 0.1, "unit": "N·m", "shape": False}
    found = (_finding("hysteresis", (2,), (linear, shape)), _finding("payload", (), (linear,)))
    names = tuple(finding.effect for finding in found)
    with Catalogue(url) as catalogue:
        run = runs.begin(catalogue, identity(), "run")
        plain = models.add(catalogue, run.id, replace(model(), effects=usual))
        diagnosed = models.add(catalogue, run.id, replace(model(), effects=(*usual, *names, *names)))
        findings.add(catalogue, run.id, found, diagnosed.id)
        findings.add(catalogue, run.id, found[:1])  # of a diagnosis that kept no model
        with catalogue.writing() as connection:
            connection.execute(text("ALTER TABLE models DROP COLUMN found"))
            connection.execute(text("UPDATE schema_version SET version = 2"))
    with Catalogue(url) as catalogue:
        kept = models.get(catalogue, diagnosed.id)
        assert kept.effects == (*usual, *names)
        assert kept.found == (
            EffectEntry("hysteresis", (2,), {"length": 0.002}),
            EffectEntry("payload", (), {}),
        )
        assert kept.parameters == diagnosed.parameters
        other = models.get(catalogue, plain.id)
        assert (other.effects, other.found) == (usual, ())
        again = models.add(catalogue, run.id, replace(model(), effects=kept.effects, found=kept.found))
        assert again.found == kept.found


def test_a_description_of_version_3_was_its_robot_toml_alone(url: str) -> None:
    """What was kept then says so: it does not count for an arm whose URDF nobody compared."""
    with Catalogue(url) as catalogue:
        runs.begin(catalogue, identity(sha256=SHA), "run")
        with catalogue.writing() as connection:
            connection.execute(text("DROP TABLE descriptions"))
            connection.execute(text("UPDATE schema_version SET version = 3"))
    parts = {"robot.toml": "1", "inertias": "2"}
    with Catalogue(url) as catalogue:
        now = Description(OTHER_SHA, parts)
        assert difference(catalogue, SHA, now) == (
            "an earlier armhil knew it by the text of robot.toml alone, so the URDF was not compared"
        )
        runs.begin(catalogue, replace(identity(sha256=OTHER_SHA), parts=parts), "run")
        later = Description("c" * 64, {"robot.toml": "1", "inertias": "3"})
        assert difference(catalogue, OTHER_SHA, later) == "the URDF's masses or inertias changed since"
        assert difference(catalogue, OTHER_SHA, now) == ""
        assert difference(catalogue, "d" * 64, now) == "its parts were not kept"


def test_runs_of_version_5_are_owed_only_where_a_verdict_is_missing(url: str) -> None:
    """Every run named its process for ever; settling asked all of them whether it is still there."""
    with Catalogue(url) as catalogue:
        ids = {}
        for name, kind in (("running", "run"), ("over", "run"), ("judged", "check"), ("unjudged", "check")):
            ids[name] = runs.begin(catalogue, identity(), kind).id
            if name != "running":
                runs.finish(catalogue, ids[name], "completed")
        checks.add(catalogue, ids["judged"], "ok", "fine", {})

        def owed() -> set[str]:
            return {name for name, number in ids.items() if runs.get(catalogue, number).process}

        assert owed() == {"running", "unjudged"}
        with catalogue.writing() as connection:
            connection.execute(text("UPDATE runs SET process = 'elsewhere:1:0'"))
            for index in ("newest_run_of_arm", "newest_check_of_arm", "owed_runs"):
                connection.execute(text(f"DROP INDEX {index}"))
            connection.execute(text("UPDATE schema_version SET version = 5"))
        assert len(owed()) == 4
    with Catalogue(url) as catalogue:
        assert owed() == {"running", "unjudged"}
        with catalogue.reading() as connection:
            known = sqlalchemy.inspect(connection).get_multi_indexes()
            kept = {index["name"] for indexes in known.values() for index in indexes}
        assert {"newest_run_of_arm", "newest_check_of_arm", "owed_runs"} <= kept


def _finding(effect: str, joints: tuple[int, ...], parameters: tuple[dict[str, object], ...]) -> NewFinding:
    return NewFinding(
        effect=effect,
        joints=joints,
        sentence=effect,
        parameters=parameters,
        p_value=0.0,
        gap_before=1.0,
        gap_after=0.1,
        held_out_gain=0.9,
    )


def test_the_tables_are_pinned_to_their_version() -> None:
    """Whoever changes a table has to raise VERSION, write the step, and change this list."""
    assert schema.VERSION == 6
    found = {table.name: len(table.columns) for table in schema.metadata.sorted_tables}
    assert found == {
        "arms": 7,
        "descriptions": 2,
        "schema_version": 2,
        "leases": 4,
        "runs": 17,
        "models": 22,
        "baselines": 7,
        "parameters": 7,
        "baseline_events": 7,
        "checks": 9,
        "findings": 13,
    }


def test_where_the_catalogue_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("ARMHIL_CATALOGUE", raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert catalogue_url().database == str(tmp_path / "data" / "armhil" / "catalogue.db")
    monkeypatch.setenv("XDG_DATA_HOME", "relative/is/ignored")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert catalogue_url().database == str(tmp_path / ".local" / "share" / "armhil" / "catalogue.db")
    monkeypatch.setenv("ARMHIL_CATALOGUE", "postgres://ann:secret@cell1/armhil")
    url = catalogue_url()
    assert (url.drivername, url.host, url.database) == ("postgresql+psycopg", "cell1", "armhil")
    monkeypatch.setenv("ARMHIL_CATALOGUE", "~/cell.db")
    assert catalogue_url().database == str(tmp_path / "cell.db")
    assert catalogue_url("sqlite:////data/x.db").database == "/data/x.db"


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("mysql://host/db", "databases of kind mysql are not supported; allowed: a path, sqlite"),
        ("sqlite:///:memory:", "names no file"),
        ("postgresql://ann:secret@host:port/db", "^catalogue postgresql://host:port/db: is no URL; allowed"),
    ],
)
def test_a_url_that_cannot_be_is_refused_in_one_line(given: str, told: str) -> None:
    with pytest.raises(CatalogueError, match=told) as refused:
        catalogue_url(given)
    assert "secret" not in str(refused.value) and "\n" not in str(refused.value)


def test_what_is_no_catalogue_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "notes.db").write_text("no database at all, but long enough to be looked at as one\n" * 4)
    with pytest.raises(
        CatalogueError, match=f"^catalogue {tmp_path}/notes.db: file is not a database; name "
    ):
        Catalogue(str(tmp_path / "notes.db"))
    (tmp_path / "file").write_text("")
    with pytest.raises(CatalogueError, match=r"cannot be made: (Not a directory|File exists); name "):
        Catalogue(str(tmp_path / "file" / "x.db"))


def test_a_server_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    pytest.importorskip("psycopg", reason="psycopg is not installed (extra postgresql)")
    with pytest.raises(CatalogueError) as told:
        Catalogue(f"postgresql://ann:secret@/db?host={tmp_path}")
    assert str(told.value).startswith("catalogue postgresql+psycopg://ann:***@/db")
    assert "\n" not in str(told.value)
