"""A catalogue that cannot be used is one line for each command, says what to do, and stays as it was."""

from __future__ import annotations

import os
import sqlite3
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.catalogue import database, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import VERSION
from daq.catalogue.values import CatalogueError
from tests.daq.calls import Call
from tests.daq.catalogue.entries import identity

COMMANDS = (
    ("runs",),
    ("show", "1"),
    ("note", "1", "word"),
    ("compare", "1", "1"),
    ("rerun", "1"),
    ("prune", "--dry-run"),
    ("baseline", "accept", "1", "--reason", "x"),
    ("baseline", "show", "arm"),
    ("protocol", "arm"),
)
NOBODY = 65534


@pytest.fixture
def kept(own_catalogue: Path) -> Path:
    """A catalogue with one run in it."""
    with Catalogue() as catalogue:
        run = runs.begin(catalogue, identity(), "run")
        runs.finish(catalogue, run.id, "completed")
    return own_catalogue


def newer(file: Path) -> None:
    with sqlite3.connect(file) as connection:
        connection.execute("UPDATE schema_version SET version = 99")
    connection.close()


def cut(file: Path) -> None:
    os.truncate(file, 3000)


def text(file: Path) -> None:
    file.write_text("notes of somebody, long enough to be looked at as a database\n" * 40)


def garbled(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[100:] = bytes(value ^ 0x5A for value in content[100:])
    file.write_bytes(content)


def folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (
            newer,
            f"has version 99 of a newer armhil; allowed: up to {VERSION}; install that newer one,"
            " or name another",
        ),
        (cut, "the file is damaged: put a backup in its place, or move it away"),
        (text, "file is not a database; name another in $ARMHIL_CATALOGUE, or move it away"),
        (garbled, "the file is damaged: put a backup in its place, or move it away"),
        (folder, "unable to open database file; allowed: a file that you may write"),
    ],
)
@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: " ".join(words))
def test_each_command_says_in_one_line_what_is_the_matter(
    kept: Path, armhil: Call, damage: Callable[[Path], None], told: str, words: tuple[str, ...]
) -> None:
    damage(kept)
    before = kept.read_bytes() if kept.is_file() else None
    code, out, err = armhil(*words)
    assert (code, out) == (2, "") and " ".join(err.split()).startswith("armhil: catalogue "), err
    assert told in " ".join(err.split()) and str(kept) in "".join(err.split())
    assert len(err.strip().splitlines()) == 1
    assert (kept.read_bytes() if kept.is_file() else None) == before


def as_nobody(work: Callable[[], None]) -> int:
    """Exit code of a child without the rights of a superuser: 7 where a catalogue refused it, else 1."""
    child = os.fork()
    if child == 0:  # pragma: no cover
        code = 0
        try:
            if os.geteuid() == 0:
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            work()
        except CatalogueError as error:
            os.write(2, f"armhil: {error}\n".encode())
            code = 7
        except BaseException as error:  # noqa: BLE001 (nothing of it may go on in the child)
            os.write(2, repr(error).encode())
            code = 1
        os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_a_catalogue_that_may_only_be_read(kept: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for path in kept.parents:  # up to the machine's own: nobody has to come as far as the catalogue
        if path.stat().st_uid == os.getuid() and path not in (Path(tempfile.gettempdir()), Path.home()):
            path.chmod(path.stat().st_mode | 0o055)
        else:
            break
    kept.parent.chmod(0o555)
    kept.chmod(0o444)
    try:
        capfd.readouterr()

        def write() -> None:
            with Catalogue(str(kept)) as catalogue:
                runs.note(catalogue, 1, "x")

        assert as_nobody(write) == 7
        said = capfd.readouterr().err
        assert said.count("\n") == 1 and ("chmod u+w" in said or "that you may write" in said), said
        kept.chmod(0o000)
        assert as_nobody(write) == 7
        assert "that you may write" in capfd.readouterr().err
    finally:
        kept.parent.chmod(0o755)
        kept.chmod(0o644)
    with Catalogue() as catalogue:
        assert runs.get(catalogue, 1).note == ""


def test_one_that_another_program_holds(kept: Path, armhil: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "BUSY_SECONDS", 0.1)
    holder = sqlite3.connect(kept, isolation_level=None)
    holder.execute("BEGIN IMMEDIATE")
    try:
        code, _, err = armhil("note", "1", "word")
        assert code == 2 and "database is locked; another program holds it: `fuser FILE`" in " ".join(
            err.split()
        )
        assert armhil("runs")[0] == 0, "who only reads waits for nobody"
    finally:
        holder.close()
    assert armhil("note", "1", "word")[0] == 0
