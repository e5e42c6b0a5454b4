"""Positions by measured positions and velocities together, where the velocities are worth it.

A velocity is the derivative of the position with noise of its own. Positions q_k ± σ_q and velocities
v_k ± σ_v together say

    min Σ ((x_k − q_k) / σ_q)² + Σ (((x_{k+1} − x_k) / h − ½ (v_k + v_{k+1})) / σ_v)² ,

a tridiagonal system. Slow motion comes of the positions, quick motion of the velocities, with no shift in
time; whatever differentiates x has the noise of the better of both. σ_q and σ_v are told apart by the
spectrum of r_k = (q_{k+1} − q_k) / h − ½ (v_k + v_{k+1}), which is

    4 (σ_q / h)² sin² (π f h) + σ_v² cos² (π f h) ,

fitted with weights of its own size. What a filter of the velocity leaves out of the motion, or a factor that
is not quite one, is slow in r and counts as noise of the velocity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.errors import IdentificationError
from ident.even_spline import EvenSpline
from ident.filters import power_density
from ident.preparation.spectrum import two_shares
from ident.signals import differentiate, low_pass
from robots.arrays import FloatArray

_ORDER, _ACCURACY = 4, 8
_SLOPE = 0.05
"""Share by which a velocity may differ from the derivative of the position; a wrong unit is far more."""

_SETTLED = 5.0
"""Periods of the cut-off at both ends in which a filtered acceleration is not to be trusted."""

_PIECE, _REWEIGHTED, _NOTHING = 2.0, 10, 1e-12
"""s of the pieces of a spectrum, rounds of its fit, and the share of its largest power that is nothing."""

_LATEST = 10.0
"""Samples by which a velocity may be late: a filter of the drive."""


@dataclass(frozen=True)
class WithVelocities:
    """Positions (samples × joints) with what the velocities add to them, and what was done, in words."""

    position: FloatArray
    words: tuple[str, ...]


def with_velocities(
    name: str, time: FloatArray, position: FloatArray, velocity: FloatArray, cutoff_hz: float
) -> WithVelocities:
    """The positions that measured positions and velocities say together.

    Args:
        name: of the recording, for messages.
        time: (samples,) s, uniform.
        position: samples × joints, rad (or m).
        velocity: samples × joints, rad/s (or m/s).
        cutoff_hz: of the positions' low-pass: up to there noise counts.

    Raises:
        IdentificationError: a velocity is not the derivative of its position; names the joint and the factor.
    """
    step = float((time[-1] - time[0]) / (time.shape[0] - 1))
    found, better, lags = position.copy(), [], []
    for joint in range(position.shape[1]):
        q, v = position[:, joint], velocity[:, joint]
        slope, lag = _proven(q, v, step, cutoff_hz)
        if abs(slope - 1.0) > _SLOPE or abs(lag) > _LATEST * step:
            raise IdentificationError(
                f"{name}: velocity of joint {joint + 1} is {slope:.4g} times the derivative of its position,"
                f" {1e3 * lag:.3g} ms late; are its unit and its side right?"
            )
        place = np.clip(np.arange(v.size) + lag / step, 0.0, v.size - 1.0)
        v = EvenSpline(v[:, np.newaxis]).at(place)[:, 0]
        a, b = _noise(q, v, step)
        if a * (2.0 * np.pi * cutoff_hz * step) ** 2 > b:
            found[:, joint] = _together(q, v, step, b / a)
            better.append(joint + 1)
        lags.append(lag)
    late = f", {1e3 * float(np.median(lags)):.3g} ms late,"
    if not better:
        return WithVelocities(
            found,
            (f"{name}: velocities{late} are the derivatives of the positions and no better than these",),
        )
    named = ", ".join(map(str, better))
    return WithVelocities(
        found, (f"{name}: velocities{late} are better than differentiated positions at joint {named}: used",)
    )


def _proven(q: FloatArray, v: FloatArray, step: float, cutoff_hz: float) -> tuple[float, float]:
    """Factor and lag, s, of a velocity beside the derivative of a position, both below the cut-off."""
    both = np.stack([q, v], axis=1)
    smooth = low_pass(both, min(cutoff_hz, 0.4 / step), step, _ORDER)
    rate = differentiate(smooth[:, :1], step, _ACCURACY)
    push = differentiate(rate, step, _ACCURACY)
    end = min(round(_SETTLED / (cutoff_hz * step)), q.size // 4)
    inner = slice(end, q.size - end)
    columns = np.concatenate([rate, push], axis=1)[inner]
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    slope, late = np.linalg.lstsq(columns / scale, smooth[inner, 1], rcond=None)[0] / scale
    return float(slope), float(-late / slope) if slope else 0.0


def _noise(q: FloatArray, v: FloatArray, step: float) -> tuple[float, float]:
    """(σ_q / h)² and σ_v², at least next to nothing each."""
    rest = np.diff(q) / step - 0.5 * (v[1:] + v[:-1])
    piece = min(round(_PIECE / step), rest.size)
    frequency, power = power_density(rest[:, np.newaxis], 1.0 / step, piece)
    frequency, power = frequency[1:-1], 0.5 * power[1:-1, 0] / step  # of one sided to a variance per sample
    shapes = np.stack([4.0 * np.sin(np.pi * frequency * step) ** 2, np.cos(np.pi * frequency * step) ** 2], 1)
    scale = float(power.max())
    fitted = np.maximum(power / scale, _NOTHING)
    parts = np.zeros(2)
    for _ in range(_REWEIGHTED):
        parts = two_shares(shapes / fitted[:, np.newaxis], power / scale / fitted)
        fitted = np.maximum(shapes @ parts, _NOTHING)
    return float(max(parts[0], _NOTHING) * scale), float(max(parts[1], _NOTHING) * scale)


def _together(q: FloatArray, v: FloatArray, step: float, ratio: float) -> FloatArray:
    """The least squares of positions and velocities, (samples,).

    Args:
        q, v: (samples,).
        step: s.
        ratio: σ_v² over (σ_q / h)².
    """
    from scipy.linalg import solveh_banded  # takes time to load; most logs have no velocities

    weight, way = 1.0 / ratio, 0.5 * step * (v[1:] + v[:-1])
    banded = np.zeros((2, q.size))
    banded[0, 1:] = -weight
    banded[1] = 1.0
    banded[1, 1:] += weight
    banded[1, :-1] += weight
    right = q.copy()
    right[1:] += weight * way
    right[:-1] -= weight * way
    return np.asarray(solveh_banded(banded, right))
