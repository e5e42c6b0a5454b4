"""All trials side by side: every family at every place with every shape, partialled out of the present model.

Everything that the search asks later (single effects, pairs, what noise alone would give) follows from
the products of these columns with each other and with the residual.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.examination import Examination
from ident.effects.family import EffectFamily, Place, PlacedEffect
from ident.parameters.present import Present
from ident.statistics.symmetric import eigen_of
from robots.arrays import BoolArray, FloatArray, IntArray

_IN_SPAN = 1e-3
"""A column of which less than this share (of its norm) is outside the present model's span says nothing."""

_ACTS = 0.05
"""Share of a trial's energy on a joint's rows from which on it acts there."""

_NOTHING = 1e-30
"""A column this small is what an exponential leaves far from where it acts."""


@dataclass(frozen=True)
class Trial:
    """One family at one place with one set of shape values, and where its columns are in the library.

    ``parameters`` (p, columns) makes the effect's parameters of factors of its columns there, which are
    orthonormal and as many as the data can see.
    """

    family: EffectFamily
    place: Place
    effect: PlacedEffect
    start: int
    end: int
    shapes: int
    parameters: FloatArray
    prior_share: float
    """Share of its columns' energy that is in the rows of the prior: how much it rests on them."""

    @property
    def columns(self) -> slice:
        return slice(self.start, self.end)

    @property
    def key(self) -> tuple[str, tuple[int, ...]]:
        """What a finding names: the family and the joints."""
        return self.family.name, self.place.joints


@dataclass(frozen=True)
class Library:
    """Trials with their columns' products.

    Attributes:
        trials: those that the data can see at all.
        gram: (m, m) products of the columns.
        score: (m,) their products with the residual.
        columns: (N, m) partialled out, orthonormal within each trial; none where they are approximate, and
            those of what leads will be simulated.
    """

    trials: tuple[Trial, ...]
    gram: FloatArray
    score: FloatArray
    columns: FloatArray

    def with_effects(
        self,
        examination: Examination,
        effects: Sequence[tuple[EffectFamily, PlacedEffect]],
        exact: bool = True,
    ) -> Library:
        """The library with trials of further shapes at its end."""
        trials, blocks, scores = list(self.trials), [self.columns], [self.score]
        start = self.columns.shape[1]
        placed = [effect for _, effect in effects]
        columns = at_once(lambda effect: partialled(examination, effect, exact), placed)
        for (family, effect), beyond in zip(effects, columns, strict=True):
            if beyond is None:
                continue
            basis, parameters = orthonormal(beyond)
            end = start + basis.shape[1]
            shapes = len(family.shapes(examination.base.model.robot, effect.place))
            share = prior_share(basis, examination.data_rows)
            trials.append(Trial(family, effect.place, effect, start, end, shapes, parameters, share))
            blocks.append(basis.astype(np.float32))
            scores.append(basis.T @ examination.residual)
            start = end
        matrix = _side_by_side(blocks, self.columns.shape[0])
        gram = (matrix.T @ matrix).astype(np.float64)
        return Library(tuple(trials), gram, np.concatenate(scores), matrix)

    def joints_of(self, trials: Sequence[Trial], joint_of_rows: IntArray) -> BoolArray:
        """(n,) joints on whose rows trials act: those with a twentieth of the energy of one, at least."""
        acts = np.zeros(int(joint_of_rows.max()) + 1, dtype=np.bool_)
        for trial in trials:
            squares = np.sum(
                self.columns[: joint_of_rows.size, trial.columns].astype(np.float64) ** 2, axis=1
            )
            energy = np.bincount(joint_of_rows, squares, acts.size)
            acts |= energy >= _ACTS * energy.sum()
        return acts

    def without_trials(self) -> Library:
        """An empty one on the same rows."""
        none = self.columns[:, :0]
        return Library((), np.zeros((0, 0)), np.zeros(0), none)


