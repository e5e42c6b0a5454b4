"""What the commands share: exit codes, options, and where they print."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from daq.cli.app import SAID
from robots.errors import UserError

OK, WARNING, FAILED, UNKNOWN, INTERRUPTED = 0, 1, 2, 3, 130


def there(value: Any) -> Any:
    """Callback of arguments that name files: what is not there is refused before anything is imported."""
    from daq.recording.errors import CaptureError

    for path in value if isinstance(value, list) else [value]:
        if isinstance(path, Path) and not path.exists():
            capture = "an MCAP capture recorded by armhil"
            allowed = capture if path.suffix == ".mcap" else f"{capture}, or a log with its column map"
            if path.suffix == ".toml":
                allowed = "a model, as `armhil identify CAPTURE --out FOLDER` writes it"
            raise CaptureError(f"{path}: no such file; allowed: {allowed}")
    return value


class NoSuchFile(UserError):
    """A file that an option names and that is not there."""


def file_of(kind: str) -> Callable[[Path | None], Path | None]:
    """Callback of options that name one file of a kind: as :func:`there`."""

    def existing(path: Path | None) -> Path | None:
        if path is not None and not path.exists():
            raise NoSuchFile(f"{path}: no such file; allowed: {kind}")
        return path

    return existing


def found(value: str | None) -> str | None:
    """Callback of arguments that name an arm: as :func:`there`."""
    from robots.finding import find

    if value is not None:
        find(value)
    return value


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout; text goes to stderr.")]
RobotArgument = Annotated[
    str, typer.Argument(help="A shipped arm (see `armhil robots`) or a robot.toml.", callback=found)
]
RobotName = Annotated[
    str,
    typer.Option("--robot", help="A shipped arm (see `armhil robots`) or a robot.toml.", callback=found),
]
RobotOfRecording = Annotated[
    str | None,
    typer.Option(
        "--robot", help="A shipped arm or a robot.toml.", show_default="the capture's own", callback=found
    ),
]
Columns = Annotated[
    Path | None, typer.Option("--columns", help="Column map of a log.", show_default="the robot's")
]
Out = Annotated[
    Path | None, typer.Option("--out", help="Folder for the results.", show_default="runs/<time>-<robot>")
]
NoCatalogue = Annotated[bool, typer.Option("--no-catalogue", help="Keep nothing of this in the catalogue.")]
Interface = Annotated[
    str | None, typer.Option("--interface", help="python-can interface.", show_default="the robot's")
]
ChannelName = Annotated[
    str | None, typer.Option("--channel", help="Channel on it.", show_default="the robot's")
]
Simulated = Annotated[bool, typer.Option("--simulated", help="Start simulated drives on the bus.")]
SimulatedSeed = Annotated[int, typer.Option("--seed", min=0, help="Of the simulated arm and its noise.")]
NewArm = Annotated[
    bool, typer.Option("--new-arm", help="Drives that are not known under this name are another arm.")
]
StandsAt = Annotated[
    str | None,
    typer.Option("--stands-at", help="Posture read off the arm: n positions, comma.", show_default="none"),
]
CELL_FILE = "a cell file (cell.toml)"
CellOption = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        help="cell.toml: what to keep clear of.",
        show_default="only the arm itself",
        callback=file_of(CELL_FILE),
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress and no live view.")]
NotCommissioned = Annotated[
    bool,
    typer.Option(
        "--not-commissioned", help="Move an arm that was not commissioned, at 10 % of its speed at most."
    ),
]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask before the arm moves.")]
Parameters = Annotated[
    bool, typer.Option("--parameters", help="Print all that the answer rests on: parameters, tables, tests.")
]
Celsius = Annotated[
    float | None, typer.Option(min=-40, max=80, help="Of the hall.", show_default="what drives report")
]
Note = Annotated[str | None, typer.Option("--note", help="To be remembered of the run.", show_default="none")]
Periods = Annotated[int, typer.Option("--periods", min=1, max=100, help="How often it is repeated.")]
Evaluations = Annotated[int, typer.Option("--evaluations", min=100, help="Trials of the trajectory search.")]
OfArm = Annotated[
    str | None, typer.Option("--arm", help="Only of this arm, by its label.", show_default="all")
]
RunNumber = Annotated[int, typer.Argument(help="Number of a run (see `armhil runs`).", metavar="RUN")]


def say(text: str) -> None:
    """One line on standard error, and in the log; on a terminal it breaks between words."""
    logging.getLogger(SAID).info("%s", text)
    from daq.text.wrapped import width_of, wrapped

    sys.stderr.write("\n".join(wrapped(f"armhil: {text}", width_of(sys.stderr))) + "\n")


def code_of(result: Any) -> int:
    """A model that must not be trusted is a warning to whoever calls this from a script."""
    return OK if result.trusted else WARNING


def bus_of(arm: Any, interface: str | None, channel: str | None) -> Any:
    """The bus that was asked for, else the arm's own."""
    from drivers import Channel

    return Channel.of(arm, interface, channel)


