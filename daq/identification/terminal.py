"""What a person sees on the terminal: progress bars, tables, one clear line for an error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from daq.files.found_model import found_words
from daq.text.numbers import NOTHING, percent, probability, setting, significant, with_sigma
from daq.text.progress import Update
from daq.text.verdict_words import VERDICTS, VerdictKind, asked_for, words_of
from ident import Estimate, Identification
from ident.results import Consistency, Essential, HeldOut, Rank, Signals

_COLOURS: dict[VerdictKind, str] = {"good": "green", "switch": "yellow", "bad": "red", "unknown": "yellow"}


class TerminalSteps:
    """Progress bars with time left on the given console; plain lines where it is no terminal."""

    def __init__(self, console: Console) -> None:
        self._console = console

    @contextmanager
    def step(self, title: str) -> Iterator[Update]:
        """Show a bar until the block ends."""
        if not self._console.is_terminal:
            self._console.print(f"{title} …")
            yield _nothing
            return
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description:<28}"),
            BarColumn(bar_width=30),
            TextColumn("{task.percentage:>4.0f} %"),
            TimeElapsedColumn(),
            TimeRemainingColumn(compact=True),
            TextColumn("{task.fields[word]}"),
        )
        with Progress(*columns, console=self._console) as progress:
            task = progress.add_task(title, total=1.0, word="")
            yield lambda share, word: progress.update(task, completed=share, word=word)
            progress.update(task, completed=1.0, word="")


def _nothing(share: float, word: str) -> None:
    """A pipe needs no bar."""


def print_identification(
    console: Console, result: Identification, truth: Mapping[str, float] | None = None
) -> None:
    """Parameters, gates and verdict, the verdict last, where the eye is."""
    trusted = result.recommended
    console.print(_parameter_table(trusted, truth))
    if result.found:
        console.print(f"Found effects in the model: {found_words(result.found)}.", highlight=False)
    if result.essential is not None:
        console.print(_essential(result.essential), highlight=False)
    if result.consistency is not None:
        console.print(_links_table(result.consistency))
        console.print(f"Arm that can exist: {result.consistency.sentence}.", highlight=False)
    if result.held_out:
        console.print(_held_out_table(result.held_out))
    if result.signals is not None:
        console.print(_signals(result.signals, result.rank), highlight=False)
    console.print(_gate_table(result))
    console.print(_verdict(result, trusted))
    console.print(f"{result.test.recommendation} {asked_for(result)}".strip(), highlight=False)
    for warning in result.warnings:
        console.print(f"[yellow]warning:[/] {warning}", highlight=False)


def _verdict(result: Identification, trusted: Estimate) -> str:
    error = percent(trusted.relative_error_percent)
    worst = int(np.argmax(trusted.relative_error_percent_per_joint))
    worst_error = percent(float(trusted.relative_error_percent_per_joint[worst]))
    words = VERDICTS[result.test.verdict]
    return (
        f"\n[bold {_COLOURS[words.kind]}]{words.headline.upper()}[/]   relative torque error {error},"
        f" largest on joint {worst + 1}: {worst_error}"
    )


def _parameter_table(estimate: Estimate, truth: Mapping[str, float] | None) -> Table:
    method = words_of(estimate.method)
    table = Table(title=f"Base parameters by {method}", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("parameter", "unit"):
        table.add_column(heading, no_wrap=True)
    for heading in ("value", "σ", "% σ", "± 95 %"):
        table.add_column(heading, justify="right", no_wrap=True)
    if truth is not None:
        for heading in ("truth", "off by"):
            table.add_column(heading, justify="right", no_wrap=True)
    for parameter in estimate.parameters:
        true = None if truth is None else truth[parameter.name]
        value, sigma, half, *rest = with_sigma(
            parameter.value, parameter.sigma, parameter.half_width, *([] if true is None else [true])
        )
        cells = [parameter.name, parameter.unit, value, sigma, percent(parameter.percent_sigma)]
        cells.append(half if parameter.half_width is not None else NOTHING)
        if true is not None:
            away = (parameter.value - true) / parameter.sigma
            cells += [*rest, f"{away:+.1f} σ".replace("-", "−")]
        table.add_row(*cells)
    return table


def _gate_table(result: Identification) -> Table:
    table = Table(
        title="Revised Durbin-Wu-Hausman test", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1)
    )
    table.add_column("gate", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("statistic", no_wrap=True, justify="right")
    table.add_column("detail")
    words = {
        ("instruments", True): "valid",
        ("instruments", False): "not valid",
        ("rank", True): "nothing to test",
        ("rank", False): "columns to test",
        ("exogeneity", True): "exogenous",
        ("exogeneity", False): "endogenous",
    }
    for gate in result.test.gates:
        word = "not reached" if gate.passed is None else words[gate.name, gate.passed]
        p = "" if gate.p_value is None else f"\n{probability(gate.p_value)}"
        statistic = "" if gate.statistic is None else f"{significant(gate.statistic)}{p}"
        table.add_row(gate.name, word, statistic, gate.detail)
    return table


def _held_out_table(held_out: tuple[HeldOut, ...]) -> Table:
    table = Table(
        title="Prediction of recordings that were not fitted to",
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1),
    )
    table.add_column("recording")
    for heading in ("estimate", "relative error", "per joint", "rms per joint"):
        table.add_column(heading, justify="right")
    for entry in held_out:
        table.add_row(
            entry.recording,
            words_of(entry.method),
            percent(entry.relative_error_percent),
            "  ".join(percent(float(error)) for error in entry.relative_error_percent_per_joint),
            "  ".join(significant(float(rms)) for rms in entry.torque_rms),
        )
    return table


def _links_table(consistency: Consistency) -> Table:
    table = Table(
        title="Links of the nearest arm that can exist", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1)
    )
    table.add_column("link", no_wrap=True)
    for heading in ("mass, kg", "centre of mass, m", "margin"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    for link in consistency.links:
        words = ["at the limit of what a body can be"] if link.at_limit else []
        words += ["no body before"] if link.impossible_before else []
        center = "  ".join(significant(float(x)) for x in link.center)
        table.add_row(
            link.name, significant(link.mass), center, significant(link.margin, 2), "; ".join(words)
        )
    return table


def _essential(essential: Essential) -> str:
    """What the F-tests let go, and where they stopped."""
    count = len(essential.parameters)
    if not essential.dropped:
        return f"Essential parameters: all {count} are needed."
    names = ", ".join(dropped.name for dropped in essential.dropped)
    last = essential.dropped[-1]
    return (
        f"Essential parameters: {count}; without {names} the fit is not worse"
        f" (F = {significant(last.statistic)}, {probability(last.p_value)})."
    )


def _signals(signals: Signals, rank: Rank | None) -> str:
    """What the data say of the settings, each beside the setting."""
    lag = "none found"
    if signals.estimated_lag is not None and signals.lag_sigma is not None:
        value, sigma = with_sigma(1e3 * signals.estimated_lag, 1e3 * signals.lag_sigma)
        lag = f"{value} ± {sigma} ms"
    lines = [
        f"Cut-off {setting(signals.cutoff_hz)} Hz; proposed {setting(signals.proposed_cutoff_hz)} Hz",
        f"control-signal lag {setting(1e3 * signals.lag)} ms; estimated {lag}",
        f"noise of positions at most {significant(float(np.max(signals.position_noise)), 2)} rad or m",
    ]
    if rank is not None:
        lines.append(f"rank {rank.data} of {rank.structural}")
    return "; ".join(lines) + "."
