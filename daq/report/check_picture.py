"""The course of a chart over the nights of an arm, with the band in which tonight would have been fine."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from markupsafe import Markup, escape

from daq.report.pictures import nice_ticks, scaled, tick_text

_SIZES = {"wide": (700, 230), "narrow": (340, 220)}
"""On a desk and on a phone, where letters must not shrink with the picture."""
_Scale = Callable[[float], float]
"""From a value to its place."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 14, 12, 34


def course_picture(
    words: str,
    unit: str,
    day: Sequence[float],
    amount: Sequence[float],
    clean: Sequence[bool],
    band: tuple[float, float],
) -> Markup:
    """Inline SVG, once for a wide and once for a narrow window; the style sheet shows one of them.

    Args:
        words: what the amount is of.
        unit: of the amounts.
        day: (N,) since the baseline, which is the first.
        amount: (N,) beside the baseline.
        clean: (N,) nights on which nothing was found; the last is tonight, with a larger mark.
        band: between which tonight would have been fine.
    """
    return Markup("").join(_one(kind, words, unit, day, amount, clean, band) for kind in _SIZES)


def _one(
    kind: str,
    words: str,
    unit: str,
    day: Sequence[float],
    amount: Sequence[float],
    clean: Sequence[bool],
    band: tuple[float, float],
) -> Markup:
    width, height = _SIZES[kind]
    low, high = min(*amount, band[0], 0.0), max(*amount, band[1], 0.0)
    margin = 0.08 * (high - low) or 1.0
    low, high = low - margin, high + margin
    last = max(float(day[-1]), 1e-9)

    def x(at: float) -> float:
        return _LEFT + 8 + (width - _LEFT - _RIGHT - 16) * scaled(at, (0.0, last)) / 100.0

    def y(value: float) -> float:
        return _TOP + (height - _TOP - _BOTTOM) * (1.0 - scaled(value, (low, high)) / 100.0)

    label = escape(f"{words}: {len(day)} nights, tonight {amount[-1]:+.3g} {unit} beside the baseline")
    parts = [f'<svg class="course {kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{label}">']
    parts.append(
        f'<rect class="band" x="{_LEFT}" width="{width - _LEFT - _RIGHT}" y="{y(band[1]):.1f}"'
        f' height="{max(y(band[0]) - y(band[1]), 1.0):.1f}"/>'
    )
    parts += _axes(width, height, (low, high), last, x, y)
    for at, value, fine in list(zip(day, amount, clean, strict=True))[:-1]:
        parts.append(_mark(x(at), y(value), "in" if fine else "out"))
    parts.append(_mark(x(float(day[-1])), y(amount[-1]), "in" if clean[-1] else "out", 1.7))
    parts.append("</svg>")
    return Markup("".join(parts))  # noqa: S704 (numbers, and words that were escaped)


def _axes(
    width: int, height: int, values: tuple[float, float], last: float, x: _Scale, y: _Scale
) -> list[str]:
    ticks = nice_ticks(*values, 3)
    parts = []
    for tick in ticks:
        kind = "zero" if tick_text(tick, ticks) == "0" else "rule"
        parts.append(f'<path class="{kind}" d="M{_LEFT} {y(tick):.1f}H{width - _RIGHT}"/>')
        text = tick_text(tick, ticks)
        parts.append(f'<text x="{_LEFT - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{text}</text>')
    days = [day for day in nice_ticks(0.0, last, 3) if day >= 0.0] if last >= 1.0 else [0.0]
    for day in days:
        place = f'x="{x(day):.1f}" y="{height - _BOTTOM + 16}" text-anchor="middle"'
        parts.append(f"<text {place}>{tick_text(day, days)}</text>")
    return parts


def _mark(x: float, y: float, kind: str, size: float = 1.0) -> str:
    """A dot, or a diamond for who does not see the colour; tonight's is larger."""
    if kind == "in":
        return f'<circle class="in" cx="{x:.1f}" cy="{y:.1f}" r="{3.2 * size:.1f}"/>'
    half = 4.6 * size
    return f'<path class="out" d="M{x:.1f} {y - half:.1f}l{half} {half} {-half} {half} {-half} {-half}z"/>'
