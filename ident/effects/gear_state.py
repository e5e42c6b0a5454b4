"""The state of a gear that is not rigid: how far the link is behind its drive, along a measured motion.

With x the lag of the link behind the drive's output, m the inertia of the links that the drive moves and
τ the torque that the same motion takes of rigid links,

    m ẍ + c ẋ + k x + F(x, ẋ) = τ
    F = K·play(x) + C·play(x)³ + D ẋ on a flank, never pulling, and 0 between the flanks

where play takes the gap off the spring's way, and C is there without a gap alone. c = ∂τ/∂q̇ and k = ∂τ/∂q
are what a link takes more that moves otherwise than its drive: 2q̇/ω of m ẍ, a fiftieth at 10 Hz. The encoder
sits on the drive, so the drive's motion is what was measured, and x follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ident.effects.state import State
from ident.even_spline import EvenSpline
from robots.arrays import FloatArray

_LONGEST_STEP, _SHORTEST_STEP = 2.5e-4, 2e-5
"""s; of the integration: the longest where a flank may be met within a step."""
PARTS = 4
"""Of a sample, in which the load goes on straight: a step is no longer."""
FORGOTTEN = 3.0
"""s after which a link has no state of its own any more: the slowest one on a gear that is looked for, of 6
Hz and damped by 0.08, has come down to e⁻⁹."""
_FARTHEST = 1.0
"""rad (or m). What goes farther has fallen over or swings on and on, which no arm that was recorded does: it
is as if nothing gave way."""
_FALLS = 9.0
"""So many time constants, of one that is damped less and in a motion that repeats."""

_PHASE, _PHASE_OF_PLAY = 0.2, 0.1
"""rad of the link's oscillation per step: its frequency is then right to 10⁻⁵, and where steps are shorter
for a play's flanks, within 0.1 %."""


class Course(NamedTuple):
    """m, τ, k and c (4, finer samples) from some samples before the first on, which a period may be."""

    felt: FloatArray
    before: int
    repeats: bool


def finer(inertia: FloatArray, loads: FloatArray, state: State | None = None) -> Course:
    """Inertia and loads with points between the samples.

    Args:
        inertia: (samples,) of a motion.
        loads: samples × 1 or 3: τ, and k and c where links that lag feel otherwise.
        state: the motion, which goes on before its first sample; None where it begins at rest.
    """
    points, before = between(loads, state)
    felt = np.zeros((4, points.shape[1]))
    # Where an inertia jumps a spline would go below nothing.
    felt[0] = np.clip(between(inertia[:, np.newaxis], state)[0][0], inertia.min(), inertia.max())
    felt[1 : 1 + points.shape[0]] = points
    return Course(felt, before, state is not None and state.repeats)


def unless_too_far(ways: FloatArray, farthest: FloatArray) -> FloatArray:
    """Ways of links; none where the farthest is more than an arm's, or is no number any more."""
    return ways if np.abs(farthest).max() <= _FARTHEST else np.zeros_like(ways)


def between(series: FloatArray, state: State | None) -> tuple[FloatArray, int]:
    """Series (samples, k) with points between, k × finer samples, and how many samples are before the first.

    A straight line between samples takes a tenth off a torque of a sixth of the sampling rate.
    """
    whole = series if state is None else state.with_before(series, FORGOTTEN)
    points = np.ascontiguousarray(EvenSpline(whole).with_between(PARTS).T)
    return points, whole.shape[0] - series.shape[0]


