"""Whatever a command is called with, its refusal is one line of bearable length, and never a traceback."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import typer

from daq.cli.entry import app, main
from robots.errors import LONGEST_LINE, bearable

NAME = "n" * 4000
LONGEST = LONGEST_LINE + 100
"""With the command whose help goes on from there."""


def words(group: typer.Typer, before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every command, those of families too; ``test`` hands what it does not know to pytest."""
    for name, command in sorted(typer.main.get_command(group).commands.items()):  # type: ignore[attr-defined]
        if hasattr(command, "commands"):
            yield from ((*before, name, inner) for inner in sorted(command.commands))
        else:
            yield (*before, name)


def refused(called: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    monkeypatch.setattr(sys, "argv", ["armhil", *called])
    with pytest.raises(SystemExit) as left:
        main()
    said = capsys.readouterr().err
    assert left.value.code == 2, said[:500]
    assert len(said.splitlines()) == 1
    assert said.startswith("armhil: ")
    return said


@pytest.mark.parametrize("command", [c for c in words(app) if c != ("test",)], ids=" ".join)
def test_names_of_any_length_are_refused_in_a_line(
    command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for given in ([NAME] * 9, [f"--{NAME}"], [f"/{NAME}.mcap"] * 9, ["--robot", NAME]):
        assert len(refused([*command, *given], monkeypatch, capsys)) <= LONGEST


@pytest.mark.parametrize("command", ["diagnose", "identify", "import", "check"])
def test_a_log_with_names_of_any_length_is_refused_in_a_line(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.npz"
    np.savez(log, **{f"{NAME}{k}": np.arange(100.0) for k in range(40)})
    assert len(refused([command, str(log), "--robot", "tx40"], monkeypatch, capsys)) <= LONGEST


def test_of_a_long_line_both_ends_are_kept() -> None:
    assert bearable("short\nline") == "short line"
    text = bearable("begin " + NAME + " end")
    assert text.startswith("begin nnn")
    assert text.endswith("nnn end")
    assert len(text) == LONGEST_LINE
