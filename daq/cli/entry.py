"""The command line: it parses, calls and prints; the work is done elsewhere.

Modules that take long to import are imported inside the commands, so that help is quick.
"""

from __future__ import annotations

import logging
import os
import re
import sys
import traceback
from typing import Any

import typer
from typer.exceptions import TyperException

from daq.cli import (
    acknowledge,
    baseline,
    check,
    commission,
    compare,
    controller,
    demo,
    diagnose,
    doctor,
    export,
    export_model,
    gain,
    home,
    identify,
    import_,
    jog,
    note,
    plan,
    protocol,
    prune,
    recover,
    rerun,
    robots,
    run,
    runs,
    scan,
    schedule,
    serve,
    show,
    sim,
    test,
)
from daq.cli.app import SAID, app
from daq.cli.common import FAILED, INTERRUPTED, OK, say
from daq.session.session_error import RunInterrupted
from robots.errors import UserError, bearable

__all__ = ["app", "main"]

# Importing one of these adds its command to the app; groups and order are those of the help.
GROUPS = {
    "From an arm to a model": (demo, identify, diagnose, gain, controller),
    "Driving an arm": (plan, home, jog, commission, protocol, run, acknowledge),
    "Watching over arms": (check, baseline, schedule, serve),
    "What was run": (runs, show, note, rerun, compare, prune),
    "Recordings": (import_, export, export_model, recover),
    "Around it": (robots, doctor, scan, sim, test),
}


def _grouped() -> None:
    """Help in groups, in their order."""
    modules = {module.__name__: name for name, group in GROUPS.items() for module in group}
    place = {name: number for number, name in enumerate(modules)}
    for command in app.registered_commands:
        module = getattr(command.callback, "__module__", "")
        command.rich_help_panel = modules.get(module)
    for family in app.registered_groups:
        family.rich_help_panel = modules.get(f"daq.cli.{family.name}")
    app.registered_commands.sort(
        key=lambda command: place.get(getattr(command.callback, "__module__", ""), len(place))
    )


_grouped()


def _help_of(error: TyperException) -> str:
    """The command that shows the help of the command that was called wrongly."""
    context = getattr(error, "ctx", None)
    words: list[str] = []
    while context is not None and context.parent is not None:  # the last one is the program's own name
        words.insert(0, str(context.info_name))
        context = context.parent
    return " ".join(["armhil", *words, "--help"])


_WHOLE_COMMAND = re.compile(r"`[^` ]+ [^`]+`|: (\./)?armhil [a-z-]+| -m pip install ")


def _with_next(text: str, words: list[str]) -> str:
    """A refusal that names a whole command: its own, else the help of what was called.

    Args:
        text: of the refusal.
        words: that armhil was called with.
    """
    if _WHOLE_COMMAND.search(text):
        return text
    group: Any = typer.main.get_command(app)
    called = ["armhil"]
    for word in words:
        inner = getattr(group, "commands", {}).get(word)
        if inner is not None:
            group = inner
            called.append(word)
    return f"{text}; see `{' '.join([*called, '--help'])}`"


def main() -> None:
    """Run the command line; a user's mistake ends in one line and exit code 2, never in a traceback."""
    for library in ("OMP", "OPENBLAS", "MKL"):
        # Many small solves run faster on one thread. Before anything imports numpy.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    debug = os.environ.get("ARMHIL_DEBUG", "") not in ("", "0")
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
    except SystemExit:
        # So Typer leaves where the reader of a pipe has gone; nobody is there to be told.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(OK)
    except typer.Abort:
        code = INTERRUPTED
    except TyperException as error:
        wrong = bearable(error.format_message().rstrip("."))
        say(f"{wrong}; `{_help_of(error)}` shows what it takes, with an example")
        sys.exit(FAILED)
    except RunInterrupted as error:
        say(str(error))
        sys.exit(INTERRUPTED)
    except (UserError, OSError) as error:
        if debug:
            raise
        say(_with_next(bearable(str(error)), sys.argv[1:]))
        sys.exit(FAILED)
    except Exception:  # noqa: BLE001 (a mistake of armhil's own: 1, as Python ends then, would read as a warning)
        traceback.print_exc()
        sys.exit(FAILED)
    if code == INTERRUPTED:
        say("interrupted")  # Typer makes this code of a KeyboardInterrupt
    code = code if isinstance(code, int) else OK
    logging.getLogger(SAID).info("ended with %d", code)
    sys.exit(code)
