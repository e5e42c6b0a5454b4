"""Gears that give way, all at once: what each one's spring carries was measured.

A gear that is fitted alone takes a resonance that several make for its own (7.3 Hz, one of 9 beside one of
11 Hz), and beside it no other shows. But the torque T through a gear was measured, all but what its drive
takes itself: with a compliance c and damping D links lag behind it by c T - c² D Ṫ whatever else is soft, and
their torques change by the slopes along that lag. This is linear in c and c² D of all gears at once, and no
resonance is guessed. What goes through a foot nothing measures: it is tried with its shapes beside all gears.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.discrepancy.by_evidence.decide.as_one import as_one, member_of
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.shapes_at_once import shapes_at_once
from ident.discrepancy.by_evidence.decide.state import Found, found_set
from ident.discrepancy.by_evidence.evidence.prepared import Part
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.elastic_gear import link_inertia
from ident.effects.moved_links import slopes_of_links
from ident.signals import low_pass
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_PASSED = (0.2, 0.4)
"""Of the filter's cut-off, that rows and lags pass: a lag's acceleration has noise of the torque in it times
its frequency squared, of which a soft gear bears less; what a stiff one does lies higher."""
_ORDER = 4
_ROUNDS = 8
"""Of what is left at each joint, by which its rows count."""
_LEAST_DAMPED = 0.02
"""Ratio to critical that a gear begins with: one that is damped less shows beside its own resonance alone."""
_DELAY = 3e-3
"""s, D c of a gear of 10 Hz that is damped by a tenth: what the damping's column is in units of."""
_HZ = 10.0
"""Of a gear whose compliance its column is in units of."""
_MOST = 3
"""Places that are begun with at once."""
_FLAT = 1e-9


@dataclass(frozen=True)
class Spring:
    """A gear as the fit of all at once has it.

    Attributes:
        gear: the candidate.
        shape: compliance and damping ratio.
        said: squared compliance over its variance.
    """

    gear: Candidate
    shape: tuple[float, ...]
    said: float


def soft_places(problem: Problem, found: Found, entries: Sequence[Entry]) -> list[Found]:
    """Sets in which links give way at several places; those of a set begin anew.

    Args:
        problem: the data.
        found: the set.
        entries: the vocabulary with its grids.
    """
    soft = [one for one in entries if is_soft(one)]
    gears = list(dict.fromkeys(one.candidate for one in soft if one.candidate.place.joints))
    if not gears:
        return []
    sets = []
    for passed in _PASSED:
        fit = _Fit.of(problem, found, gears, passed)
        springs, _ = fit.springs()
        sets += [_begun(problem, found, springs[:count]) for count in range(2, 1 + min(_MOST, len(springs)))]
    feet = [one for one in soft if not one.candidate.place.joints]
    if springs and feet:
        beside = [fit.springs(one) for one in feet]
        likeliest = int(np.argmin([left for _, left in beside]))
        springs, foot = beside[likeliest][0], feet[likeliest]
        counts = range(1, min(_MOST, 1 + len(springs)))
        sets += [_begun(problem, found, springs[:count], foot) for count in counts]
    best = max(sets, key=lambda one: one.log_posterior, default=found)
    better = best.log_posterior > found.log_posterior
    return [shapes_at_once(problem, best, soft_members(best))] if better else []


def soft_members(found: Found) -> list[int]:
    """Members with which links give way."""
    return [number for number, one in enumerate(found.members) if is_soft(one.entry)]


def is_soft(entry: Entry) -> bool:
    """Whether links give way with it in proportion to what it carries."""
    places = entry.placed.gives_way
    return bool(places) and all(one.gear.is_linear for one in places)


def _begun(problem: Problem, found: Found, springs: Sequence[Spring], foot: Entry | None = None) -> Found:
    """A set with such places in the stead of its own."""
    kept = [one for one in found.members if not is_soft(one.entry)]
    shapes = [(one.gear, one.shape) for one in springs]
    if foot is not None:
        shapes.append((foot.candidate, foot.placed.shape))
    present, joints = present_with(problem, found_set(problem, kept, found.level, ())), range(problem.rows.n)
    members = (*kept, *(member_of(problem, one, shape, present) for one, shape in shapes))
    one = as_one(problem, found_set(problem, members, found.level, joints))
    return found_set(problem, one.members, one.level, joints)


@dataclass(frozen=True)
class _Columns:
    """Of the fit: rows × joints × k, what is expected of their factors, and how precisely."""

    rows: FloatArray
    expected: FloatArray
    precision: FloatArray

    def beside(self, other: _Columns) -> _Columns:
        return _Columns(
            np.concatenate([self.rows, other.rows], axis=2),
            np.concatenate([self.expected, other.expected]),
            np.concatenate([self.precision, other.precision]),
        )


