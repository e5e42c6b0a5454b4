"""The log file of a command, and commands that say nothing while they work."""

from __future__ import annotations

import inspect
import re
import stat
from pathlib import Path

import pytest

from daq.cli import entry
from daq.cli.entry import app, main


def called(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr("sys.argv", ["armhil", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_a_log_has_a_line_an_event_and_one_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "armhil.log"
    log.write_text("")
    log.chmod(0o644)
    assert called(monkeypatch, "--log", str(log), "robots") == 0
    assert called(monkeypatch, "--log", str(log), "show", "7") == 2
    said = capsys.readouterr().err
    assert said == "armhil: run 7: is not in the catalogue; `armhil runs` lists those that are\n"
    assert stat.S_IMODE(log.stat().st_mode) == 0o600
    lines = log.read_text().splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ INFO armhil\.said: ", line) for line in lines)
    said = [line.partition("armhil.said: ")[2] for line in lines]
    assert said[:2] == [f"armhil --log {log} robots", "ended with 0"]
    assert said[3].startswith("run 7: is not in the catalogue")


def test_a_log_that_cannot_be_written_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "--log", str(tmp_path / "no" / "x.log"), "robots") == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_every_command_that_shows_steps_can_be_quiet() -> None:
    shows = {
        command.callback.__module__: command.callback
        for command in app.registered_commands
        if command.callback is not None
        and "steps_of(" in inspect.getsource(inspect.getmodule(command.callback))  # type: ignore[arg-type]
    }
    assert {"daq.cli.identify", "daq.cli.diagnose", "daq.cli.plan", "daq.cli.check"} <= set(shows)
    assert [name for name, call in shows.items() if "quiet" not in inspect.signature(call).parameters] == []
    sources = [inspect.getsource(module) for group in entry.GROUPS.values() for module in group]
    assert not any("TerminalSteps" in source for source in sources)  # nor do they show them otherwise


def test_a_quiet_plan_shows_no_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["plan", "emps", "--duration", "4", "--evaluations", "100", "--out", str(tmp_path / "a")]
    app(words, standalone_mode=False)
    loud = capsys.readouterr().out
    app([*words[:-1], str(tmp_path / "b"), "--quiet"], standalone_mode=False)
    quiet = capsys.readouterr().out
    assert 0 < len(quiet.splitlines()) < len(loud.splitlines())
