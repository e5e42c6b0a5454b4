"""What a person sees of an identification: the answer, a line per joint, what is odd; all of it if asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from daq.identification.answer import answer_of, per_joint, worst_words
from daq.text.numbers import NOTHING, percent, probability, setting, significant, with_sigma
from daq.text.verdict_words import VerdictKind, words_of
from daq.text.wrapped import Column, write, write_table
from ident import Estimate, Fitted, Identification
from ident.effects.entry import found_words
from ident.listing import listed
from ident.results import Consistency, Essential, HeldOut, Rank, Signals

_COLOURS: dict[VerdictKind, str] = {"good": "green", "switch": "green", "bad": "red", "unknown": "yellow"}


def print_identification(
    console: Console,
    fitted: Fitted,
    truth: Mapping[str, float] | None = None,
    model: Path | None = None,
    parameters: bool = False,
) -> None:
    """The answer first, then a line per joint, then what is odd.

    Args:
        console: where a person reads.
        fitted: the identification.
        truth: base parameters of a simulated arm by name, SI; None for a real one.
        model: the model file that was written; None where there is none.
        parameters: print the parameters and the gates too.
    """
    result = fitted.result
    answer = answer_of(result, model, truth)
    console.print()
    write(console, answer.sentence, style=f"bold {_COLOURS[answer.kind]}")
    headings, rows = per_joint(result, fitted.base.model.robot)
    columns = [
        Column(name, right=number > 0, spare=max(0, number - 2)) for number, name in enumerate(headings)
    ]
    write_table(console, "", columns, rows)
    if result.worst is not None:
        names = [joint.name for joint in fitted.base.model.robot.joint]
        write(console, f"- {worst_words(result.worst, names)}", indent="  ")
    for sentence in answer.odd:
        write(console, f"- {sentence}", indent="  ")
    if result.found:
        write(console, f"- Found effects in the model: {found_words(result.found)}.", indent="  ")
    if result.essential is not None:
        write(console, f"- {_essential(result.essential)}", indent="  ")
    if result.consistency is not None:
        write(console, f"- Arm that can exist: {result.consistency.sentence}.", indent="  ")
    if result.signals is not None:
        write(console, f"- {_signals(result.signals, result.rank)}", indent="  ")
    if parameters:
        print_all(console, result, truth)
    else:
        write(
            console, f"- --parameters shows all {len(result.recommended.parameters)} parameters.", style="dim"
        )


def print_all(console: Console, result: Identification, truth: Mapping[str, float] | None = None) -> None:
    """Parameters, links, predictions and gates."""
    console.print()
    _write_parameters(console, result.recommended, truth)
    if result.consistency is not None:
        _write_links(console, result.consistency)
    if result.held_out:
        _write_held_out(console, result.held_out)
    _write_gates(console, result)


def _write_parameters(console: Console, estimate: Estimate, truth: Mapping[str, float] | None) -> None:
    columns = [Column("parameter", right=False), Column("unit", right=False)]
    columns += [Column("value"), Column("σ"), Column("% σ", spare=1), Column("± 95 %")]
    if truth is not None:
        columns += [Column("truth", spare=2), Column("off by")]
    rows = []
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
        rows.append(cells)
    write_table(console, f"Base parameters by {words_of(estimate.method)}", columns, rows)


def _write_gates(console: Console, result: Identification) -> None:
    words = {
        ("instruments", True): "valid",
        ("instruments", False): "not valid",
        ("rank", True): "nothing to test",
        ("rank", False): "columns to test",
        ("exogeneity", True): "exogenous",
        ("exogeneity", False): "endogenous",
    }
    write(console, "Revised Durbin-Wu-Hausman test", style="italic")
    for gate in result.test.gates:
        word = "not reached" if gate.passed is None else words[gate.name, gate.passed]
        figures = [] if gate.statistic is None else [significant(gate.statistic)]
        figures += [] if gate.p_value is None else [probability(gate.p_value)]
        shown = f" ({', '.join(figures)})" if figures else ""
        detail = f": {gate.detail}" if gate.detail else ""
        write(console, f"  {gate.name}: {word}{shown}{detail}", indent="    ")


def _write_held_out(console: Console, held_out: tuple[HeldOut, ...]) -> None:
    columns = [Column("recording", right=False, wraps=True), Column("estimate", right=False)]
    columns += [Column("error"), Column("rms per joint", wraps=True)]
    rows = [
        [
            entry.recording,
            words_of(entry.method),
            percent(entry.relative_error_percent),
            "  ".join(significant(float(rms)) for rms in entry.torque_rms),
        ]
        for entry in held_out
    ]
    write_table(console, "Prediction of recordings that were not fitted to", columns, rows)


def _write_links(console: Console, consistency: Consistency) -> None:
    columns = [Column("link", right=False), Column("mass, kg"), Column("centre of mass, m")]
    columns += [Column("margin"), Column("", right=False, wraps=True)]
    rows = []
    for link in consistency.links:
        words = ["at the limit of what a body can be"] if link.at_limit else []
        words += ["no body before"] if link.impossible_before else []
        center = "  ".join(significant(float(x)) for x in link.center)
        rows.append(
            [link.name, significant(link.mass), center, significant(link.margin, 2), "; ".join(words)]
        )
    write_table(console, "Links of the nearest arm that can exist", columns, rows)


def _essential(essential: Essential) -> str:
    """What the F-tests let go, and where they stopped."""
    count = len(essential.parameters)
    if not essential.dropped:
        return f"Essential parameters: all {count} are needed."
    names = listed([dropped.name for dropped in essential.dropped])
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


def print_guessed(console: Console, words: Sequence[str]) -> None:
    """One line each; nothing where nothing was guessed."""
    if words:
        console.print("Guessed from the log and its URDF:", highlight=False)
    for sentence in words:
        write(console, f"  {sentence}", indent="    ")
