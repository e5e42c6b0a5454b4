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
from functools import cached_property

import numpy as np

from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.evidence.prepared import Part
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.elastic_gear import link_inertia
from ident.effects.moved_links import slopes_of_links
from ident.signals import low_pass
from robots.arrays import FloatArray
from robots.description import Robot

_ORDER = 4
_ROUNDS = 8
"""Of what is left at each joint, by which its rows count."""
_LEAST_DAMPED = 0.02
"""Ratio to critical that a gear begins with: one that is damped less shows beside its own resonance alone."""
_DELAY = 3e-3
"""s, D c of a gear of 10 Hz that is damped by a tenth: what the damping's column is in units of."""
_HZ = 10.0
"""Of a gear whose compliance its column is in units of."""
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


@dataclass(frozen=True)
class Columns:
    """Of the fit: rows × joints × k, what is expected of their factors, and how precisely."""

    rows: FloatArray
    expected: FloatArray
    precision: FloatArray

    def beside(self, other: Columns) -> Columns:
        return Columns(
            np.concatenate([self.rows, other.rows], axis=2),
            np.concatenate([self.expected, other.expected]),
            np.concatenate([self.precision, other.precision]),
        )


@dataclass(frozen=True)
class _Products:
    """Of a joint's rows: of the columns with each other and with the target, of the target with itself."""

    square: FloatArray
    right: FloatArray
    target: float
    rows: int

    def left(self, value: FloatArray) -> float:
        """Mean square that factors leave."""
        return float((self.target - 2.0 * value @ self.right + value @ self.square @ value) / self.rows)


@dataclass(frozen=True)
class SpringFit:
    """Of all gears at once, beside a set without its own.

    Attributes:
        problem: the data.
        gears: that are looked for.
        inertia: (gears,) of the links behind each, kg·m² (or kg).
        cutoff: Hz, of the filter that rows and lags have passed.
        columns: what is known, what else the set has, and at the end two of each gear.
        target: rows × joints, through the same filter.
    """

    problem: Problem
    gears: Sequence[Candidate]
    inertia: FloatArray
    cutoff: float
    columns: Columns
    target: FloatArray

    @classmethod
    def of(
        cls,
        problem: Problem,
        present: PresentWith,
        beside: Sequence[Entry],
        gears: Sequence[Candidate],
        passed: float,
    ) -> SpringFit:
        """Along the recordings.

        Args:
            problem: the data.
            present: the model with a set.
            beside: what the set has with which links do not give way.
            gears: all that are looked for.
            passed: of the filter's cut-off, that rows and lags pass.
        """
        rows, robot = problem.rows, problem.prepared.robot
        drives = [one.place.joints[0] for one in gears]
        inertia = np.array([link_inertia(robot, drive) for drive in drives])
        cutoff = passed * robot.identification.cutoff_hz
        units = _units(inertia)
        lags = [_lags(part, robot, present, drives, units, cutoff) for part in rows.prepared.parts]
        fit = cls(problem, gears, inertia, cutoff, _free(np.concatenate(lags)), np.zeros((0, 0)))
        known = Columns(
            fit.filtered(rows.known.columns), np.zeros(rows.known.precision.size), rows.known.precision
        )
        for one in beside:
            known = known.beside(fit.of_entry(one))
        target = fit.filtered(rows.known.target[:, :, np.newaxis])[:, :, 0]
        return replace(fit, columns=known.beside(fit.columns), target=target)

    def of_entry(self, entry: Entry) -> Columns:
        """Filtered columns of an effect, in units of its scales."""
        scale = np.array(entry.placed.scale)
        rows = self.filtered(self.problem.rows.thin(entry.placed) * scale)
        return Columns(
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

    @cached_property
    def products(self) -> list[_Products]:
        """Of each joint that has rows."""
        used = self.problem.prepared.used
        rows = [(self.columns.rows[here, j], self.target[here, j]) for j, here in enumerate(used.T)]
        return [_Products(one.T @ one, one.T @ y, float(y @ y), y.size) for one, y in rows if y.size]

    def products_with(self, foot: Columns) -> list[_Products]:
        """The same with a foot's columns before all others."""
        whole, used = [], self.problem.prepared.used
        for j, own in zip(np.flatnonzero(used.any(axis=0)), self.products, strict=True):
            here = used[:, j]
            rows = foot.rows[here, j]
            across = rows.T @ self.columns.rows[here, j]
            square = np.block([[rows.T @ rows, across], [across.T, own.square]])
            right = np.concatenate([rows.T @ self.target[here, j], own.right])
            whole.append(_Products(square, right, own.target, own.rows))
        return whole

    def springs(self, foot: Columns | None = None) -> tuple[list[Spring], float]:
        """Gears whose compliance is one that is looked for, the surest first, and log of what is left."""
        expected, precision = self.columns.expected, self.columns.precision
        if foot is not None:
            expected = np.concatenate([foot.expected, expected])
            precision = np.concatenate([foot.precision, precision])
        products = self.products if foot is None else self.products_with(foot)
        value, deviation, left = _solved(products, expected, precision)
        found, start, units = [], value.size - 2 * len(self.gears), _units(self.inertia)
        for k, gear in enumerate(self.gears):
            own = start + 2 * k
            compliance, delay = float(value[own] * units[k]), float(value[own + 1] / value[own] * _DELAY)
            soft, damped = gear.shapes
            if soft.grid[0] <= compliance <= soft.upper:
                ratio = 0.5 * delay / np.sqrt(self.inertia[k] * compliance)
                shape = compliance, float(np.clip(ratio, _LEAST_DAMPED, damped.upper))
                found.append(Spring(gear, shape, float((value[own] / deviation[own]) ** 2)))
        return sorted(found, key=lambda one: -one.said), left


def _units(inertia: FloatArray) -> FloatArray:
    """Compliances that columns are in units of."""
    return np.asarray(1.0 / (inertia * (2.0 * np.pi * _HZ) ** 2))


def _free(rows: FloatArray) -> Columns:
    none = np.zeros(rows.shape[2])
    return Columns(rows, none, none)


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


def _solved(
    products: Sequence[_Products], expected: FloatArray, precision: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Factors, their deviations, and log of what is left: least squares, joints by what is left at them."""
    left = [max(one.target / one.rows, _FLAT) for one in products]
    for _ in range(_ROUNDS):
        normal = np.diag(precision) + sum(one.square / v for one, v in zip(products, left, strict=True))
        normal += np.diag(_FLAT * np.diag(normal))
        right = precision * expected + sum(one.right / v for one, v in zip(products, left, strict=True))
        value = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
        left = [max(one.left(value), _FLAT * one.target / one.rows, _FLAT) for one in products]
    unlikely = sum(0.5 * one.rows * np.log(v) for v, one in zip(left, products, strict=True))
    return value, np.asarray(np.sqrt(np.diag(np.linalg.inv(normal)))), float(unlikely)
