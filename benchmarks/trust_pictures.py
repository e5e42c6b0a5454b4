"""The pictures of docs/explanation/trust.md, drawn from the results of benchmarks/trust.py.

Plain SVG without scripts or fonts of its own: it can stand in a page or be linked as an image, follows the
reader's light or dark setting, and says by shape and words what it says by colour (Okabe and Ito's palette).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "images"
TITLES = {"one_axis": "one axis", "tx40": "six axes"}

_STYLE = """
.trust text{font:13px system-ui,sans-serif;fill:#222}
.trust .small{font-size:12px}.trust .head{font-weight:600}.trust .name{fill:var(--c)}
.trust .grid{stroke:#ccc;stroke-width:1}
.trust .c0{--c:#0072b2}.trust .c1{--c:#b35900}.trust .c2{--c:#007a5a}.trust .c3{--c:#a5427f}
.trust .line{fill:none;stroke:var(--c);stroke-width:2}.trust .thin{stroke-width:1}
.trust .dash{stroke-dasharray:6 4}
.trust .dot{fill:var(--c);stroke:var(--c)}.trust .ring{fill:none;stroke:var(--c);stroke-width:2}
@media(prefers-color-scheme:dark){
.trust text{fill:#e6e6e6}.trust .name{fill:var(--c)}.trust .grid{stroke:#444}
.trust .c0{--c:#56b4e9}.trust .c1{--c:#e69f00}.trust .c2{--c:#2fbf94}.trust .c3{--c:#e08bc0}}
"""


@dataclass(frozen=True)
class Axis:
    """A scale from values to pixels, with its labelled values."""

    low: float
    high: float
    start: float
    end: float
    ticks: tuple[tuple[float, str], ...]
    logarithmic: bool = False

    def __call__(self, value: float) -> float:
        held = min(max(value, self.low), self.high)
        turn: Callable[[float], float] = math.log10 if self.logarithmic else float
        share = (turn(held) - turn(self.low)) / (turn(self.high) - turn(self.low))
        return self.start + share * (self.end - self.start)


def draw(results: dict[str, Any]) -> None:
    """Write the pictures of all the results that there are."""
    FOLDER.mkdir(exist_ok=True)
    for arm in TITLES:
        cells = [cell for cell in results.get("power", []) if cell["arm"] == arm]
        if cells:
            (FOLDER / f"trust-power-{arm}.svg").write_text(power_picture(arm, cells), encoding="utf-8")
    if results.get("gate1"):
        (FOLDER / "trust-gate1.svg").write_text(gate1_picture(results["gate1"]), encoding="utf-8")


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share."""
    share, z = hits / trials, 1.96
    centre = (share + z**2 / (2 * trials)) / (1 + z**2 / trials)
    half = z / (1 + z**2 / trials) * math.sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2))
    return max(0.0, centre - half), min(1.0, centre + half)


def power_picture(arm: str, cells: list[dict[str, Any]]) -> str:
    """Left: how often the verdict is endogenous. Right: the bias of both estimates."""
    factors = sorted({cell["noise"] for cell in cells})
    cutoffs = sorted({cell["cutoff"] for cell in cells})
    replicates = cells[0]["replicates"]
    across = tuple((factor, f"{factor:g}×") for factor in factors)
    share = Axis(0.0, 1.0, 300, 70, tuple((k / 4, f"{25 * k} %") for k in range(5)))
    sigma = Axis(0.1, 300.0, 300, 70, tuple((v, f"{v:g} σ") for v in (0.1, 1.0, 10.0, 100.0)), True)
    left = Axis(factors[0], factors[-1], 70, 350, across, True)
    right = Axis(factors[0], factors[-1], 500, 780, across, True)
    body = [
        written(70, 24, f"Verdict “endogenous”, {TITLES[arm]}", "head"),
        written(70, 44, f"share of {replicates} runs, 95 % interval", "small"),
        written(500, 24, "Bias of the worst parameter", "head"),
        written(500, 44, "full: least squares; dashed: instrumental variables", "small"),
        *frame(left, share, "encoder noise, times the arm's own"),
        *frame(right, sigma, "encoder noise, times the arm's own"),
    ]
    marks: list[tuple[float, str]] = []
    for place, cutoff in enumerate(cutoffs):
        row = sorted((cell for cell in cells if cell["cutoff"] == cutoff), key=lambda cell: cell["noise"])
        shade = f"c{place % 4}"
        hits = [cell["verdicts"].get("endogenous", 0) for cell in row]
        body += [
            _bar(left(cell["noise"]) + 3 * place - 4, share, wilson(n, cell["replicates"]), shade)
            for cell, n in zip(row, hits, strict=True)
        ]
        rates = [n / cell["replicates"] for cell, n in zip(row, hits, strict=True)]
        points = [(left(c["noise"]) + 3 * place - 4, share(r)) for c, r in zip(row, rates, strict=True)]
        body += _curve(points, shade, place, dashed=False)
        for kind, dashed in (("ls_worst", False), ("iv_worst", True)):
            points = [(right(cell["noise"]), sigma(cell[kind])) for cell in row]
            body += _curve(points, shade, place, dashed)
            if not dashed:
                marks.append((points[-1][1], f"{shade}|{cutoff:g} Hz"))
    body += _side_labels(790, marks)
    body.append(written(790, 62, "cut-off", "small"))
    return drawing(870, 352, f"Power and bias against encoder noise and filter cut-off, {TITLES[arm]}", body)


def gate1_picture(rows: list[dict[str, Any]]) -> str:
    """One line for each scenario: how often the gate closed on either arm."""
    per_arm = [[row["scenario"] for row in rows if row["arm"] == arm] for arm in TITLES]
    names = max(per_arm, key=len)
    arms = [arm for arm in TITLES if any(row["arm"] == arm for row in rows)]
    height = 96 + 34 * len(names)
    share = Axis(0.0, 1.0, 230, 600, tuple((k / 4, f"{25 * k} %") for k in range(5)))
    body = [written(20, 24, "Gate 1 closes: the simulation is not the robot", "head")]
    body += [
        straight("grid", share(v), 58, share(v), height - 32)
        + written(share(v), height - 12, label, "small", "middle")
        for v, label in share.ticks
    ]
    for place, arm in enumerate(arms):
        count = next(row["replicates"] for row in rows if row["arm"] == arm)
        x = 230 + 190 * place
        body += [
            mark(x, 44, f"c{place}", place),
            written(x + 12, 48, f"{TITLES[arm]}, {count} runs", "small"),
        ]
    for line, name in enumerate(names):
        y = 76 + 34 * line
        body.append(written(220, y + 4, name, "", "end"))
        for place, arm in enumerate(arms):
            row = next((r for r in rows if r["arm"] == arm and r["scenario"] == name), None)
            if row is None:
                continue
            at = y - 6 + 12 * place
            low, high = wilson(row["closed"], row["replicates"])
            body.append(straight(f"line c{place}", share(low), at, share(high), at))
            body.append(mark(share(row["closed"] / row["replicates"]), at, f"c{place}", place))
    return drawing(640, height, "How often gate 1 closes, by what is wrong in the simulation", body)


def drawing(width: int, height: int, title: str, body: Sequence[str]) -> str:
    inside = "\n".join(body)
    size = f'viewBox="0 0 {width} {height}" width="{width}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} class="trust" role="img">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n{inside}\n</svg>\n"
    )


def written(x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> str:
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(words)}</text>'


def straight(kind: str, x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line class="{kind}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def frame(across: Axis, up: Axis, label: str) -> list[str]:
    lines = [
        straight("grid", across.start - 10, up(v), across.end + 10, up(v))
        + written(across.start - 16, up(v) + 4, words, "small", "end")
        for v, words in up.ticks
    ]
    lines += [written(across(v), up.start + 20, words, "small", "middle") for v, words in across.ticks]
    lines.append(written((across.start + across.end) / 2, up.start + 42, label, "small", "middle"))
    return lines


def _bar(x: float, axis: Axis, interval: tuple[float, float], shade: str) -> str:
    low, high = (axis(value) for value in interval)
    return straight(f"line thin {shade}", x, low, x, high)


def _curve(points: Sequence[tuple[float, float]], shade: str, place: int, dashed: bool) -> list[str]:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    kind = f"line dash {shade}" if dashed else f"line {shade}"
    return [f'<polyline class="{kind}" points="{path}"/>', *(mark(x, y, shade, place) for x, y in points)]


def mark(x: float, y: float, shade: str, place: int) -> str:
    """Circle, square, triangle or ring, by place."""
    if place % 4 == 0:
        return f'<circle class="dot {shade}" cx="{x:.1f}" cy="{y:.1f}" r="4"/>'
    if place % 4 == 1:
        return f'<rect class="dot {shade}" x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8"/>'
    if place % 4 == 2:
        corners = f"{x:.1f},{y - 5:.1f} {x + 5:.1f},{y + 4:.1f} {x - 5:.1f},{y + 4:.1f}"
        return f'<polygon class="dot {shade}" points="{corners}"/>'
    return f'<circle class="ring {shade}" cx="{x:.1f}" cy="{y:.1f}" r="4"/>'


def _side_labels(x: float, marks: list[tuple[float, str]]) -> list[str]:
    """Names beside the ends of the curves, pushed apart where these meet."""
    labels, last = [], -math.inf
    for y, words in sorted(marks):
        shade, name = words.split("|")
        last = max(y + 4, last + 16)
        labels.append(written(x, last, name, f"name {shade}"))
    return labels
