"""Timers and cron lines: what systemd itself says of them, names that climb, what is there afterwards."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from daq.cli.entry import app
from daq.service.units import (
    Schedule,
    ScheduleError,
    install,
    installed,
    remove,
    serving_unit,
    unit_folder,
)


def schedule(folder: Path, **changes: object) -> Schedule:
    values = {
        "name": "tx40",
        "calendar": "*-*-* 02:30:00",
        "command": ("tx40", "--celsius", "22"),
        "folder": folder,
        **changes,
    }
    return Schedule(**values)  # type: ignore[arg-type]


def test_systemd_accepts_the_units(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not here")
    odd = ("arms/my arm%1/robot.toml", "--channel", "can$0;x", "--out", 'a"b')
    made = schedule(tmp_path, command=odd, delay=600, catalogue="sqlite:///a b.db")
    paths = install(made, tmp_path / "units")
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", *map(str, paths)],
        capture_output=True,
        text=True,
        check=False,
    )
    own = [line for line in done.stderr.splitlines() if "armhil" in line]
    assert done.returncode == 0 and not own, done.stderr
    when = subprocess.run(
        ["systemd-analyze", "calendar", made.calendar], capture_output=True, text=True, check=False
    )
    assert when.returncode == 0


def test_systemd_refuses_what_is_wrong(tmp_path: Path) -> None:
    """The check above can fail."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not here")
    paths = install(schedule(tmp_path, calendar="every full moon"), tmp_path / "units")
    command = ["systemd-analyze", "verify", "--man=no", *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "full moon" in done.stderr or done.returncode != 0


def test_missed_checks_are_made_up_for_and_verdicts_are_no_failures(tmp_path: Path) -> None:
    made = schedule(tmp_path, delay=60)
    assert "Persistent=true" in made.timer_text() and "RandomizedDelaySec=60" in made.timer_text()
    assert "SuccessExitStatus=1 3" in made.service_text()
    assert "KillMode=process" in made.service_text()  # else systemd ends who tells of the verdict
    assert f"ExecStart={sys.executable} -m daq check tx40 --celsius 22 --quiet" in made.service_text()


def test_install_list_remove(tmp_path: Path) -> None:
    service, timer = install(schedule(tmp_path), tmp_path)
    assert installed(tmp_path) == {"tx40": "*-*-* 02:30:00"}
    install(schedule(tmp_path, calendar="03:00"), tmp_path)
    assert installed(tmp_path) == {"tx40": "03:00"}
    assert set(remove("tx40", tmp_path)) == {service, timer}
    assert installed(tmp_path) == {} and not list(tmp_path.iterdir())
    with pytest.raises(ScheduleError, match="tx40: is not scheduled"):
        remove("tx40", tmp_path)


@pytest.mark.parametrize("name", ["../x", "a/b", "", "a b", "x" * 61, "é"])
def test_names_that_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ScheduleError):
        schedule(tmp_path, name=name)
    with pytest.raises(ScheduleError):
        remove(name, tmp_path)


def test_no_second_line_gets_into_a_unit(tmp_path: Path) -> None:
    with pytest.raises(ScheduleError, match="one line"):
        schedule(tmp_path, calendar="02:30\nExecStart=/bin/false")


@pytest.mark.parametrize(
    ("calendar", "fields"),
    [
        ("*-*-* 02:30:00", "30 2 * * *"),
        ("02:05", "5 2 * * *"),
        ("Mon,Thu 23:59", "59 23 * * 1,4"),
    ],
)
def test_cron(tmp_path: Path, calendar: str, fields: str) -> None:
    line = schedule(tmp_path / "my runs", calendar=calendar, command=("tx40", "--out", "a%b")).cron_line()
    assert line.startswith(f"{fields} cd '{tmp_path}/my runs' && ")
    assert r"a\%b" in line and line.endswith("--quiet")


@pytest.mark.parametrize("calendar", ["hourly", "25:00", "*-*-01 02:30", "Foo 02:30"])
def test_what_cron_cannot_say(tmp_path: Path, calendar: str) -> None:
    with pytest.raises(ScheduleError, match="cron cannot say that"):
        schedule(tmp_path, calendar=calendar).cron_line()


def test_where_units_go(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert unit_folder(system=False) == tmp_path / "systemd" / "user"
    assert unit_folder(system=True) == Path("/etc/systemd/system")


def test_systemd_accepts_the_unit_of_the_service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not here")
    monkeypatch.setenv("ARMHIL_CATALOGUE", "sqlite:///a b%1.db")
    monkeypatch.delenv("ARMHIL_FLEET", raising=False)
    text = serving_unit(("--port", "8091"), tmp_path, ("ARMHIL_CATALOGUE", "ARMHIL_FLEET"))
    path = tmp_path / "armhil.service"
    path.write_text(text)
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "armhil" not in done.stderr, done.stderr
    assert 'Environment="ARMHIL_CATALOGUE=sqlite:///a b%%1.db"' in text and "ARMHIL_FLEET" not in text
    assert "-m daq serve --port 8091\n" in text and f"WorkingDirectory={tmp_path}\n" in text


def test_the_unit_is_printed_with_the_options_given(capsys: pytest.CaptureFixture[str]) -> None:
    assert app(["serve", "--unit", "--port", "8092", "--out", "/srv/runs"], standalone_mode=False) == 0
    line = next(one for one in capsys.readouterr().out.splitlines() if one.startswith("ExecStart="))
    assert line.endswith("-m daq serve --port 8092 --out /srv/runs")
