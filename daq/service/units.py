"""Timers that check an arm regularly: systemd units, and the line for cron where there is no systemd."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from robots.errors import UserError

PREFIX = "armhil-check-"
_NAME = re.compile(r"[A-Za-z0-9._-]{1,60}")


class ScheduleError(UserError):
    """A schedule that cannot be made; one line for the user."""


@dataclass(frozen=True)
class Schedule:
    """A regular check.

    Attributes:
        name: of the timer; letters, digits, dot, dash and underline.
        calendar: when, as systemd.time(7) writes it, e.g. ``*-*-* 02:30:00``.
        command: arguments of ``armhil check``.
        delay: s by which starts are spread, so that many arms do not begin at once.
        folder: working folder, where runs/ goes.
        catalogue: of the checks; the user's where None.
    """

    name: str
    calendar: str
    command: tuple[str, ...]
    folder: Path
    delay: int = 0
    catalogue: str | None = None

    def __post_init__(self) -> None:
        if _NAME.fullmatch(self.name) is None:
            raise ScheduleError(f"--name {self.name}; allowed: up to 60 letters, digits, '.', '-' and '_'")
        if any("\n" in part for part in (self.calendar, *self.command)):
            raise ScheduleError("a schedule must fit on one line")

    @property
    def unit(self) -> str:
        """Name of the units without their ending."""
        return f"{PREFIX}{self.name}"

    def service_text(self) -> str:
        """The service unit: one check, whose exit codes 1 and 3 are verdicts and no failures of the unit."""
        words = " ".join(map(_quoted, (sys.executable, "-m", "daq", "check", *self.command, "--quiet")))
        lines = [
            "[Unit]",
            f"Description=armhil check {_plain(' '.join(self.command))}",
            "After=network.target",
            "",
            "[Service]",
            "Type=oneshot",
            f"WorkingDirectory={_plain(str(self.folder))}",
            *(
                []
                if self.catalogue is None
                else [f"Environment={_quoted('ARMHIL_CATALOGUE=' + self.catalogue)}"]
            ),
            f"ExecStart={words}",
            "SuccessExitStatus=1 3",
            "TimeoutStartSec=2h",
            "KillSignal=SIGINT",
            # What tells of the verdict outlives the check; the process that streams stops the arm by itself.
            "KillMode=process",
            "",
        ]
        return "\n".join(lines)

    def timer_text(self) -> str:
        """The timer unit; a check that was due while the machine was off is made up for."""
        lines = [
            "[Unit]",
            f"Description=armhil check {_plain(self.name)}, regularly",
            "",
            "[Timer]",
            f"OnCalendar={_plain(self.calendar)}",
            "Persistent=true",
            *([] if not self.delay else [f"RandomizedDelaySec={self.delay}"]),
            "",
            "[Install]",
            "WantedBy=timers.target",
            "",
        ]
        return "\n".join(lines)

    def cron_line(self) -> str:
        """The same for a crontab, where the calendar is a time of every day or of a day of the week.

        Raises:
            ScheduleError: the calendar is more than cron can say.
        """
        minute, hour, weekday = _daily(self.calendar)
        words = shlex.join((sys.executable, "-m", "daq", "check", *self.command, "--quiet"))
        folder = shlex.quote(str(self.folder))
        environment = "" if self.catalogue is None else f"ARMHIL_CATALOGUE={shlex.quote(self.catalogue)} "
        line = f"{minute} {hour} * * {weekday} cd {folder} && {environment}{words}"
        return line.replace("%", r"\%")  # cron makes a new line of a bare one


def serving_unit(options: tuple[str, ...], folder: Path, variables: Sequence[str]) -> str:
    """The unit of the service itself; what it may not do is said to systemd (systemd.exec(5)).

    Args:
        options: of ``armhil serve``.
        folder: working folder, where runs/ goes.
        variables: of the environment that it needs: where catalogue, settings and fleet are. Tokens do not
            belong in a unit, which everybody may read: they come from a file beside it, which need not be
            there.
    """
    words = " ".join(map(_quoted, (sys.executable, "-m", "daq", "serve", *options)))
    kept = [
        f"Environment={_quoted(f'{name}={os.environ[name]}')}" for name in variables if name in os.environ
    ]
    lines = [
        "[Unit]",
        "Description=armhil serve: arms, runs and verdicts in a browser",
        "After=network.target",
        "",
        "[Service]",
        f"WorkingDirectory={_plain(str(folder))}",
        *kept,
        "EnvironmentFile=-%h/.config/armhil/tokens",
        f"ExecStart={words}",
        "Restart=on-failure",
        "KillSignal=SIGINT",
        # A check that was started here outlives the service only until it has brought its arm to rest.
        "KillMode=mixed",
        "TimeoutStopSec=60",
        "UMask=0077",
        "NoNewPrivileges=true",
        "ProtectSystem=full",
        "",
        "[Install]",
        "WantedBy=default.target",
        "",
    ]
    return "\n".join(lines)


def unit_folder(system: bool) -> Path:
    """Where units go: of the machine, or of the user."""
    if system:
        return Path("/etc/systemd/system")
    home = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return home / "systemd" / "user"


def install(schedule: Schedule, folder: Path) -> tuple[Path, Path]:
    """Write both units; returns the paths of service and timer.

    Raises:
        ScheduleError: they cannot be written.
    """
    paths = (folder / f"{schedule.unit}.service", folder / f"{schedule.unit}.timer")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in zip(paths, (schedule.service_text(), schedule.timer_text()), strict=True):
            temporary = path.with_suffix(path.suffix + ".new")
            temporary.write_text(text, encoding="utf-8")
            temporary.replace(path)
    except OSError as error:
        raise ScheduleError(f"{folder}: cannot be written: {error.strerror}") from error
    return paths


def remove(name: str, folder: Path) -> tuple[Path, ...]:
    """Delete the units of a name.

    Raises:
        ScheduleError: there are none, or they cannot be deleted.
    """
    if _NAME.fullmatch(name) is None:
        raise ScheduleError(f"{name}: is no name of a schedule")
    found = tuple(
        path for kind in ("timer", "service") if (path := folder / f"{PREFIX}{name}.{kind}").is_file()
    )
    if not found:
        allowed = ", ".join(installed(folder)) or "none is installed"
        raise ScheduleError(f"{name}: is not scheduled in {folder}; allowed: {allowed}")
    try:
        for path in found:
            path.unlink()
    except OSError as error:
        raise ScheduleError(f"{folder}: cannot be written: {error.strerror}") from error
    return found


def installed(folder: Path) -> dict[str, str]:
    """Names of the schedules in a folder, and when they run."""
    found = {}
    for path in sorted(folder.glob(f"{PREFIX}*.timer")):
        calendar = [line[11:] for line in path.read_text().splitlines() if line.startswith("OnCalendar=")]
        found[path.name[len(PREFIX) : -len(".timer")]] = calendar[0] if calendar else "?"
    return found


def systemctl(system: bool, *arguments: str) -> str | None:
    """Tell systemd; None where that went well, else what it said or why it could not be told."""
    command = ["systemctl", *([] if system else ["--user"]), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{command[0]}: {error}"
    return None if done.returncode == 0 else " ".join(done.stderr.split()) or f"exit code {done.returncode}"


def _daily(calendar: str) -> tuple[int, int, str]:
    days = {"sun": 0, "mon": 1, "tue": 2, "wed": 3, "thu": 4, "fri": 5, "sat": 6}
    found = re.fullmatch(r"(?:(\w{3}(?:,\w{3})*) )?(?:\*-\*-\* )?(\d{1,2}):(\d{2})(?::00)?", calendar)
    names = [] if found is None or found[1] is None else found[1].lower().split(",")
    if found is None or any(name not in days for name in names) or int(found[2]) > 23 or int(found[3]) > 59:
        raise ScheduleError(
            f"--at {calendar}: cron cannot say that; allowed for cron: 02:30, or Mon,Thu 02:30"
        )
    return int(found[3]), int(found[2]), ",".join(str(days[name]) for name in names) or "*"


def _quoted(word: str) -> str:
    """A word of a unit file's command line (systemd.service(5)): % and $ mean themselves."""
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"' if re.search(r"[\s'\"\\;]", word) else escaped


def _plain(text: str) -> str:
    return text.replace("%", "%%")