@dataclass(frozen=True)
class Gear:
    """What is between a drive's output and its links.

    Attributes:
        stiffness: N·m/rad (or N/m).
        damping: N·m·s/rad (or N·s/m), acts where the spring does.
        gap: rad (or m), the whole play; the link starts in contact on the side that its load presses it to.
        cubic: N·m/rad³ (or N/m³) of a spring that stiffens, without a gap.
    """

    stiffness: float
    damping: float
    gap: float = 0.0
    cubic: float = 0.0

    def lag(
        self, course: Course, sample_time: float, carried: Callable[[], FloatArray] | None = None
    ) -> FloatArray:
        """3 × samples: lag of the link behind the drive and its first two derivatives, rad (or m) and s.

        In a motion that repeats the link does as well, so it goes through the period until it has forgotten
        how it began. In one that does not, how it began is what its spring is seen to carry. (A link damped
        by 0.005 rang through three periods of 10 s with a fifteenth of its torque, which stood for a gear of
        the joint beside it, an eccentricity and two ripples; of such a one other motion showed a fifth.)

        Args:
            course: of the load, as of :func:`finer`.
            sample_time: s.
            carried: (samples,) torque through the gear as it was measured; asked for where it is needed.
        """
        felt, before, repeats = course
        inertia = float(np.median(felt[0, ::PARTS]))
        needed = self.rings_for(inertia)
        run = partial(self._run, sample_time, float(np.sqrt(self.stiffness / inertia)))
        recorded, lead = PARTS * before, before * sample_time
        first = PARTS * max(before - int(np.ceil(needed / sample_time)), 0) if repeats else 0
        state = np.array([self.settled(*felt[1:3, first]), 0.0, 0.0])
        for _ in range(int(needed / lead) if repeats and before else 0):
            state = run(felt[:, : recorded + 1], state)[:, -1].copy()
        found = run(felt[:, first:], state)[:, recorded - first :: PARTS]
        found = unless_too_far(found, found[0])
        if carried is None or repeats or not before or needed <= lead or not self.is_linear:
            return found
        if not found.any():  # what flies apart does not ring, either
            return found
        force = np.array([self.stiffness, self.damping, 0.0])
        free = felt[:, recorded:] * np.array([[1.0], [0.0], [1.0], [1.0]])
        rings = np.stack([run(free, one)[:, ::PARTS] for one in self._free(free[:, 0])])
        sizes = np.linalg.lstsq((force @ rings).T, carried() - force @ found, rcond=None)[0]
        return np.asarray(found + np.tensordot(sizes, rings, 1))

    @property
    def spring(self) -> tuple[float, float, float, float]:
        """As machine code takes it."""
        return self.stiffness, self.damping, 0.5 * self.gap, self.cubic

    @property
    def is_linear(self) -> bool:
        """Whether how it rings adds to what a motion makes it do."""
        return not (self.gap or self.cubic)

    def rings_for(self, inertia: float) -> float:
        """s in which a link of an inertia has forgotten how it began; in flight it is not damped."""
        return FORGOTTEN if self.gap else 2.0 * _FALLS * inertia / max(self.damping, 1e-12)

    def substeps(self, sample_time: float, frequency: float) -> int:
        """Of each part of a sample, for a link that swings with a frequency, rad/s."""
        longest = min(_PHASE_OF_PLAY / frequency, _LONGEST_STEP) if self.gap else _PHASE / frequency
        return int(np.ceil(sample_time / PARTS / max(longest, _SHORTEST_STEP) * (1.0 - 1e-9)))

    def settled(self, load: float, way: float) -> float:
        """Lag under a load that stays, but for what a link that lags takes of it."""
        if self.cubic > 0.0:
            roots = np.roots([self.cubic, 0.0, self.stiffness + way, -load])
            return float(next(x.real for x in roots if abs(x.imag) <= 1e-9 * abs(x)))
        pressed = load + 0.5 * self.gap * self.stiffness * np.sign(load)
        return float(pressed / (self.stiffness + way))

    def _free(self, felt: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Two states (3,) of a link without load that go on otherwise: bent, and let go of in motion."""
        inertia, _, way, drag = felt
        stiffness, damping = self.stiffness + way, self.damping + drag
        speed = float(np.sqrt(self.stiffness / inertia))
        bent = np.array([1.0, 0.0, -stiffness / inertia])
        return bent, np.array([0.0, speed, -damping * speed / inertia])

    def _run(self, sample_time: float, frequency: float, felt: FloatArray, state: FloatArray) -> FloatArray:
        """3 × finer samples from a state (3,) on, that of the first."""
        substeps = self.substeps(sample_time, frequency)
        found = np.empty((3, felt.shape[1]))
        # Imported here: the compiler takes a second to load, and most commands need no gear state.
        from ident.kernels.gears import link_behind_a_gear

        step = sample_time / (PARTS * substeps)
        inertia, load, way, drag = felt
        link_behind_a_gear(inertia, load, way, drag, step, substeps, self.spring, state, found)
        return found
