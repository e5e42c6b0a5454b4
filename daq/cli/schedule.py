"""`armhil schedule`: checks that are made regularly."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, Yes, console_of, print_json, say

group = typer.Typer(
    help="Check arms regularly: install, list, remove timers.\n\n"
    'Example: [bold]armhil schedule install tx40 --at "02:30" -- tx40[/]',
    rich_markup_mode="rich",
)
app.add_typer(group, name="schedule")

System = Annotated[bool, typer.Option("--system", help="Of the machine, not of the user.")]


@group.command(context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
def install(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="Name of the schedule, e.g. of the arm.")],
    at: Annotated[str, typer.Option("--at", help="When, as systemd.time(7) says it.")] = "*-*-* 02:30:00",
    delay: Annotated[int, typer.Option(min=0, help="Spread the starts over so many seconds.")] = 0,
    system: System = False,
    cron: Annotated[bool, typer.Option("--cron", help="Only print the line for a crontab.")] = False,
    yes: Yes = False,
) -> int:
    """Show the timer, ask, write it, and start it. What stands behind -- goes to `armhil check`.

    Example: [bold]armhil schedule install tx40 --at "02:30" -- tx40 --celsius 22[/]
    """
    from daq.service.units import Schedule, ScheduleError, systemctl, unit_folder
    from daq.service.units import install as write
    from daq.session.questions import answered

    if not context.args:
        raise ScheduleError('say after -- what `armhil check` is given, e.g. "-- tx40", or "-- --all"')
    schedule = Schedule(name, at, tuple(context.args), Path.cwd(), delay, os.environ.get("ARMHIL_CATALOGUE"))
    console = console_of(False)
    if cron:
        console.print(schedule.cron_line(), soft_wrap=True, highlight=False, markup=False)
        return OK
    folder = unit_folder(system)
    for kind, text in (("service", schedule.service_text()), ("timer", schedule.timer_text())):
        console.print(f"{folder / schedule.unit}.{kind}", highlight=False, style="bold", soft_wrap=True)
        console.print(text, soft_wrap=True, highlight=False, markup=False)
    nobody = "asks before the files are written; give --yes where nobody can answer"
    if not yes and not answered("Write these two files?", nobody):
        return WARNING
    write(schedule, folder)
    for arguments in (("daemon-reload",), ("enable", "--now", f"{schedule.unit}.timer")):
        problem = systemctl(system, *arguments)
        if problem is not None:
            say(f"written, and not started: systemctl {' '.join(arguments)}: {problem}")
            return WARNING
    console.print(f"Timer {schedule.unit} runs.", highlight=False)
    return OK


@group.command("list")
def list_(system: System = False, as_json: Json = False) -> int:
    """List the schedules.

    Example: [bold]armhil schedule list[/]
    """
    from daq.service.units import installed, unit_folder

    found = installed(unit_folder(system))
    if as_json:
        print_json({"schedules": [{"name": name, "at": at} for name, at in found.items()]})
    console = console_of(as_json)
    for name, at in found.items():
        console.print(f"{name}: {at}", highlight=False, markup=False)
    if not found:
        console.print("No schedules. `armhil schedule install NAME -- ROBOT` makes one.", highlight=False)
    return OK


@group.command()
def remove(name: Annotated[str, typer.Argument(help="Name of the schedule.")], system: System = False) -> int:
    """Stop a timer and delete its files.

    Example: [bold]armhil schedule remove tx40[/]
    """
    from daq.service.units import PREFIX, systemctl, unit_folder
    from daq.service.units import remove as delete

    systemctl(system, "disable", "--now", f"{PREFIX}{name}.timer")
    for path in delete(name, unit_folder(system)):
        console_of(False).print(f"deleted {path}", highlight=False, soft_wrap=True)
    systemctl(system, "daemon-reload")
    return OK
