"""The picture of the simulated year: each change in its own parameter, with the nights before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.drift import Geometry, Night, patterns_of
from robots.arrays import FloatArray

_WIDTH, _HEIGHT, _LEFT, _GAP = 760, 150, 70, 50


@dataclass(frozen=True)
class Panel:
    """One change: the amount of its effect night by night, beside the baseline."""

    title: str
    day: FloatArray
    amount: FloatArray
    corrected: FloatArray
    """The same less what the temperature explains of the nights before the change."""
    start: float
    alarm: float | None
    unit: str

    @classmethod
    def of(
        cls,
        title: str,
        effect: str,
        joint: int | None,
        nights: Sequence[Night],
        start: int,
        delay: int | None,
        geometry: Geometry,
    ) -> Panel:
        """Amounts by least squares weighted with the covariance within the run."""
        pattern = next(p for p in patterns_of(geometry) if (p.effect, p.joint) == (effect, joint))
        direction = pattern.directions
        weighted = np.linalg.solve(nights[0].covariance, direction)
        reader = np.linalg.solve(direction.T @ weighted, weighted.T)[0]
        values = np.array([night.values for night in nights])
        amount = (values - values[0]) @ reader
        unit = pattern.units[0]
        if pattern.scale is not None:
            amount, unit = 100 * amount / pattern.scale, "%"
        elif effect == "drive_gain_error":
            amount, unit = -100 * amount / (1 + amount), "%"
        warm = np.array([night.celsius.mean() for night in nights if night.celsius is not None])
        design = np.column_stack([np.ones(len(warm)), warm])
        slopes = np.linalg.lstsq(design[:start], amount[:start], rcond=None)[0]
        day = np.array([night.day for night in nights])
        alarm = None if delay is None else float(day[start + delay - 1])
        return cls(title, day, amount, amount - design @ slopes, float(day[start]), alarm, unit)


def write_picture(path: Path, panels: Sequence[Panel]) -> None:
    """One SVG with a panel per change, readable on a light and on a dark page."""
    height = len(panels) * (_HEIGHT + _GAP) + 30
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" role="img" '
        'font-family="sans-serif" font-size="12"><title>A simulated year: changes and their alarms</title>'
        "<style>:root{color-scheme:light dark}text{fill:#333}.a{stroke:#888}.raw{fill:none;stroke:#999}"
        ".cor{fill:#0072b2}.start{stroke:#d55e00;stroke-dasharray:4 3}.alarm{stroke:#d55e00;stroke-width:2}"
        "@media(prefers-color-scheme:dark){text{fill:#ddd}.cor{fill:#56b4e9}.raw{stroke:#777}}</style>"
    ]
    for index, panel in enumerate(panels):
        parts.append(_panel(panel, 20 + index * (_HEIGHT + _GAP)))
    foot = "○ as identified   ● less what the temperature explains   ┆ change begins   │ alarm"
    parts.append(f'<text x="{_LEFT}" y="{height - 8}">{foot}</text></svg>\n')
    path.write_text("".join(parts), encoding="utf-8")


def _panel(panel: Panel, top: float) -> str:
    low, high = (
        float(min(panel.amount.min(), panel.corrected.min())),
        float(max(panel.amount.max(), panel.corrected.max())),
    )
    first, last = float(panel.day[0]), float(panel.day[-1])

    def x(day: float) -> float:
        return _LEFT + (day - first) / (last - first) * (_WIDTH - _LEFT - 15)

    def y(value: float) -> float:
        return top + 18 + (high - value) / (high - low) * (_HEIGHT - 18)

    lines = [f'<text x="{_LEFT}" y="{top + 8:.1f}" font-weight="bold">{panel.title}</text>']
    lines += [
        f'<text x="{_LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.3g} {panel.unit}</text>'
        for value in (low, high)
    ]
    lines.append(f'<line class="a" x1="{_LEFT}" x2="{_WIDTH - 15}" y1="{y(low):.1f}" y2="{y(low):.1f}"/>')
    for kind, day in (("start", panel.start), ("alarm", panel.alarm)):
        if day is not None:
            ends = f'x1="{x(day):.1f}" x2="{x(day):.1f}" y1="{top + 18}" y2="{top + _HEIGHT}"'
            lines.append(f'<line class="{kind}" {ends}/>')
            if kind == "alarm":
                said = f"alarm in night {day - panel.start + 1:.0f}"
                lines.append(f'<text x="{x(day) - 4:.1f}" y="{top + 14}" text-anchor="end">{said}</text>')
    for day, raw, corrected in zip(panel.day, panel.amount, panel.corrected, strict=True):
        lines.append(f'<circle class="raw" cx="{x(day):.1f}" cy="{y(raw):.1f}" r="2"/>')
        lines.append(f'<circle class="cor" cx="{x(day):.1f}" cy="{y(corrected):.1f}" r="2.2"/>')
    lines.append(f'<text x="{_LEFT}" y="{top + _HEIGHT + 14}">night {first:.0f}</text>')
    lines.append(f'<text x="{_WIDTH - 15}" y="{top + _HEIGHT + 14}" text-anchor="end">{last:.0f}</text>')
    return "".join(lines)