def build_library(
    examination: Examination,
    families: Sequence[EffectFamily],
    present: Present,
    found: Collection[tuple[str, tuple[int, ...]]] = (),
    settled: Collection[int] = (),
) -> Library:
    """Evaluate every trial at the instruments' motion and partial the present model out of it.

    Args:
        examination: the present model on the recordings.
        families: whose effects are tried.
        present: the present model, for effects that ask it for torques.
        found: effects and joints (from 0) that the model has already; there is no second one there, but of
            effects that come in waves.
        settled: joints that are left out.
    """
    trials: list[Trial] = []
    blocks: list[FloatArray] = []
    scores = [np.zeros(0)]
    data = examination.data_rows
    robot = examination.base.model.robot
    start = 0
    for family in families:
        for place in family.places(robot):
            twice = (family.name, place.joints) in found and not family.several
            if twice or set(place.joints) & set(settled):
                continue
            shapes = family.shapes(robot, place)
            grid = list(product(*(shape.grid for shape in shapes)))
            effects = [family.effect(robot, place, values, present) for values in grid]
            for effect, beyond in zip(effects, _beyond(examination, effects), strict=True):
                if beyond is None:
                    continue
                basis, parameters = orthonormal(beyond)
                blocks.append(basis.astype(np.float32))
                scores.append(basis.T @ examination.residual)  # of the whole matrix it would be made double
                end = start + basis.shape[1]
                share = prior_share(basis, data)
                trials.append(Trial(family, place, effect, start, end, len(shapes), parameters, share))
                start = end
    matrix = _side_by_side(blocks, examination.torque.shape[0])
    gram = (matrix.T @ matrix).astype(np.float64)
    if examination.simulations:
        matrix = matrix[:, :0].copy()  # what leads is simulated: those columns take the place of these
    return Library(tuple(trials), gram, np.concatenate(scores), matrix)


def _side_by_side(blocks: list[FloatArray], rows: int) -> FloatArray:
    """Columns (rows, all) of blocks in single precision; the list is emptied, so that none is there twice."""
    matrix = np.empty((rows, sum(block.shape[1] for block in blocks)), dtype=np.float32)
    end = matrix.shape[1]
    while blocks:
        block = blocks.pop()
        matrix[:, end - block.shape[1] : end] = block
        end -= block.shape[1]
    return matrix


def _beyond(examination: Examination, effects: Sequence[PlacedEffect]) -> list[FloatArray | None]:
    """Of effects at one place, the whitened columns (N, p) beyond the present model."""
    counts = [len(effect.parameters) for effect in effects]
    white = examination.screened(effects)
    cuts = np.cumsum(counts)[:-1]
    beyond = examination.rough.partial_out(white)
    pairs = zip(np.split(white, cuts, axis=1), np.split(beyond, cuts, axis=1), strict=True)
    return [_seen(before, after) for before, after in pairs]


def prior_share(basis: FloatArray, data_rows: int) -> float:
    """Share of the energy of orthonormal columns (N, r) that is in the rows after the data."""
    return float(np.sum(basis[data_rows:] ** 2) / basis.shape[1])


def partialled(examination: Examination, effect: PlacedEffect, exact: bool = True) -> FloatArray | None:
    """An effect's whitened columns (N, p) beyond the present model; None where nothing is beyond it.

    Args:
        examination: of the present model.
        effect: of the vocabulary.
        exact: in closed loop, by simulation; else about.
    """
    white = examination.columns_of(effect, exact)
    if white is None:
        return None
    return _seen(white, (examination if exact else examination.rough).partial_out(white))


def _seen(white: FloatArray, beyond: FloatArray) -> FloatArray | None:
    """Columns beyond the present model, zero where they are hardly there; None where all are."""
    before = np.sqrt(np.einsum("rp,rp->p", white, white))
    if not np.isfinite(before).all() or not (before > _NOTHING).any():
        return None
    beyond[:, np.linalg.norm(beyond, axis=0) <= np.maximum(_IN_SPAN * before, _NOTHING)] = 0.0
    return beyond if beyond.any() else None


def orthonormal(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Basis (N, r) of columns (N, p), and (p, r) that makes their factors of the basis's."""
    scale = np.maximum(np.sqrt(np.einsum("rp,rp->p", columns, columns)), 1e-300)
    unit = np.ascontiguousarray(columns / scale)
    squares, vectors = eigen_of(unit.T @ unit)
    values = np.sqrt(np.maximum(squares, 0.0))
    seen = values > _IN_SPAN * values[-1]
    factors = vectors[:, seen] / values[seen]
    return unit @ factors, factors / scale[:, np.newaxis]