@dataclass(frozen=True)
class _Fit:
    """Of all gears at once, beside a set without its own."""

    problem: Problem
    gears: Sequence[Candidate]
    units: FloatArray
    cutoff: float
    columns: _Columns
    target: FloatArray

    @classmethod
    def of(cls, problem: Problem, found: Found, gears: Sequence[Candidate], passed: float) -> _Fit:
        rows, robot = problem.rows, problem.prepared.robot
        drives = [one.place.joints[0] for one in gears]
        inertia = np.array([link_inertia(robot, drive) for drive in drives])
        units = 1.0 / (inertia * (2.0 * np.pi * _HZ) ** 2)
        cutoff = passed * robot.identification.cutoff_hz
        present = present_with(problem, found)
        lags = [_lags(part, robot, present, drives, units, cutoff) for part in rows.prepared.parts]
        fit = cls(problem, gears, units, cutoff, _free(np.concatenate(lags)), np.zeros((0, 0)))
        known = _Columns(
            fit.filtered(rows.known.columns), np.zeros(rows.known.precision.size), rows.known.precision
        )
        for one in found.members:
            if not is_soft(one.entry):
                known = known.beside(fit.of_entry(one.entry))
        target = fit.filtered(rows.known.target[:, :, np.newaxis])[:, :, 0]
        return replace(fit, columns=known.beside(fit.columns), target=target)

    def of_entry(self, entry: Entry) -> _Columns:
        """Filtered columns of an effect, in units of its scales."""
        scale = np.array(entry.placed.scale)
        rows = self.filtered(self.problem.rows.thin(entry.placed) * scale)
        return _Columns(
            rows, np.array(entry.placed.centre or np.zeros(scale.size)) / scale, np.ones(scale.size)
        )

    def filtered(self, columns: FloatArray) -> FloatArray:
        """Rows × joints × k through the filter that lags have passed."""
        parts, made = self.problem.prepared.parts, []
        cuts = np.cumsum([part.rows for part in parts])[:-1]
        for part, piece in zip(parts, np.split(columns, cuts), strict=True):
            step = part.finer * _step(part)
            flat = low_pass(piece.reshape(part.rows, -1), self.cutoff, step, _ORDER)
            made.append(flat.reshape(piece.shape))
        return np.concatenate(made)

    def springs(self, foot: Entry | None = None) -> tuple[list[Spring], float]:
        """Gears whose compliance is one that is looked for, the surest first, and log of what is left."""
        columns = self.columns if foot is None else self.of_entry(foot).beside(self.columns)
        value, deviation, left = _solved(columns, self.target, self.problem.prepared.used)
        found, start = [], value.size - 2 * len(self.gears)
        for k, gear in enumerate(self.gears):
            own, inertia = start + 2 * k, 1.0 / (self.units[k] * (2.0 * np.pi * _HZ) ** 2)
            compliance, delay = float(value[own] * self.units[k]), float(value[own + 1] / value[own] * _DELAY)
            soft, damped = gear.shapes
            if soft.grid[0] <= compliance <= soft.upper:
                ratio = 0.5 * delay / np.sqrt(inertia * compliance)
                shape = compliance, float(np.clip(ratio, _LEAST_DAMPED, damped.upper))
                found.append(Spring(gear, shape, float((value[own] / deviation[own]) ** 2)))
        return sorted(found, key=lambda one: -one.said), left


def _free(rows: FloatArray) -> _Columns:
    none = np.zeros(rows.shape[2])
    return _Columns(rows, none, none)


def _step(part: Part) -> float:
    assert part.other.time is not None
    return float(part.other.time[1] - part.other.time[0])


def _lags(
    part: Part, robot: Robot, present: PresentWith, drives: Sequence[int], units: FloatArray, cutoff: float
) -> FloatArray:
    """Rows × joints × 2 of each gear: by its compliance, and by what damping takes off."""
    state, step = part.other, _step(part)
    measured = state if state.measured is None else state.measured
    back = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drives], dtype=np.float64)
    carried = (np.asarray(state.torque) - present.own_torque(measured)) @ back
    rates = [low_pass(carried, cutoff, step, _ORDER) * units]
    for _ in range(3):
        rates.append(np.gradient(rates[-1], step, axis=0))
    made = []
    for k, drive in enumerate(drives):
        slopes = slopes_of_links(present, state, drive, back[:, k])
        course = np.stack([rate[:, k] for rate in rates])
        made += [-slopes.torque(course[:3]), _DELAY * slopes.torque(course[1:])]
    return np.stack(made, axis=2)[:: part.finer]


def _solved(columns: _Columns, target: FloatArray, used: BoolArray) -> tuple[FloatArray, FloatArray, float]:
    """Factors, their deviations, and log of what is left: least squares, joints by what is left at them."""
    rows = [(columns.rows[here, j], target[here, j]) for j, here in enumerate(used.T) if here.any()]
    products = [(one.T @ one, one.T @ right, float(right @ right), right.size) for one, right in rows]
    left = [max(square / count, _FLAT) for *_, square, count in products]
    for _ in range(_ROUNDS):
        normal = np.diag(columns.precision) + sum(p[0] / v for p, v in zip(products, left, strict=True))
        normal += np.diag(_FLAT * np.diag(normal))
        right = columns.precision * columns.expected + sum(
            p[1] / v for p, v in zip(products, left, strict=True)
        )
        value = np.linalg.solve(normal, right)
        left = [
            max((square - 2.0 * value @ p + value @ m @ value) / count, _FLAT * square / count, _FLAT)
            for m, p, square, count in products
        ]
    unlikely = sum(0.5 * count * np.log(v) for v, (*_, count) in zip(left, products, strict=True))
    return value, np.sqrt(np.diag(np.linalg.inv(normal))), float(unlikely)
