"""A check on the terminal: the line that a monitoring system reads, then what it rests on."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from daq.check.check_json import performance_data
from daq.check.fleet_run import FleetChecked
from daq.check.request import CheckResult, Verdict
from daq.identification.answer import per_joint
from daq.identification.terminal import print_all
from daq.text.numbers import probability, significant
from daq.text.wrapped import Column, write, write_table
from ident.drift import Comparison


def status_line(result: CheckResult) -> str:
    """``ARMHIL OK - tx40: sentence | data``, as Nagios and its kin read it."""
    data = performance_data(result)
    line = f"ARMHIL {result.verdict.upper()} - {result.arm}: {result.sentence}"
    return f"{line} | {data}" if data else line


def print_check(console: Console, result: CheckResult, parameters: bool = False) -> None:
    """The answer, what moved, a line per joint, and where to read on.

    Args:
        console: where a person reads; a pipe gets the line that a monitoring system reads.
        result: of the check.
        parameters: print the tests and all parameters of tonight too.
    """
    if console.is_terminal:
        write(console, f"{result.verdict.upper()}: {result.arm}: {result.sentence}", style="bold")
    else:
        console.print(escape(status_line(result)), soft_wrap=True, highlight=False)
    if result.comparison is not None:
        _print_moved(console, result.comparison)
    headings, rows = per_joint(result.fitted.result, result.fitted.base.model.robot)
    write_table(console, "Tonight", [Column(name, number > 0) for number, name in enumerate(headings)], rows)
    if parameters:
        if result.comparison is not None:
            _print_tests(console, result.comparison)
        print_all(console, result.fitted.result)
    else:
        write(console, "- Tests and parameters: --parameters.", style="dim")
    write(console, f"Report: {result.report}")
    write(console, f"Run {result.run} of the catalogue: armhil show {result.run}")


def print_fleet(console: Console, done: FleetChecked) -> None:
    """One line per arm; below those of arms that are not fine, where to read on."""
    for name, outcome in zip(done.names, done.outcomes, strict=True):
        if isinstance(outcome, CheckResult):
            console.print(escape(status_line(outcome)), soft_wrap=True, highlight=False)
            if outcome.verdict is not Verdict.OK:
                write(console, f"Report: {outcome.report}")
        else:
            text = " ".join(str(outcome).split())
            console.print(escape(f"ARMHIL FAILED - {name}: {text}"), soft_wrap=True, highlight=False)


def _print_tests(console: Console, compared: Comparison) -> None:
    for test in (compared.wald, compared.between_runs, compared.unexplained):
        if test is not None:
            of = f"{test.distribution}, {probability(test.p_value)}"
            write(console, f"{test.name}: {significant(test.statistic)}, {of}", indent="  ")


def _print_moved(console: Console, compared: Comparison) -> None:
    if not compared.parameters:
        return
    columns = [Column("moved", right=False), Column("change"), Column("σ"), Column("unit", right=False)]
    columns += [Column("p (Holm)"), Column("torque, rms", spare=1)]
    rows = [
        [
            parameter.name,
            significant(parameter.change, signed=True),
            significant(parameter.sigma, 2),
            parameter.unit,
            probability(parameter.corrected),
            significant(parameter.torque_rms),
        ]
        for parameter in compared.parameters[:10]
    ]
    write_table(console, "", columns, rows)
