"""Which timing and which form of law: chosen by what they predict of blocks that they were not fitted on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ident.controllers.columns import LoopSignals
from ident.controllers.gains import Products, factors, solve_gains
from ident.controllers.structure import FORMS, Form, Interpolation, Timing
from robots.arrays import FloatArray
from robots.description import Controller

FOLDS = 5
_BLOCKS_PER_FOLD = 2
_INTERPOLATIONS: tuple[Interpolation, ...] = ("hold", "linear", "spline")
_DIFFERENCES = (1, 2, 3, 4)
_DELAYS = (0, 1, 2, 3, 4)
_CUTOFFS = 10
"""Cut-offs of the velocity filter that are tried, from 1 % to 40 % of the controller's rate."""

_SAME = 0.1
"""Errors that differ by less than this, in ln of the mean square, are the same: 5 % in amplitude."""

_SAME_TIMING = 0.02
_EQUAL = 1e-6
"""Scores that differ by less differ by rounding alone."""

_IMPOSSIBLE = 1e3
_SLIGHTLY = 0.02

COMPLETE = tuple(form for form in FORMS if form.velocity_feed_forward and not form.acceleration_feed_forward)
"""The laws that timings are compared under: each with feed-forward of the velocity."""

Choice = TypeVar("Choice")


@dataclass(frozen=True)
class Ranked(Generic[Choice]):
    """Candidates with their held-out errors.

    Attributes:
        chosen: the first in order of preference that is within one standard error, or 5 %, of the best.
        scores: (candidates,) mean over drives of ln of the held-out mean square error, best zero.
        errors: (candidates,) standard error of that over the folds.
        candidates: in order of preference.
    """

    chosen: Choice
    scores: FloatArray
    errors: FloatArray
    candidates: tuple[Choice, ...]

    def as_good(self) -> tuple[Choice, ...]:
        """All that are within one standard error of the best, the chosen one left out."""
        pairs = zip(self.candidates, self.scores, self.errors, strict=True)
        return tuple(c for c, score, error in pairs if score <= error and c != self.chosen)


class Blocks:
    """Sums of products of each block of samples, for every timing that is asked for."""

    def __init__(self, signals: LoopSignals) -> None:
        self._signals = signals
        samples = signals.signal.shape[0]
        self._edges = np.linspace(0, samples, FOLDS * _BLOCKS_PER_FOLD + 1).astype(int)
        self._known: dict[Timing, list[list[Products]]] = {}

    def products(self, timing: Timing) -> list[list[Products]]:
        """Per drive, per fold."""
        if timing not in self._known:
            columns = self._signals.columns(timing)
            self._known[timing] = [
                [self._fold(columns, drive, fold) for fold in range(FOLDS)]
                for drive in range(columns.shape[1])
            ]
        return self._known[timing]

    def _fold(self, columns: FloatArray, drive: int, fold: int) -> Products:
        parts = []
        for block in range(fold, FOLDS * _BLOCKS_PER_FOLD, FOLDS):
            part = slice(self._edges[block], self._edges[block + 1])
            used = self._signals.used[part, drive]
            parts.append(Products.of(columns[part, drive][used], self._signals.signal[part, drive][used]))
        return sum(parts[1:], parts[0])


def held_out(form: Form, folds: Sequence[Products]) -> FloatArray:
    """Mean square error of each fold, (folds,), by gains fitted on the other ones."""
    errors = np.empty(len(folds))
    for k, fold in enumerate(folds):
        others = [part for j, part in enumerate(folds) if j != k]
        theta, _ = solve_gains(form, sum(others[1:], others[0]))
        errors[k] = max(fold.squared_error(factors(form, theta)), 0.0) / fold.count
    return errors


def explained(form: Form, folds: Sequence[Products]) -> float:
    """Share of the variation of v_τ that is predicted on blocks that were not fitted."""
    whole = sum(folds[1:], folds[0])
    counts = np.array([fold.count for fold in folds])
    return float(1.0 - held_out(form, folds) @ counts / whole.variation)


