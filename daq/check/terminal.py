"""A check on the terminal: the line that a monitoring system reads, then what it rests on."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from daq.check.check_json import performance_data
from daq.check.fleet_run import FleetChecked
from daq.check.request import CheckResult
from daq.text.numbers import probability, significant
from ident.drift import Comparison


def status_line(result: CheckResult) -> str:
    """``ARMHIL OK - tx40: sentence | data``, as Nagios and its kin read it."""
    data = performance_data(result)
    line = f"ARMHIL {result.verdict.upper()} - {result.arm}: {result.sentence}"
    return f"{line} | {data}" if data else line


def print_check(console: Console, result: CheckResult) -> None:
    """The status line, what moved, and where to read on."""
    console.print(escape(status_line(result)), soft_wrap=True, highlight=False)
    if result.comparison is not None:
        _print_comparison(console, result.comparison)
    console.print(f"Report: [bold]{result.report}[/]", soft_wrap=True, highlight=False)
    console.print(f"Run [bold]{result.run}[/] of the catalogue", highlight=False)


def print_fleet(console: Console, done: FleetChecked) -> None:
    """One line per arm."""
    for name, outcome in zip(done.names, done.outcomes, strict=True):
        if isinstance(outcome, CheckResult):
            console.print(escape(status_line(outcome)), soft_wrap=True, highlight=False)
        else:
            text = " ".join(str(outcome).split())
            console.print(escape(f"ARMHIL FAILED - {name}: {text}"), soft_wrap=True, highlight=False)


def _print_comparison(console: Console, compared: Comparison) -> None:
    for test in (compared.wald, compared.between_runs, compared.unexplained):
        if test is not None:
            of = f"{test.distribution}, {probability(test.p_value)}"
            said = f"{test.name}: {significant(test.statistic)}, {of}"
            console.print(escape(said), soft_wrap=True, highlight=False)
    if not compared.parameters:
        return
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("parameter", "change", "σ", "unit", "p (Holm)", "torque, rms"):
        table.add_column(heading, no_wrap=True)
    for parameter in compared.parameters[:10]:
        table.add_row(
            escape(parameter.name),
            significant(parameter.change, signed=True),
            significant(parameter.sigma, 2),
            escape(parameter.unit),
            probability(parameter.corrected),
            significant(parameter.torque_rms),
        )
    console.print(table)
