"""`armhil prune`."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import Json, OfArm, console_of, print_json


@app.command()
def prune(
    older_than: Annotated[
        float, typer.Option("--older-than", min=0.0, help="Only runs that began so many days ago.")
    ] = 90.0,
    arm: OfArm = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would go; delete nothing.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    as_json: Json = False,
) -> None:
    """Delete old recordings, after asking; never one that a baseline rests on. What was found in them stays.

    Example: [bold]armhil prune --older-than 180 --dry-run[/]
    """
    from daq.catalogue import arms
    from daq.catalogue.database import Catalogue
    from daq.catalogue.runs import settle_abandoned
    from daq.cli.catalogue_json import prune_json
    from daq.cli.catalogue_terminal import print_prune
    from daq.keeping import prune as pruning
    from daq.recording.who import now
    from daq.session.questions import answered

    console = console_of(as_json)
    with Catalogue() as catalogue:
        settle_abandoned(catalogue)
        if arm is not None:
            arms.by_label(catalogue, arm)
        planned = pruning.plan_prune(catalogue, now() - timedelta(days=older_than), arm)
        print_prune(console, planned, "deletes")
        done = planned
        if planned.prunable and not dry_run:
            done = pruning.PrunePlan((), planned.kept)
            nobody = "asks before it deletes; give --yes where nobody can answer"
            if yes or answered(f"Delete {len(planned.prunable)} recordings?", nobody, err=as_json):
                done = pruning.prune(catalogue, planned)
                done = pruning.PrunePlan(done.prunable, (*planned.kept, *done.kept))
            print_prune(console, done, "deleted")
    if as_json:
        print_json(prune_json(done, dry_run=dry_run))