def best_timing(blocks: Blocks, described: Controller, forms: Sequence[Form] = COMPLETE) -> Timing:
    """The timing of the loop under the law that goes with it best.

    Timing and law are looked for together: a set-point that is read a period too late looks like a negative
    feed-forward, so gains that no controller has speak against the timing. Of timings that predict as well,
    the one whose law needs the fewest gains is taken: a ramp between set-points with a feed-forward of one
    period is the same law as set-points that are held. Of those again the described one, then the plainest.

    Args:
        blocks: the recording.
        described: from the arm's description; only its timing counts.
        forms: the laws that are considered.
    """
    own = Timing(
        described.interpolation,
        described.velocity_difference_samples,
        described.velocity_cutoff_hz,
        described.delay_samples,
    )
    plain = [Timing(i, n, None, d) for i in _INTERPOLATIONS for n in _DIFFERENCES for d in _DELAYS]
    start, form = _best(blocks, list(dict.fromkeys([own, *plain])), forms, described)
    rate = 1.0 / described.sample_time
    cutoffs = np.geomspace(0.01 * rate, 0.4 * rate, _CUTOFFS)
    filtered = [
        Timing(start.interpolation, n, float(cutoff), d)
        for n in (1, 2)
        for d in range(start.delay + 1)
        for cutoff in cutoffs
    ]
    best, _ = _best(blocks, [own, start, *filtered], [form], described)
    if best.cutoff_hz is not None and best != own:
        best, _ = _best(blocks, [own, start, *_finer(blocks, best, form)], [form], described)
    return best


def _best(
    blocks: Blocks, timings: Sequence[Timing], forms: Sequence[Form], described: Controller
) -> tuple[Timing, Form]:
    """The best pair; of timings within ``_SAME_TIMING`` those whose law has the fewest gains.

    Of these the first in ``timings``, the described one, is kept; else the best, equal ones in order.
    """
    scores = np.array([[_score(blocks, timing, form).mean() for form in forms] for timing in timings])
    ahead = scores.min(axis=1)
    same = [int(k) for k in np.flatnonzero(ahead <= ahead.min() + _SAME_TIMING)]
    if len(same) > 1:
        gains = {k: best_form(blocks, timings[k], described).chosen.count for k in same}
        same = [k for k in same if gains[k] == min(gains.values())]
    least = min(ahead[k] for k in same)
    timing = same[0] if same[0] == 0 else next(k for k in same if ahead[k] <= least + _EQUAL)
    return timings[timing], forms[int(np.argmin(scores[timing]))]


def _finer(blocks: Blocks, coarse: Timing, form: Form) -> list[Timing]:
    """The same timing with cut-offs between the neighbours on the grid, closing in on the best."""
    assert coarse.cutoff_hz is not None
    found, width = [coarse], 40.0 ** (1.0 / (_CUTOFFS - 1))
    for _ in range(5):
        width = width**0.5
        best = found[0].cutoff_hz
        assert best is not None
        trials = [
            Timing(coarse.interpolation, coarse.difference, best * factor, coarse.delay)
            for factor in (1.0, width, 1.0 / width)
        ]
        scores = [_score(blocks, trial, form).mean() for trial in trials]
        found.insert(0, trials[int(np.argmin(scores))])
    return found


def best_form(blocks: Blocks, timing: Timing, described: Controller) -> Ranked[Form]:
    """The law with the fewest gains that is as good as any; of equal ones the described type first."""
    order = sorted(FORMS, key=lambda form: (form.count, form.law != described.type))
    scores = np.array([_score(blocks, timing, form) for form in order])
    return _choose(order, scores)


def _score(blocks: Blocks, timing: Timing, form: Form) -> FloatArray:
    drives = blocks.products(timing)
    tiny = [1e-12 * max(sum(f.variation for f in folds), 1e-300) / FOLDS for folds in drives]
    logs = [np.log(held_out(form, folds) + least) for folds, least in zip(drives, tiny, strict=True)]
    possible = all(_possible(form, folds) for folds in drives)
    return np.asarray(np.mean(logs, axis=0) + (0.0 if possible else _IMPOSSIBLE))


def _possible(form: Form, folds: Sequence[Products]) -> bool:
    """Whether the gains are those of a controller: none is negative beyond what errors make."""
    if form.law == "free":
        return True
    theta, _ = solve_gains(form, sum(folds[1:], folds[0]))
    if not (theta[:2] > 0.0).all():
        return False
    fed = theta[2] / theta[1] if form.velocity_feed_forward else 0.0
    place = 2 + form.velocity_feed_forward
    integral = 0.0 if form.law == "pd" else theta[place]
    acceleration = theta[-1] if form.acceleration_feed_forward else 0.0
    return bool(fed > -_SLIGHTLY and integral > -_SLIGHTLY and acceleration >= 0.0)


def _choose(order: Sequence[Choice], scores: FloatArray) -> Ranked[Choice]:
    best = scores[int(np.argmin(scores.mean(axis=1)))]
    behind = scores - best
    mean = behind.mean(axis=1)
    error = np.maximum(behind.std(axis=1, ddof=1) / np.sqrt(behind.shape[1]), _SAME)
    chosen = int(np.flatnonzero(mean <= error)[0])
    return Ranked(order[chosen], mean, error, tuple(order))
