"""Pictures of a planned motion: joint curves against their limits, and the path of the tool."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from daq.planning.arm_picture import outline
from daq.report.pictures import Tick, nice_ticks, scaled, tick_text, trace_path
from robots.arrays import FloatArray
from trajectories import Obstacle

PATH_WIDTH = 1000
_BEYOND = 1.12
"""A panel shows so much of the range between limits."""

_LABEL = 110
"""Units of the picture that a label takes."""
_FEWEST_METRES = 0.2

_NEAR = 0.8
"""What is drawn of the surroundings, as a share of the size of the path."""

_CORNER = 45
"""Height of the labels of the lower axis."""

_SIGNS = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])


@dataclass(frozen=True)
class LimitPanel:
    """One quantity of one joint over time, with its limits; positions in percent from the top."""

    what: str
    path: str
    ticks: tuple[Tick, ...]
    limits: tuple[float, ...]
    breaks: bool


@dataclass(frozen=True)
class JointFigure:
    """Position, velocity, acceleration and torque of one joint."""

    heading: str
    description: str
    numbers: tuple[tuple[str, str], ...]
    panels: tuple[LimitPanel, ...]
    time_ticks: tuple[Tick, ...]
    starts: tuple[float, ...]


@dataclass(frozen=True)
class PathView:
    """The tool's path from one side."""

    heading: str
    picture: Markup
    description: str


def limit_panel(
    what: str, time: FloatArray, values: FloatArray, lower: float, upper: float, pixels: int
) -> LimitPanel:
    """A curve between its limits; where it leaves them the panel grows to show it.

    Args:
        what: quantity and unit.
        time: (N,) s.
        values: (N,).
        lower, upper: limits.
        pixels: columns to reduce the curve to.
    """
    middle, half = (upper + lower) / 2, (upper - lower) / 2
    reach = _BEYOND * max(half, float(np.abs(values - middle).max()))
    low, high = middle - reach, middle + reach
    marks = nice_ticks(low, high, 3)
    breaks = bool(values.max() > upper + 1e-6 * half or values.min() < lower - 1e-6 * half)
    return LimitPanel(
        what=what,
        path=trace_path(time, values, (float(time[0]), float(time[-1]), low, high), pixels),
        ticks=tuple(Tick(100.0 - scaled(v, (low, high)), tick_text(v, marks)) for v in marks),
        limits=tuple(100.0 - scaled(limit, (low, high)) for limit in (lower, upper)),
        breaks=breaks,
    )


def time_ticks(duration: float) -> tuple[Tick, ...]:
    """Labels of a time axis from 0 to a duration, s."""
    marks = nice_ticks(0.0, duration, 5)
    return tuple(Tick(scaled(t, (0.0, duration)), tick_text(t, marks)) for t in marks)


def path_view(
    heading: str,
    axes: tuple[int, int],
    path: FloatArray,
    fastest: FloatArray,
    obstacles: tuple[Obstacle, ...],
    floor: float | None,
    arms: Mapping[str, Sequence[FloatArray]] | None = None,
) -> PathView:
    """The path of the tool projected on two axes of the base frame, the same scale along both.

    Args:
        heading: what is looked at from where.
        axes: which axes point right and up.
        path: samples × 3, m.
        fastest: (3,) where the tool is fastest.
        obstacles: drawn as their outlines.
        floor: height, drawn where the second axis is the vertical one; None for no floor.
        arms: the arm's bodies, N × 3 m each, in one or more postures; by the style that they are drawn in.
    """
    right, up = axes
    drawn_arms = arms or {}
    bodies = [body for posture in drawn_arms.values() for body in posture]
    low, high = _bounds(axes, np.vstack([path, *bodies]), obstacles, floor)
    size = np.maximum(1.15 * (high - low), _FEWEST_METRES)
    low = (low + high) / 2 - size / 2
    scale = PATH_WIDTH / size[0]
    height = int(np.clip(size[1] * scale, 300, 1400))
    if height < size[1] * scale:
        scale = height / size[1]
        low[0] -= (PATH_WIDTH / scale - size[0]) / 2

    def at(point: FloatArray) -> tuple[float, float]:
        x, y = (point - low) * scale
        return float(x), float(height - y)

    parts = _grid(low, scale, height)
    if floor is not None and up == 2:
        _, y = at(np.array([0.0, floor]))
        parts.append(f'<path class="floor" d="M0 {y:.0f}H{PATH_WIDTH}"/>')
    outlines = [_outline(obstacle, axes, at, height) for obstacle in obstacles]
    parts.extend(box for box, _ in outlines)
    for style, posture in drawn_arms.items():
        for body in posture:
            corners = "L".join(f"{x:.0f} {y:.0f}" for x, y in map(at, outline(body[:, axes])))
            parts.append(f'<path class="{style}" d="M{corners}Z"/>')
    line = "L".join(f"{x:.0f} {y:.0f}" for x, y in (at(point) for point in path[:, axes]))
    parts.append(f'<path class="way" d="M{line}"/>')
    for style, point in (("base", np.zeros(3)), ("begin", path[0]), ("fast", fastest)):
        x, y = at(point[list(axes)])
        parts.append(f'<circle class="{style}" cx="{x:.0f}" cy="{y:.0f}" r="9"/>')
    parts.extend(name for _, name in outlines)  # on top of what is drawn before them
    names = "xyz"
    description = (
        f"{heading}: {names[right]} from {path[:, right].min():.2f} to {path[:, right].max():.2f} m, "
        f"{names[up]} from {path[:, up].min():.2f} to {path[:, up].max():.2f} m"
    )
    drawn = f'<svg class="view" viewBox="0 0 {PATH_WIDTH} {height}" aria-hidden="true">{"".join(parts)}</svg>'
    return PathView(heading, Markup(drawn), description)  # noqa: S704


