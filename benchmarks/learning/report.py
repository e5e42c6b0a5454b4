"""The table and the figure of learners beside the search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.evidence.case import UNKNOWN
from benchmarks.evidence.scores import first_is_right, wrong
from benchmarks.learning import published
from benchmarks.learning.scoring import calibration_error
from benchmarks.naming_report import share

Line = dict[str, Any]
SEARCHES = ("evidence", "boosting", "network")
WORDS = {
    "evidence": "search by evidence",
    "boosting": "gradient boosting",
    "network": "convolutional network",
}
WORLDS = {
    "own": "own bench, unseen seeds",
    "looked": "own bench, seeds looked at (development of the search)",
    "shared": "foreign logs 01–11 (development of the search)",
    "foreign": "foreign plants, drawn (sealed for the search)",
}
_COLOURS = {"evidence": "#0072b2", "boosting": "#e69f00", "network": "#cc79a7"}


def hidden_right(line: Line) -> bool:
    """Whether the first name is hidden, at its place."""
    return first_is_right(line, line["answer"])


def joint_right(line: Line) -> bool:
    """Whether the first name is at a joint where something is hidden, whatever it is called."""
    first = line["answer"]["names"][:1]
    return any(
        set(one[1]) & set(first[0]["joints"]) or one[1] == first[0]["joints"]
        for one in line["truth"]
        if first
    )


def named_wrong(line: Line) -> bool:
    """Whether a name that says 0.9 and more (the search's: that is named) is not hidden."""
    return wrong(line, line["answer"])


def called_clean(line: Line) -> bool:
    return bool(line["answer"]["verdict"] == "clean")


def something_named(line: Line) -> bool:
    return any(one["named"] for one in line["answer"]["names"])


def kind_of(line: Line) -> str:
    """Clean, outside, or inside the vocabulary."""
    if not line["truth"]:
        return "clean"
    return "outside" if any(name == UNKNOWN for name, _ in line["truth"]) else "inside"


FIGURES: tuple[tuple[str, str, Callable[[Line], bool]], ...] = (
    ("right name and joint first", "inside", hidden_right),
    ("right joint first, whatever the name", "inside", joint_right),
    ("a name with 0.9 that is not there", "all", named_wrong),
    ("changed arm called clean", "inside", called_clean),
    ("clean arm called clean", "clean", called_clean),
    ("clean arm with a name of 0.9", "clean", something_named),
    ("outside the vocabulary: noticed", "outside", lambda line: not called_clean(line)),
    ("outside the vocabulary: no name with 0.9", "outside", lambda line: not something_named(line)),
)


def report(lines: Sequence[Line]) -> str:
    """Tables per world, with Wilson's 95 % intervals; the search where it was asked, the same logs beside."""
    text = []
    for world, title in WORLDS.items():
        of_world = [line for line in lines if line["kind"] == world]
        if not of_world:
            continue
        text += [f"**{title}**", "", "| figure | " + " | ".join(WORDS.values()) + " |", "|---|---|---|---|"]
        text += [f"| {figure[0]} | " + " | ".join(_cells(of_world, *figure[1:])) + " |" for figure in FIGURES]
        text += [f"| calibration error of the first name | {' | '.join(_calibration(of_world))} |", ""]
        text += _paired(of_world)
    return "\n".join(text)


def _cells(lines: Sequence[Line], kind: str, test: Callable[[Line], bool]) -> list[str]:
    cells = []
    for search in SEARCHES:
        own = [line for line in lines if line["search"] == search and kind in ("all", kind_of(line))]
        if test is joint_right:  # of wrong names the pages do not always tell the joint
            own = [line for line in own if "published" not in line]
        cells.append(share(map(test, own)))
    return cells


def _calibration(lines: Sequence[Line]) -> list[str]:
    """Of the probability that the answer gives its first name, against whether that is right."""
    cells = []
    for search in SEARCHES:
        names = [
            (line["answer"]["names"][0]["probability"], hidden_right(line))
            for line in lines
            if line["search"] == search
            and line["answer"]["names"]
            and line["answer"]["names"][0]["probability"] is not None
        ]
        if not names:
            cells.append("–")
            continue
        said, right = np.array(names, dtype=float).T
        cells.append(f"{calibration_error(said, right):.2f} of {len(names)}")
    return cells


def _paired(lines: Sequence[Line]) -> list[str]:
    """On the logs that the search was asked about, too: who has the right name first."""
    of_log: dict[str, dict[str, bool]] = {}
    for line in lines:
        if kind_of(line) == "inside":
            of_log.setdefault(line["name"], {})[line["search"]] = hidden_right(line)
    both = [one for one in of_log.values() if all(search in one for search in SEARCHES)]
    if not both:
        return []
    told = []
    for learner in SEARCHES[1:]:
        better = sum(one["evidence"] and not one[learner] for one in both)
        worse = sum(one[learner] and not one["evidence"] for one in both)
        told.append(
            f"{WORDS[learner]} {sum(one[learner] for one in both)} "
            f"(search alone {better}, it alone {worse}, p = {sign_test(better, worse):.2g})"
        )
    first = sum(one["evidence"] for one in both)
    return [f"Right first on the same {len(both)} logs: search {first}; {'; '.join(told)}.", ""]


def sign_test(better: int, worse: int) -> float:
    """Two-sided p of the logs that one alone has right against those of the other, if both are level."""
    return float(binomtest(better, better + worse).pvalue) if better + worse else 1.0


def with_published(lines: Sequence[Line]) -> list[Line]:
    """The lines with the search's published answers to the learners' logs, where it was not asked again."""
    asked = {(line["kind"], line["name"]) for line in lines if line["search"] == "evidence"}
    logs = {(line["kind"], line["name"]): line["truth"] for line in lines}
    more = [published.answered(*log, truth) for log, truth in logs.items() if log not in asked]
    return [*lines, *(line for line in more if line is not None)]


def shares_of(lines: Sequence[Line]) -> dict[str, dict[str, tuple[int, int]]]:
    """World: search: how often the right name is first, of how many."""
    found: dict[str, dict[str, tuple[int, int]]] = {}
    for world in WORLDS:
        for search in SEARCHES:
            flags = [
                hidden_right(line)
                for line in lines
                if line["kind"] == world and line["search"] == search and kind_of(line) == "inside"
            ]
            if flags:
                found.setdefault(world, {})[search] = (sum(flags), len(flags))
    return found


def picture(lines: Sequence[Line], path: Path) -> None:
    """Right name first, per world and search, with 95 % intervals; readable on a light and on a dark page."""
    shares, width, left, row = shares_of(lines), 720, 190, 26
    height = 40 + len(shares) * (len(SEARCHES) * row + 26) + 30
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        'font-family="sans-serif" font-size="12"><title>Right name and joint first</title>'
        "<style>:root{color-scheme:light dark}text{fill:#333}.a{stroke:#333;stroke-width:1.5;fill:none}"
        "@media(prefers-color-scheme:dark){text{fill:#ddd}.a{stroke:#ddd}}</style>"
        f'<text x="{left}" y="16" font-weight="bold">Right name and joint first, 95 % intervals</text>'
    ]

    def x(value: float) -> float:
        return left + value * (width - left - 90)

    y = 34.0
    for world, of_search in shares.items():
        parts.append(f'<text x="8" y="{y + 12:.0f}" font-weight="bold">{WORLDS[world]}</text>')
        y += 18
        for search, (hits, count) in of_search.items():
            low, high = interval(hits, count)
            middle = y + row / 2
            parts.append(
                f'<text x="{left - 8}" y="{middle + 4:.0f}" text-anchor="end">{WORDS[search]}</text>'
            )
            parts.append(
                f'<rect x="{x(0):.1f}" y="{y + 5:.1f}" width="{x(hits / count) - x(0):.1f}" '
                f'height="{row - 10}" '
                f'fill="{_COLOURS[search]}"/>'
                f'<path class="a" d="M{x(low):.1f} {middle - 4:.1f}v8m0 -4H{x(high):.1f}m0 -4v8"/>'
            )
            parts.append(f'<text x="{x(1) + 8:.0f}" y="{middle + 4:.0f}">{hits} of {count}</text>')
            y += row
        y += 8
    parts += [
        f'<text x="{x(value):.1f}" y="{y + 14:.0f}" text-anchor="middle">{100 * value:.0f} %</text>'
        for value in (0.0, 0.5, 1.0)
    ]
    path.write_text("".join([*parts, "</svg>\n"]), encoding="utf-8")


def interval(hits: int, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share."""
    p, z = hits / count, 1.959963984540054
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / (1 + z * z / count)
    return max(middle - half, 0.0), min(middle + half, 1.0)
