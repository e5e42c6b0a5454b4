"""`armhil test`."""

from __future__ import annotations

from pathlib import Path

import typer

from daq.cli.app import app


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
)
def test(context: typer.Context) -> int:
    """Run the tests of a clone with pytest; what follows goes to pytest. [bold]--slow[/]: the slow ones.

    Example: [bold]armhil test -k emps -x[/]
    """
    from daq.cli.run_tests import run_tests

    return run_tests(Path.cwd(), context.args)
