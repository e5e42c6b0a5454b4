"""Pictures without a drawing library: traces over time, one panel per joint, as SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from daq.files.run_folder import OutputError
from daq.report.pictures import PLOT_HEIGHT, PLOT_WIDTH, trace_path
from daq.text.numbers import significant
from robots.arrays import FloatArray

_COLOURS = ("#1f6feb", "#d1242f", "#1a7f37", "#8250df")
_PANEL, _LEFT, _WIDTH, _HEAD = 110, 90, 800, 40


@dataclass(frozen=True)
class Picture:
    """An SVG that a notebook shows."""

    svg: str

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | Path) -> Path:
        """Write it to a file.

        Raises:
            OutputError: it cannot be written.
        """
        path = Path(path)
        try:
            path.write_text(self.svg, encoding="utf-8")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror}") from error
        return path


def traces(
    title: str,
    names: Sequence[str],
    units: Sequence[str],
    time: FloatArray,
    lines: Mapping[str, FloatArray],
    horizontal: str = "s",
) -> Picture:
    """Lines over time, one panel per joint.

    Args:
        title: above them.
        names, units: of the joints.
        time: (samples,).
        lines: label → samples × joints; NaN where there is nothing.
        horizontal: unit of ``time``.
    """
    height = _HEAD + _PANEL * len(names) + 30
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" font-family="sans-serif"'
        f' font-size="12"><rect width="100%" height="100%" fill="white"/>'
        f'<text x="{_LEFT}" y="16" font-weight="bold">{escape(title)}</text>'
    ]
    for number, label in enumerate(lines):
        colour = _COLOURS[number % len(_COLOURS)]
        parts.append(f'<text x="{_LEFT + 160 * number}" y="32" fill="{colour}">{escape(label)}</text>')
    for joint, name in enumerate(names):
        values = [line[:, joint] for line in lines.values()]
        parts.append(_panel(_HEAD + _PANEL * joint, f"{name}, {units[joint]}", time, values))
    ends = (significant(float(time[0]), 4), f"{significant(float(time[-1]), 4)} {horizontal}")
    for at, anchor, text in ((_LEFT, "start", ends[0]), (_WIDTH - 10, "end", ends[1])):
        parts.append(f'<text x="{at}" y="{height - 10}" text-anchor="{anchor}">{escape(text)}</text>')
    return Picture("".join([*parts, "</svg>"]))


def _panel(top: int, name: str, time: FloatArray, values: Sequence[FloatArray]) -> str:
    finite = np.concatenate([line[np.isfinite(line)] for line in values])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    if low == high:
        low, high = low - 1.0, high + 1.0
    window = (float(time[0]), float(time[-1]), low, high)
    width, height = _WIDTH - _LEFT - 10, _PANEL - 20
    scale = f"translate({_LEFT} {top + 14}) scale({width / PLOT_WIDTH:.4f} {height / PLOT_HEIGHT:.4f})"
    drawn = "".join(
        f'<path d="{trace_path(time, line, window, width)}" fill="none" stroke="{colour}"'
        ' vector-effect="non-scaling-stroke"/>'
        for line, colour in zip(values, _COLOURS, strict=False)
    )
    return (
        f'<text x="{_LEFT}" y="{top + 10}">{escape(name)}</text>'
        f'<text x="{_LEFT - 4}" y="{top + 24}" text-anchor="end">{escape(significant(high))}</text>'
        f'<text x="{_LEFT - 4}" y="{top + 14 + height}" text-anchor="end">{escape(significant(low))}</text>'
        f'<rect x="{_LEFT}" y="{top + 14}" width="{width}" height="{height}" fill="none" stroke="#ccc"/>'
        f'<g transform="{scale}">{drawn}</g>'
    )
