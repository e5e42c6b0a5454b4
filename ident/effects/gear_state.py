"""The state of a gear that is not rigid: how far the link is behind its drive, along a measured motion.

With x the lag of the link behind the drive's output, m the inertia of the links that the drive moves and
τ the torque that the same motion takes of rigid links,

    m ẍ + F(x, ẋ) = τ,    F = K·play(x) + C·play(x)³ + D ẋ on a flank, never pulling, and 0 between the flanks

where play takes the gap off the spring's way, and C is there without a gap alone. The encoder sits on the
drive, so the drive's motion is what was measured, and x follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ident.effects.state import State
from ident.even_spline import EvenSpline
from robots.arrays import FloatArray

_LONGEST_STEP, _SHORTEST_STEP = 2.5e-4, 2e-5
"""s; of the integration."""
_PARTS = 4
"""Of a sample, in which the load goes on straight."""
_NEWTON_STEPS = 4
"""Of a spring that stiffens, from the step of its linear part, at most."""
_SETTLED = 1e-9
"""Of the acceleration: the step after one that is less would change nothing."""

FORGOTTEN = 3.0
"""s after which a link has no state of its own any more: the slowest one on a gear that is looked for, of 6
Hz and damped by 0.08, has come down to e⁻⁹."""

_PHASE = 0.1
"""rad of the link's oscillation per step: its frequency is then right within 0.1 %."""


class Course(NamedTuple):
    """Inertia and load (finer samples,) from some samples before the first on."""

    inertia: FloatArray
    load: FloatArray
    before: int


def lag_of_link(
    inertia: FloatArray,
    load: FloatArray,
    sample_time: float,
    stiffness: float,
    damping: float,
    gap: float,
    cubic: float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lag of the link behind the drive and its first two derivatives, each (samples,), rad (or m) and s.

    Args:
        inertia: (samples,) of the links that the drive moves, at its output, kg·m² (or kg).
        load: (samples,) torque that rigid links would take, N·m (or N).
        sample_time: s.
        stiffness: N·m/rad (or N/m).
        damping: N·m·s/rad (or N·s/m), acts where the spring does.
        gap: rad (or m), the whole play; the link starts in contact on the side that its load presses it to.
        cubic: N·m/rad³ (or N/m³) of a spring that stiffens, without a gap.
    """
    return lag_between_samples(finer(inertia, load), sample_time, stiffness, damping, gap, cubic)


def finer(inertia: FloatArray, load: FloatArray, state: State | None = None) -> Course:
    """Inertia and load (samples,) with points between the samples.

    Args:
        inertia, load: of a motion.
        state: the motion, which goes on before its first sample; None where it begins at rest.
    """
    pushed, before = between(load[:, np.newaxis], state)
    return Course(inertias(inertia[:, np.newaxis], state)[0], pushed[0], before)


def inertias(turned: FloatArray, state: State | None) -> FloatArray:
    """Inertias (samples, k) of a motion with points between, k × finer samples, each within its samples.

    Where one jumps a spline would go below nothing.
    """
    return np.clip(between(turned, state)[0].T, turned.min(axis=0), turned.max(axis=0)).T


def between(series: FloatArray, state: State | None) -> tuple[FloatArray, int]:
    """Series (samples, k) with points between, k × finer samples, and how many samples are before the first.

    A straight line between samples takes a tenth off a torque of a sixth of the sampling rate.
    """
    whole = series if state is None else state.with_before(series, FORGOTTEN)
    points = np.ascontiguousarray(EvenSpline(whole).with_between(_PARTS).T)
    return points, whole.shape[0] - series.shape[0]


def lag_between_samples(
    course: Course, sample_time: float, stiffness: float, damping: float, gap: float, cubic: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same of inertia and load as of :func:`finer`."""
    inertia, load, before = course
    frequency = float(np.sqrt(stiffness / np.median(inertia[::_PARTS])))
    step = min(max(_PHASE / frequency, _SHORTEST_STEP), _LONGEST_STEP)
    lag, rate, push = (np.empty_like(load) for _ in range(3))
    substeps = max(1, int(np.ceil(sample_time / (_PARTS * step))))
    start = load[0] / stiffness + 0.5 * gap * np.sign(load[0])
    if cubic > 0.0:
        start = next(
            x.real for x in np.roots([cubic, 0.0, stiffness, -load[0]]) if abs(x.imag) <= 1e-9 * abs(x)
        )
    h = sample_time / (_PARTS * substeps)
    _kernel()(inertia, load, h, substeps, stiffness, damping, 0.5 * gap, cubic, start, lag, rate, push)
    recorded = slice(_PARTS * before, None, _PARTS)
    return lag[recorded], rate[recorded], push[recorded]


@cache
def _kernel() -> Callable[..., None]:
    """The integration in machine code, kept on disk."""
    # Imported here: the compiler takes a second to load, and most commands need no gear state.
    from ident.kernels.compilation import compiled_with_stamp

    return compiled_with_stamp(_run, Path(__file__).read_bytes())


def _run(
    inertia: FloatArray,
    load: FloatArray,
    h: float,
    substeps: int,
    stiffness: float,
    damping: float,
    half: float,
    cubic: float,
    start: float,
    lag: FloatArray,
    rate: FloatArray,
    push: FloatArray,
) -> None:
    """Trapezoidal rule: stable at any stiffness and without damping of its own. Writes lag, rate and push.

    Free flight is tried first; where that ends beyond the gap, the flank's implicit step is taken instead.
    """
    x, v, a = start, 0.0, 0.0
    lag[0], rate[0], push[0] = x, v, a
    given = 0.25 * h * h * stiffness + 0.5 * h * damping
    for k in range(1, load.shape[0]):
        for s in range(1, substeps + 1):
            ahead = s / substeps
            m = inertia[k - 1] + ahead * (inertia[k] - inertia[k - 1])
            f = load[k - 1] + ahead * (load[k] - load[k - 1])
            # Position and speed at the end of the step, less what the new acceleration adds to them.
            y, w = x + h * v + 0.25 * h * h * a, v + 0.5 * h * a
            if half == 0.0:  # a spring that is never left
                a = (f - stiffness * y - damping * w) * (1.0 / (m + given))
                for _ in range(_NEWTON_STEPS if cubic > 0.0 else 0):
                    bent = y + 0.25 * h * h * a
                    force = (stiffness + cubic * bent * bent) * bent + damping * (w + 0.5 * h * a)
                    hardness = stiffness + 3.0 * cubic * bent * bent
                    less = (m * a + force - f) / (m + 0.25 * h * h * hardness + 0.5 * h * damping)
                    a -= less
                    if abs(less) <= _SETTLED * abs(a):
                        break
            else:
                a, give = f / m, 1.0 / (m + given)  # neither waits for the step before
                end = y + 0.25 * h * h * a
                if end > half or end < -half:
                    edge = half if end > half else -half
                    pressed = (f - stiffness * (y - edge) - damping * w) * give
                    if (f - m * pressed) * edge > 0.0:  # a flank never pulls
                        a = pressed
            x, v = y + 0.25 * h * h * a, w + 0.5 * h * a
        lag[k], rate[k], push[k] = x, v, a