def _bounds(
    axes: tuple[int, int], path: FloatArray, obstacles: tuple[Obstacle, ...], floor: float | None
) -> tuple[FloatArray, FloatArray]:
    """Corners of what is drawn: path and arm (N × 3), its base, and what of the surroundings is near."""
    points = np.vstack([path[:, axes], np.zeros((1, 2))])
    around = [_corners(obstacle)[:, axes] for obstacle in obstacles]
    if floor is not None and axes[1] == 2:
        around.append(np.array([[0.0, floor]]))
    low, high = points.min(axis=0), points.max(axis=0)
    room = _NEAR * float((high - low).max())
    near = np.clip(np.vstack([points, *around]), low - room, high + room)
    return near.min(axis=0), near.max(axis=0)


def _grid(low: FloatArray, scale: float, height: int) -> list[str]:
    """Lines at round distances, with their labels, m."""
    parts = []
    across = nice_ticks(float(low[0]), float(low[0] + PATH_WIDTH / scale), 3)
    for value in across:
        x = (value - low[0]) * scale
        parts.append(f'<path class="mesh" d="M{x:.0f} 0V{height}"/>')
        beside = f'x="{x + 6:.0f}"' if x < PATH_WIDTH - _LABEL else f'x="{x - 6:.0f}" text-anchor="end"'
        parts.append(f'<text {beside} y="{height - 8}">{tick_text(value, across)}</text>')
    upwards = nice_ticks(float(low[1]), float(low[1] + height / scale), 3)
    for value in upwards:
        y = height - (value - low[1]) * scale
        parts.append(f'<path class="mesh" d="M0 {y:.0f}H{PATH_WIDTH}"/>')
        if y < height - _CORNER:  # the labels of the other axis stand below
            parts.append(f'<text x="6" y="{y - 6:.0f}">{tick_text(value, upwards)} m</text>')
    return parts


def _outline(obstacle: Obstacle, axes: tuple[int, int], at: object, height: int) -> tuple[str, str]:
    """An obstacle seen along an axis, and its name: from above a turned box is a polygon."""
    flat = _corners(obstacle)[:, axes]
    middle = flat.mean(axis=0)
    if axes == (0, 1):
        flat = flat[_SIGNS[:, 2] > 0]
        order = np.argsort(np.arctan2(*(flat - middle).T[::-1]))
        flat = flat[order]
    else:
        (x0, y0), (x1, y1) = flat.min(axis=0), flat.max(axis=0)
        flat = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    points = "L".join("{:.0f} {:.0f}".format(*at(point)) for point in flat)  # type: ignore[operator]
    x, y = at(middle)  # type: ignore[operator]
    if axes != (0, 1):  # below its upper edge, where the arm hides it least
        y = at(flat.max(axis=0))[1] + 44  # type: ignore[operator]
    # A box that is partly outside keeps its name inside.
    x, y = float(np.clip(x, 120, PATH_WIDTH - 120)), float(np.clip(y, 40, height - 50))
    name = f'<text class="name" x="{x:.0f}" y="{y:.0f}">{escape(obstacle.name)}</text>'
    return f'<path class="box" d="M{points}Z"/>', name


def _corners(obstacle: Obstacle) -> FloatArray:
    """Of a box, 8 × 3 m."""
    cosine, sine = np.cos(obstacle.turn), np.sin(obstacle.turn)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    return np.asarray(_SIGNS * np.array(obstacle.size) / 2 @ turn + obstacle.centre)
