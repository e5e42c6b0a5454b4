"""What comes again with any period, or begins anywhere: which the residual shows, of more than can be tried.

Of what comes again in time see :mod:`.boxes`, of what begins at a position :mod:`.corners`; of waves over a
drive's position, with u the white residual of a set and W the whitening of its joint, a column that is a
wave, h·cos(kx) and h·sin(kx) over the drive's position x, has the product |Σ (Wᵀu)ᵢ hᵢ exp(i k xᵢ)|² with
the residual: one Fourier transform over x for all k at once (the periodogram of Lomb and Scargle, for noise
with a memory). What the filter of the positions leaves of a wave hangs on its frequency k·|ẋ|, so rows go
by their speed, each class with the share that is left there. Peaks only choose what is tried: how likely
those are the evidence says as of all others, and the prior of a period is divided among all that could have
been tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product

import numpy as np
from scipy.fft import ifft, next_fast_len
from scipy.signal import freqz

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.boxes import best_boxes
from ident.discrepancy.by_evidence.decide.corners import best_corners
from ident.discrepancy.by_evidence.decide.peaks import PEAKS, highest, tried_at
from ident.discrepancy.by_evidence.decide.screening import gains_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.residual import white_residual
from ident.discrepancy.by_evidence.evidence.rows import Rows, effect_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.family import PresentModel
from ident.effects.placed import drive_row
from ident.effects.shown import as_filter_shows
from ident.effects.torque_ripple import waves_per_period
from robots.arrays import BoolArray, FloatArray

_FEW = 12
"""Waves within the motion, up to which splines and parameters may take them up."""

_CLASSES = 12
"""Of rows, by their speed: within one it differs by a third, and with it the frequency of a wave."""

_PER_PERIOD = 16
"""Cells of the position per shortest period: of a wave that is summed over cells 0.6 % is lost."""


def scanned(
    rows: Rows, found: Found, wanted: Sequence[Candidate], present: PresentModel
) -> tuple[Entry, ...]:
    """What the residual of a set shows of candidates whose period or beginning can be any, two of each form.

    Args:
        rows: the data.
        found: the set.
        wanted: the vocabulary; the scanned shape of a candidate comes first, all others are fixed.
        present: the model that columns are made of.
    """
    some = [one for one in wanted if one.is_scanned]
    if not some:
        return ()
    members = [member.entry.white for member in found.members]
    left = white_residual(rows, found.level, found.posterior, members)
    squares = found.level.excess**2
    # What a joint's rows say of a column: Wᵀu, by how noisy they are.
    whiteners, count = rows.whiteners, rows.prepared.used.shape[0]
    said = np.stack([w.back(u, count) for w, u in zip(whiteners, left, strict=True)], axis=1) / squares
    likeliest: dict[str, Callable[[Candidate], Iterable[tuple[float, ...]]]] = {
        "position": lambda one: _waves(rows, found, one, present, said),
        "time": lambda one: best_boxes(rows, found, one, present, said),
        "corner": lambda one: best_corners(rows, found, one, present),
    }
    made = at_once(lambda one: tried_at(rows, one, likeliest[one.over](one), present), some)
    return tuple(entry for of_one in made for entry in of_one)


def _waves(
    rows: Rows, found: Found, candidate: Candidate, present: PresentModel, said: FloatArray
) -> Iterator[tuple[float, ...]]:
    """Shapes at peaks of the gain over the period, with every combination of the other shapes.

    What comes a few times within the motion may be taken up by all else that the model has, so it is asked
    beside that; half a wave there tells neighbours apart.
    """
    periods, squares = np.array(candidate.shapes[0].grid), found.level.excess**2
    row, unit = (
        drive_row(rows.prepared.robot, candidate.place),
        waves_per_period(rows.prepared.robot, candidate.place),
    )
    way = float(np.ptp(np.concatenate([part.at_rows.position for part in rows.prepared.parts]) @ row))
    few = int(np.searchsorted(periods, 2.0 * np.pi * _FEW / max(way * unit, 1e-9)))
    apart = max(1, int(np.pi / (max(way, 1e-9) * unit * float(periods[1] - periods[0]))))
    for rest in product(*(shape.grid for shape in candidate.shapes[1:])):
        slow = tried_at(rows, candidate, [(float(one), *rest) for one in periods[:few:apart]], present)
        for peak in highest(gains_beside(rows, found, slow))[:PEAKS]:
            yield slow[peak].placed.shape
        gains = _gains(rows, candidate, rest, present, said, squares)[few:]
        for peak in highest(gains)[:PEAKS]:
            yield (float(periods[few + peak]), *rest)


def _gains(
    rows: Rows,
    candidate: Candidate,
    rest: tuple[float, ...],
    present: PresentModel,
    said: FloatArray,
    squares: FloatArray,
) -> FloatArray:
    """(periods,) about how many nats a wave takes off the residual.

    Args:
        rows: the data.
        candidate: with the scanned shape first.
        rest: its other shapes.
        present: the model that columns are made of.
        said: rows × joints, Wᵀu over s².
        squares: (n,) s².
    """
    prepared, robot = rows.prepared, rows.prepared.robot
    flat = candidate.at(robot, (0.0, *rest), present)
    height = effect_rows(prepared, flat)[:, :, 0]
    row = drive_row(robot, candidate.place)
    position = np.concatenate([part.at_rows.position for part in prepared.parts]) @ row
    speed = np.abs(np.concatenate([part.at_rows.velocity for part in prepared.parts]) @ row)
    waves = np.array(candidate.shapes[0].grid) * waves_per_period(robot, candidate.place)
    time = prepared.parts[0].own.time
    assert time is not None
    rate = 1.0 / float(time[1] - time[0])
    score, information = np.zeros(waves.size, dtype=np.complex128), np.zeros(waves.size)
    for inside in _by_speed(speed, np.asarray(prepared.used.any(axis=1))):
        mean = float(np.median(speed[inside]))
        passed = as_filter_shows(robot, waves * mean / (2.0 * np.pi), time)
        agreed = np.sum(said[inside] * height[inside], axis=1)
        score += passed * _waves_of(position[inside], agreed, waves)
        for j in np.flatnonzero(height.any(axis=0)):
            noise = rows.noise[j]
            angle = np.minimum(waves * mean / rate, np.pi)
            power = float(np.sum(height[inside & prepared.used[:, j], j] ** 2)) / squares[j]
            information += 0.5 * power * passed**2 * np.abs(freqz(noise.taps, worN=angle)[1]) ** 2
    return np.asarray(0.5 * np.abs(score) ** 2 / (information + 1.0 / flat.scale[0] ** 2))


def _by_speed(speed: FloatArray, used: BoolArray) -> list[BoolArray]:
    """Rows in classes of about the same speed, those that count."""
    if not used.any():
        return []
    low, high = np.log(np.maximum(np.quantile(speed[used], (0.01, 1.0)), 1e-9))
    number = np.clip((np.log(np.maximum(speed, 1e-9)) - low) / max(high - low, 1e-9), 0.0, 1.0 - 1e-9)
    which = (_CLASSES * number).astype(np.int64)
    return [inside for k in range(_CLASSES) if (inside := used & (which == k)).any()]


def _waves_of(position: FloatArray, values: FloatArray, waves: FloatArray) -> FloatArray:
    """(waves,) Σ values · exp(i k position), k evenly spaced, by sums over cells of the position."""
    step = float(waves[1] - waves[0])
    cells = next_fast_len(int(np.ceil(_PER_PERIOD * waves[-1] / step)))
    width = 2.0 * np.pi / (step * cells)
    where = np.floor(position / width).astype(np.int64)
    turned = values * np.exp(1j * waves[0] * width * (where + 0.5))
    sums = [np.bincount(where % cells, part, cells) for part in (turned.real, turned.imag)]
    return np.asarray(ifft(sums[0] + 1j * sums[1])[: waves.size] * cells)