def console_of(as_json: bool) -> Any:
    """Where a person reads: stdout, or stderr when stdout carries JSON."""
    from daq.text.wrapped import WordConsole

    return WordConsole(stderr=as_json)


def print_json(content: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    sys.stdout.flush()


def catalogue_of(without: bool) -> Any:
    """The user's catalogue, opened before anything is done; None where nothing is to be kept.

    Raises:
        CatalogueError: it cannot be opened.
    """
    if without:
        return None
    from daq.catalogue.database import Catalogue

    return Catalogue()


def steps_of(console: Any, quiet: bool) -> Any:
    """Progress on the console, or nowhere."""
    from daq.text.progress import Silent
    from daq.text.terminal_steps import TerminalSteps

    return Silent() if quiet else TerminalSteps(console)


def watcher_of(console: Any, robot: Any, quiet: bool) -> Any:
    """A live view on the console, or nobody."""
    from daq.session.live_view import LiveView
    from daq.session.streaming import Nobody

    return Nobody() if quiet else LiveView(console, robot)


def asking(yes: bool, simulated: bool, as_json: bool) -> Any:
    """Who is asked before an arm moves: nobody where it is simulated or ``--yes`` was given.

    Raises:
        NotMoved: when asked where nobody can answer.
    """
    from daq.session.questions import answered

    nobody = "asks before the arm moves; give --yes where nobody can answer"
    if yes or simulated:
        return lambda question: True
    return lambda question: answered(question, nobody, err=as_json)


def looked_by(looked: bool, simulated: bool, as_json: bool) -> Any:
    """Who is asked what only somebody in front of the arm knows: ``--yes`` has no eyes.

    Raises:
        NotMoved: when asked where nobody can answer.
    """
    from daq.session.questions import answered

    nobody = "asks what only somebody in front of the arm knows; give --looked where nobody can answer"
    if looked or simulated:
        return lambda question: True
    return lambda question: answered(question, nobody, err=as_json)


def arm_order_of(
    robot: str,
    interface: str | None,
    channel: str | None,
    *,
    simulated: bool,
    seed: int,
    new_arm: bool,
    stands_at: str | None,
    not_commissioned: bool = False,
    as_json: bool = False,
) -> Any:
    """Which arm, where, from the options of a command that moves it."""
    import robots
    from daq.planning.plan_options import posture_of
    from daq.session.bench import ArmOrder

    arm = robots.load(robot)
    bus = bus_of(arm, interface, channel)
    return ArmOrder(
        arm,
        robot,
        bus,
        simulated,
        seed,
        new_arm,
        posture_of(stands_at),
        not_commissioned=not_commissioned,
        look=looking(as_json),
    )


def looking(as_json: bool) -> Any:
    """Shows where the drives say that the arm stands, and asks whoever sits in front of it.

    Raises:
        NotMoved: when asked where nobody can answer.
    """
    from daq.session.home_terminal import print_posture
    from daq.session.questions import answered

    nobody = "somebody has to look at the arm; give --stands-at where nobody can answer"

    def look(robot: Any, posture: Any) -> bool:
        print_posture(console_of(as_json), robot, posture)
        return answered("Look at the arm and its marks.\nDoes it stand so?", nobody, err=as_json)

    return look
