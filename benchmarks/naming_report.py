"""The naming campaign's results as Markdown and as a picture."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.naming_parameters import coverage
from benchmarks.naming_scores import (
    CLOSED,
    all_found,
    both_in_set,
    called,
    closed,
    closed_together,
    gap_in_floors,
    in_set,
    largest_in_floors,
    left,
    named_right,
    named_wrong,
    of_several,
    right_first,
    spurious,
)
from ident.effects.vocabulary import VOCABULARY

NAMES = tuple(family.name for family in VOCABULARY)

_SHOWS = 2.0
"""Floors of gap on validation, at least: another motion may hardly show an effect, which makes no figure."""


def lines_of(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def share(hits: Iterable[bool]) -> str:
    """A share with its 95 % interval (Wilson)."""
    flags = list(hits)
    n = len(flags)
    if not n:
        return "–"
    p, z = sum(flags) / n, 1.959963984540054
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    told = f"{100 * p:.1f}" if 0 < p < 0.01 else f"{100 * p:.0f}"  # one of 300 is not none
    return f"{told} % [{100 * max(middle - half, 0):.0f}, {100 * min(middle + half, 1):.0f}] of {n}"


def report(path: Path) -> str:
    """The campaign as Markdown: figures with intervals, per effect, and what was taken for what."""
    lines = [line for line in lines_of(path) if "skipped" not in line]
    single = [line for line in lines if line["kind"] == "single"]
    clean = [line for line in lines if line["kind"] == "clean"]
    outside = [line for line in lines if line["kind"] == "outside"]
    pairs = [line for line in lines if line["kind"] == "pair"]
    one_joint = [line for line in lines if line["kind"] == "one joint"]
    triples = [line for line in lines if line["kind"] == "triple"]
    sizes: list[float] = [1 + len(line["findings"][0]["set"]) for line in single if line["findings"]]
    confident = [bool(line["findings"]) and not in_set(line) for line in single]
    named = [line for line in single if right_first(line)]
    levels = [line for line in named if "level" in line]
    shown = [line for line in named if largest_in_floors(line) >= _SHOWS]
    text: list[str] = [
        "| figure | value |",
        "|---|---|",
        f"| right name and joint first | {share(map(right_first, single))} |",
        f"| right name and joint named (confirmed, alone) | {share(map(named_right, single))} |",
        f"| something else named, any kind of run | {share(map(named_wrong, lines))} |",
        f"| truth in the reported set | {share(map(in_set, single))} |",
        f"| mean size of the set | {np.mean(sizes or [np.nan]):.2f} |",
        f"| a wrong name, the truth not in the set | {share(confident)} |",
        f"| gap on validation ≤ 20 % of what it was, where named right | {share(map(closed, named))} |",
        f"| gap ≤ 20 %, the arm's joints taken together | {share(map(closed_together, levels))} |",
        f"| share of the gap that is left, median | {_median_left(named)} |",
        f"| gap ≤ 20 %, where validation shows at least two floors of it | {share(map(closed, shown))} |",
        *_beside_clean(named, clean),
        *_of_several("two hidden", pairs),
        f"| two hidden: both named or in the reported set | {share(map(both_in_set, pairs))} |",
        *_of_several("two hidden at one joint", one_joint),
        *_of_several("three hidden at three joints", triples),
        f"| one hidden: more than one finding | {share(len(line['findings']) > 1 for line in single)} |",
        f"| clean arms with a finding | {share(bool(line['findings']) for line in clean)} |",
        f"| clean arms not called clean | {share(line['verdict'] != 'clean' for line in clean)} |",
        f"| outside the vocabulary: noticed | {share(line['verdict'] != 'clean' for line in outside)} |",
        f"| outside the vocabulary: no name | {share(not line['findings'] for line in outside)} |",
        "",
        "| effect | right first | in the set | called otherwise |",
        "|---|---|---|---|",
    ]
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for line in single:
        groups[line["effect"]].append(line)
    for effect, rows in sorted(groups.items()):
        others = Counter(called(line) for line in rows if not right_first(line))
        words = ", ".join(f"{name} ×{count}" for name, count in others.most_common())
        text.append(f"| {effect} | {share(map(right_first, rows))} | {share(map(in_set, rows))} | {words} |")
    return "\n".join([*text, "", *_covered(lines)]) + "\n"


def _of_several(title: str, lines: Sequence[dict[str, Any]]) -> list[str]:
    if not lines:
        return []
    return [
        f"| {title}: all named first | {share(map(all_found, lines))} |",
        f"| {title}: at least one | {share(bool(of_several(line)) for line in lines)} |",
        f"| {title}: a finding that is none of them | {share(map(spurious, lines))} |",
    ]


def _covered(lines: Sequence[dict[str, Any]]) -> list[str]:
    """How often the truth is within three standard deviations, over all parameters and for each."""
    within = coverage(lines)
    everything = [hit for hits in within.values() for hit in hits]
    text = ["| parameter | truth within 3 σ |", "|---|---|", f"| all | {share(everything)} |"]
    return [*text, *(f"| {name} | {share(hits)} |" for name, hits in sorted(within.items()))]


def picture(path: Path, file: Path) -> None:
    """Hidden effect against what it was called, single scenarios."""
    single = [line for line in lines_of(path) if line["kind"] == "single" and "skipped" not in line]
    columns = [*NAMES, "unnamed", "clean"]
    counts = np.zeros((len(NAMES), len(columns)))
    for line in single:
        called = line["findings"][0]["effect"] if line["findings"] else line["verdict"]
        counts[NAMES.index(line["effect"]), columns.index(called)] += 1
    cell, left, top = 20, 210, 210
    width, height = left + cell * len(columns) + 10, top + cell * len(NAMES) + 10
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif"'
        f' font-size="12"><rect width="{width}" height="{height}" fill="white"/>'
    ]
    for column, name in enumerate(columns):
        x = left + cell * column + 14
        text.append(f'<text transform="translate({x} {top - 6}) rotate(-90)">{name}</text>')
    for row, name in enumerate(NAMES):
        y = top + cell * row
        text.append(f'<text x="{left - 6}" y="{y + 14}" text-anchor="end">{name}</text>')
        for column in range(len(columns)):
            count, x = int(counts[row, column]), left + cell * column
            shade = "#f3f3f3" if not count else "#7fb3e0" if row == column else "#f2b48a"
            text.append(f'<rect x="{x}" y="{y}" width="{cell - 1}" height="{cell - 1}" fill="{shade}"/>')
            if count:
                text.append(f'<text x="{x + 9}" y="{y + 14}" text-anchor="middle">{count}</text>')
    file.write_text("\n".join([*text, "</svg>"]) + "\n", encoding="utf-8")


def _beside_clean(named: Sequence[dict[str, Any]], clean: Sequence[dict[str, Any]]) -> list[str]:
    """What of the gap an arm with nothing hidden has, too: of a small gap that alone is more than a fifth."""
    if not clean:
        return []
    nothing = float(np.median([gap_in_floors(line) for line in clean]))
    large = [line for line in named if gap_in_floors(line) * CLOSED >= nothing]
    return [
        f"| gap of clean arms in floors, all joints, median | {nothing:.2f} |",
        f"| gap ≤ 20 %, where a fifth of it is no less than that | {share(map(closed, large))} |",
    ]


def _median_left(lines: Sequence[dict[str, Any]]) -> str:
    return f"{100 * float(np.median([left(line) for line in lines])):.0f} %" if lines else "–"
