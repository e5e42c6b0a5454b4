"""When within the recordings a found effect began: the change point of its size over time.

The rows are those that the effect was found on, whitened. Beside all that is fitted its size may change
once, at τ: y = X β + d (a + b H(t − τ)), with d the torque of the effect as it was found. With b ~ N(0, 1)
before any data are seen (a change is of the order of the effect) and τ anywhere, the evidence of every τ is
a ratio of normal densities; it is compared with no change, and with a size that grows or shrinks all the
time. Where it is, is first looked for on whitened rows that are cut off there, then by the effect itself,
cut off at τ and behind all filters. What is left of the rows is not white where the model is not quite the
arm, so the deviation of a score is taken from blocks of time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import logsumexp

from ident.decimation import decimate_index
from ident.discrepancy.examination import Examination
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.results import Diagnosis
from ident.signals import low_pass_where_sampled
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray, IntArray

Kind = Literal["begins", "ends", "changes", "drifts"]

SURE = 0.9
"""Probability from which on a change is told, as a name is given."""

ODDS = 0.1
"""Prior probability of a step, and of a drift: an effect that is found is mostly there all the time."""

BLOCK = 1.0
"""s over which what is left of the rows adds up with a sign: longer than any memory of the noise."""

_CELLS = 400
"""Instants that are tried, twice: over all of the time, then where the first ones leave any doubt."""

_DOUBT = np.log(1e6)
"""Below the likeliest instant: what is less likely is not looked at again."""

_AT_ONCE = 20
"""Of them, so that the memory is bounded."""

_REACH = 0.25
"""s beyond which no filter looks."""

_FEWEST = 30
"""Rows to either side of a step, so that every filter has samples enough."""

_THERE = 3.0
"""Standard deviations from which on an effect is there on one side of the change."""


@dataclass(frozen=True)
class Onset:
    """When a finding changed.

    Attributes:
        finding: its number, from 1.
        kind: it begins, ends, changes at ``time``; or drifts all the time.
        probability: of that kind of change.
        time, interval: s from the start of the recording, and 95 %; NaN of a drift.
        recording: number of the fitted recording, from 1.
        before, after: how large it is, as a share of what was found over all: before and after the step, or
            where a drift begins and ends.
        before_sigma, after_sigma: their deviations.
    """

    finding: int
    kind: Kind
    probability: float
    time: float
    interval: tuple[float, float]
    recording: int
    before: float
    after: float
    before_sigma: float
    after_sigma: float


def onsets(diagnosis: Diagnosis) -> tuple[Onset, ...]:
    """Of every finding of the moving arm whose size changed within the recordings that were fitted."""
    examination = diagnosis.examinations[-1] if diagnosis.examinations else None
    if type(examination) is not Examination:
        return ()  # in closed loop rows are of a simulated motion
    count, found = len(diagnosis.findings), []
    names = examination.base.columns_of_effects
    for number, (_, places, _) in enumerate(names[len(names) - count :], start=1):
        one = onset_of(examination, places, number)
        if one is not None:
            found.append(one)
    return tuple(found)


def onset_of(examination: Examination, places: IntArray, number: int = 1) -> Onset | None:
    """When the effect of some columns changed; None where that is not sure.

    Args:
        examination: of the model with the effect.
        places: (p,) its base parameters.
        number: of the finding, from 1.
    """
    rows = _Rows.of(examination, places)
    if not rows.torque.any():
        return None
    edges = np.linspace(rows.time[0], rows.time[-1], _CELLS + 2)[1:-1]
    near = _nearer(edges, rows.of_cuts(edges))
    # What is left beside the likeliest step says how a score deviates.
    best = near[int(np.argmax(rows.of_steps(near)))]
    rows = replace(rows, spread=rows.spread_beside(float(best)))
    instants = _nearer(near, rows.of_steps(near))
    steps = rows.of_steps(instants)
    share = (instants[1] - instants[0]) / (rows.time[-1] - rows.time[0])
    ramp = float(rows.log_evidence(rows.white(rows.ramp))[0])
    evidence = np.array([0.0, logsumexp(steps) + np.log(share), ramp])
    scores = np.log([1.0 - 2.0 * ODDS, ODDS, ODDS]) + evidence
    _, of_step, of_drift = np.exp(scores - logsumexp(scores))
    if of_step >= SURE:
        return _stepping(rows, instants, steps, number, float(of_step))
    return _drifting(rows, number, float(of_drift)) if of_drift >= SURE else None


def _nearer(instants: FloatArray, log: FloatArray) -> FloatArray:
    """As many instants (K,) where these are likely, and two steps beyond."""
    kept, step = np.flatnonzero(log > log.max() - _DOUBT), instants[1] - instants[0]
    return np.linspace(instants[kept[0]] - 2.0 * step, instants[kept[-1]] + 2.0 * step, _CELLS)


def _stepping(rows: _Rows, instants: FloatArray, steps: FloatArray, number: int, probability: float) -> Onset:
    mass = np.cumsum(np.exp(steps - logsumexp(steps)))
    low, middle, high = (float(np.interp(share, mass, instants)) for share in (0.025, 0.5, 0.975))
    sample = rows.examination.prepared[0].recording.sample_time
    low, high = low - sample, high + sample  # no channel says it better
    later = rows.later(np.array([middle]))
    before, first = rows.factor_beside(later)
    after, second = rows.factor_beside(1.0 - later)
    kind: Kind = "changes"
    if abs(before) < _THERE * first:
        kind = "begins"
    elif abs(after) < _THERE * second:
        kind = "ends"
    starts = [p.started + float(p.recording.time[0]) for p in rows.examination.prepared]
    recording = max(0, int(np.searchsorted(starts, middle, side="right")) - 1)
    start = starts[recording]
    return Onset(
        number,
        kind,
        probability,
        middle - start,
        (low - start, high - start),
        recording + 1,
        before,
        after,
        first,
        second,
    )


def _drifting(rows: _Rows, number: int, probability: float) -> Onset:
    before, first = rows.factor_beside(rows.ramp)
    after, second = rows.factor_beside(1.0 - rows.ramp)
    nan = float("nan")
    return Onset(number, "drifts", probability, nan, (nan, nan), 1, before, after, first, second)


@dataclass(frozen=True)
class _Rows:
    """The rows of an examination with one effect as one column.

    Attributes:
        examination: of the model with the effect.
        time: (rows,) s, before whitening.
        torque: rows × joints, of the effect as found, before whitening.
        response: what the filters make of a step: s from it, and how much of it is there.
        columns: (M, k) whitened, of all else and then the effect; rows of a prior behind those of the data.
        inverse: (k, k) of columnsᵀ columns.
        spread: variance of a score over that of white rows.
    """

    examination: Examination
    time: FloatArray
    torque: FloatArray
    response: tuple[FloatArray, FloatArray]
    columns: FloatArray
    inverse: FloatArray
    spread: float = 1.0

    @classmethod
    def of(cls, examination: Examination, places: IntArray) -> _Rows:
        prepared = examination.prepared
        value = examination.beta[places]
        torque = np.concatenate([p.columns(examination.base)[:, :, places] @ value for p in prepared])
        own = examination.regressor[:, places] @ value
        columns = np.column_stack([np.delete(examination.regressor, places, axis=1), own])
        columns = columns[:, columns.any(axis=0)]
        time = np.concatenate([piece.time for piece in prepared])
        return cls(examination, time, torque, _response(prepared[0]), columns, _inverse(columns))

    @property
    def ramp(self) -> FloatArray:
        """(rows, 1) from none at the start to all at the end."""
        whole = self.time[-1] - self.time[0]
        return np.asarray((self.time - self.time[0])[:, np.newaxis] / whole)

    def later(self, instants: FloatArray) -> FloatArray:
        """(rows, K) how much of what begins at an instant is there."""
        return np.asarray(np.interp(self.time[:, np.newaxis] - instants, *self.response))

    def white(self, shares: FloatArray) -> FloatArray:
        """(M, K) whitened torque of the effect where these shares (rows, K) of it are there."""
        courses = np.asarray(self.torque[:, :, np.newaxis] * shares[:, np.newaxis, :])
        return self.examination.whiten([courses])

    def log_evidence(self, more: FloatArray) -> FloatArray:
        """(K,) of each of these changes (M, K), whitened, against none."""
        measured = self.examination.torque
        cross = more.T @ self.columns
        back = cross @ self.inverse
        information = np.sum(more**2, axis=0) - np.sum(back * cross, axis=1)
        score = (more.T @ measured - back @ (self.columns.T @ measured)) / self.spread
        known = np.maximum(information, 0.0) / self.spread
        return np.asarray(0.5 * score**2 / (1.0 + known) - 0.5 * np.log1p(known))

    def of_steps(self, instants: FloatArray) -> FloatArray:
        """(K,) of steps at these instants."""
        parts = np.array_split(instants, max(1, instants.size // _AT_ONCE))
        return np.concatenate([self.log_evidence(self.white(self.later(part))) for part in parts])

    def of_cuts(self, instants: FloatArray) -> FloatArray:
        """(K,) about the same, where steps lie far from each other: of whitened rows from there on."""
        time = np.full(self.columns.shape[0], -np.inf)
        time[: self.examination.data_rows] = _times(self.examination)
        own = self.columns[:, -1:]
        parts = np.array_split(instants, max(1, instants.size // _AT_ONCE))
        return np.concatenate([self.log_evidence(own * (time[:, np.newaxis] >= part)) for part in parts])

    def spread_beside(self, instant: float) -> float:
        """Of scores over blocks of time beside a step there, at least that of white rows."""
        more = self.white(self.later(np.array([instant])))
        whole = np.column_stack([self.columns, more])
        measured, count = self.examination.torque, self.examination.data_rows
        left = measured - whole @ (_inverse(whole) @ (whole.T @ measured))
        block = (_times(self.examination) / BLOCK).astype(np.int64)
        own = self.columns[:count, -1]
        blocks = np.bincount(block - block.min(), weights=own * left[:count])
        return max(1.0, float(blocks @ blocks / (own @ own)))

    def factor_beside(self, shares: FloatArray) -> tuple[float, float]:
        """Of the effect beside a change with this course (rows, 1), and its deviation."""
        whole = np.column_stack([self.columns, self.white(shares)])
        inverse = _inverse(whole)
        value = (inverse @ (whole.T @ self.examination.torque))[-2]
        return float(value), float(np.sqrt(self.spread * inverse[-2, -2]))


def _inverse(columns: FloatArray) -> FloatArray:
    """Of columnsᵀ columns, whatever their units."""
    scale = np.linalg.norm(columns, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    unit = columns / scale
    return np.asarray(np.linalg.pinv(unit.T @ unit, rcond=1e-12) / np.outer(scale, scale))


def _times(examination: Examination) -> FloatArray:
    """(N,) s, of every whitened row of the data, from the start of the first recording."""
    own = examination.whitening
    order = tuple(np.zeros(len(a)) for a in own.coefficients)
    plain = Whitening(own.kind, order, np.ones(len(own.sigma)))
    time = np.concatenate([piece.time for piece in examination.prepared])
    whole = np.repeat(time[:, np.newaxis], len(own.sigma), axis=1)[:, :, np.newaxis]
    return plain.apply(whole, examination.segment, examination.used)[:, 0]


def _response(piece: PreparedRecording) -> tuple[FloatArray, FloatArray]:
    """s from a step of torque, and how much of it the rows show: filters look to both sides."""
    step, every = piece.recording.sample_time, piece.decimation
    half = every * max(round(_REACH / (step * every)), _FEWEST)
    time: FloatArray = step * np.arange(2 * half + 1, dtype=np.float64)
    offsets, values = [], []
    for shift in range(every):
        torque: FloatArray = np.where(np.arange(time.size) >= half + shift, 1.0, 0.0)[:, np.newaxis]
        if piece.period is not None:  # as the torque of such a recording
            settings = piece.settings
            torque = low_pass_where_sampled(torque, time, settings.cutoff_hz, settings.filter_order)
        values.append(piece.thin(torque[:, :, np.newaxis])[:, 0, 0])
        offsets.append(time[decimate_index(time.size, every)] - time[half + shift])
    order = np.argsort(np.concatenate(offsets))
    inside = np.abs(np.concatenate(offsets)[order]) < 0.6 * _REACH
    return np.concatenate(offsets)[order][inside], np.concatenate(values)[order][inside]
