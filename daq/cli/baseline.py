"""`armhil baseline`: which model counts as what an arm is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from daq.cli.app import app
from daq.cli.common import OK, Json, RunNumber, console_of, print_json

group = typer.Typer(
    help="Say which model counts as what an arm is: accept, roll back, suspect, trust, show.\n\n"
    'Example: [bold]armhil baseline accept 12 --reason "after the gear was changed"[/]',
    rich_markup_mode="rich",
)
app.add_typer(group, name="baseline")

Arm = Annotated[str, typer.Argument(help="Label of an arm (see `armhil runs`).", metavar="ARM")]
Reason = Annotated[str, typer.Option("--reason", help="Why; kept for ever.")]
Author = Annotated[str | None, typer.Option("--author", help="Who.", show_default="the user's name")]
Report = Annotated[
    Path | None, typer.Option("--report", help="Page that this rests on.", show_default="the model's report")
]


@group.command()
def accept(
    run: RunNumber, reason: Reason, author: Author = None, report: Report = None, as_json: Json = False
) -> int:
    """The newest model of a run becomes the baseline of its arm.

    Example: [bold]armhil baseline accept 12 --reason "after the gear was changed"[/]
    """
    from daq.check.baseline import accept_run

    return _shown(accept_run, run, reason, author, report, as_json)


@group.command()
def rollback(
    arm: Arm, reason: Reason, author: Author = None, report: Report = None, as_json: Json = False
) -> int:
    """Take the baseline back; the one before it counts again.

    Example: [bold]armhil baseline rollback tx40 --reason "was recorded with the tool on"[/]
    """
    from daq.check.baseline import roll_back

    return _shown(roll_back, arm, reason, author, report, as_json)


@group.command()
def suspect(
    arm: Arm, reason: Reason, author: Author = None, report: Report = None, as_json: Json = False
) -> int:
    """The baseline stays in use, and every check says loudly that it is doubted.

    Example: [bold]armhil baseline suspect tx40 --reason "torque sensor of the stand was off"[/]
    """
    from daq.check.baseline import suspect_arm

    return _shown(suspect_arm, arm, reason, author, report, as_json)


@group.command()
def trust(
    arm: Arm, reason: Reason, author: Author = None, report: Report = None, as_json: Json = False
) -> int:
    """The baseline is doubted no longer.

    Example: [bold]armhil baseline trust tx40 --reason "measured again, same figures"[/]
    """
    from daq.check.baseline import trust_arm

    return _shown(trust_arm, arm, reason, author, report, as_json)


@group.command()
def show(arm: Arm, as_json: Json = False) -> int:
    """All baselines of an arm, newest first, with who said what.

    Example: [bold]armhil baseline show tx40[/]
    """
    from daq.catalogue.database import Catalogue
    from daq.check.baseline import all_of, baseline_json, print_baselines

    with Catalogue() as catalogue:
        found = all_of(catalogue, arm)
    if as_json:
        print_json({"arm": arm, "baselines": [baseline_json(one) for one in found]})
    print_baselines(console_of(as_json), arm, found)
    return OK


def _shown(
    change: Any, of: int | str, reason: str, author: str | None, report: Path | None, as_json: bool
) -> int:
    from daq.catalogue.database import Catalogue
    from daq.check.baseline import baseline_json, print_baselines

    with Catalogue() as catalogue:
        label, found = change(catalogue, of, author, reason, report)
    if as_json:
        print_json({"arm": label, "baselines": [baseline_json(one) for one in found]})
    print_baselines(console_of(as_json), label, found)
    return OK
