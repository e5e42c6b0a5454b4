"""The columns of the rows: the base regressor along a motion, through the decimation filter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ident.decimation import decimate, decimate_index, decimate_seen, decimation_stages
from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    CurrentOffset,
    Effect,
    RigidBody,
    RotorInertia,
    State,
    ViscousFriction,
    WristCoupling,
)
from ident.effects.found import Found
from ident.long_stage import LongStage
from ident.parameters.base import BaseParameters, random_states
from ident.preparation.observed_torque import load_torque, observed_torque
from ident.preparation.row_memory import one_after_the_other
from ident.recording import Recording
from ident.signals import Motion
from robots.arrays import FloatArray, IntArray
from robots.description import Identification

_VALUES_AT_ONCE = 1_000_000
"""Filtered together: bounds the memory of the decimation on long records."""

_SMOOTH = (RigidBody, RotorInertia, ViscousFriction, CurrentOffset)
"""Effects that look at each sample alone and have no jump."""

_WITHOUT_HISTORY = (*_SMOOTH, CoulombFriction, AsymmetricFriction, WristCoupling)
"""Effects that look at each sample alone."""

_SAMPLES_AT_ONCE = 400
"""Samples at which the regressor is evaluated together: a piece of it stays in the cache."""

_LONG = 200_000
"""Samples of a motion that is decimated at once: 0.3 GB of columns for six axes."""

_FORGOTTEN = 128
"""Rows after which the decimation filter has forgotten the end of a record, to rounding."""

_STATES = 64
"""Random states that show which columns are zero by structure."""

_FOLDED = 1e-5
"""Noise of accelerations that may be folded into the rows, beside the one that is in them."""

_Columns = tuple[Effect, IntArray, IntArray]
"""An effect, which base parameters are its own, and which of its columns they are."""


def columns_of(
    base: BaseParameters, recording: Recording, moved: Motion, settings: Identification
) -> FloatArray:
    """The base regressor of a motion through the decimation filter: samples × joints × b.

    Args:
        base: the base parameters, one column each.
        recording: its torque and load are for effects that ask for them.
        moved: of the recording, or of its simulation.
        settings: filters and decimation.
    """
    torque = None
    if any(isinstance(effect, Found) for effect in base.model.effects):
        whole = settings.model_copy(update={"decimation": 1})
        torque = observed_torque(base.model.robot, recording, whole)
        torque += load_torque(base.model.robot, recording, whole)
    state = State(moved.position, moved.velocity, moved.acceleration, moved.time, torque, recording.load)
    return _columns(base, state, settings, recording.sample_time)


def _columns(base: BaseParameters, state: State, settings: Identification, sample_time: float) -> FloatArray:
    if settings.decimation == 1:
        return base.columns(state)
    step = sufficient_step(settings, sample_time)
    if state.position.shape[0] > _LONG and _without_history(base.model.effects):
        return _long_columns(base, state, settings, step)
    return _columns_at_once(base, state, settings, step)


def sufficient_step(settings: Identification, sample_time: float) -> int:
    """Of how many samples one is enough for what follows smoothly from the low-passed positions.

    What is above half of the lower rate is folded into the pass band of the rows. The low-pass of the
    positions leaves 1/(1 + w²ᴺ) of their noise at w times the cut-off, and of accelerations w² times that.
    """
    if settings.decimation_filter != "chebyshev":
        return 1  # the finite one lets a thousandth through, which the sum over all samples averages out
    rate, factor = 1.0 / sample_time, decimation_stages(settings.decimation)[0]
    for step in range(factor, 1, -1):
        folded = rate / step - 0.4 * rate / factor
        times = np.tan(np.pi * folded / rate) / np.tan(np.pi * settings.cutoff_hz / rate)
        if factor % step == 0 and times**2 / (1.0 + times ** (2 * settings.filter_order)) < _FOLDED:
            return step
    return 1


def _columns_at_once(base: BaseParameters, state: State, settings: Identification, step: int) -> FloatArray:
    samples, joints = state.position.shape
    thin = np.zeros((len(base.names), joints, decimate_index(samples, settings.decimation).size))
    of_all = base.columns_of_effects
    stage = LongStage.of(samples, decimation_stages(settings.decimation)[0], step)
    if step > 1 and stage is not None:
        seen, smooth = stage.seen, [one for one in of_all if isinstance(one[0], _SMOOTH)]
        fewer = State(state.position[seen], state.velocity[seen], state.acceleration[seen])
        _fill(thin, base, smooth, fewer, lambda rows: decimate_seen(rows, stage, settings.decimation))
        of_all = tuple(one for one in of_all if not isinstance(one[0], _SMOOTH))
    kind = settings.decimation_filter
    _fill(thin, base, of_all, state, lambda rows: decimate(rows, settings.decimation, kind, axis=1))
    return thin.transpose(2, 1, 0)


def _fill(
    thin: FloatArray,
    base: BaseParameters,
    of: Sequence[_Columns],
    state: State,
    decimated: Callable[[FloatArray], FloatArray],
) -> None:
    """Write the decimated columns of effects, b × joints × rows."""
    joint, column, series = _series(base, of, state)
    columns = max(1, _VALUES_AT_ONCE // series.shape[1])
    for start in range(0, joint.size, columns):
        part = slice(start, start + columns)
        thin[column[part], joint[part]] = decimated(series[part])


def _long_columns(base: BaseParameters, state: State, settings: Identification, step: int) -> FloatArray:
    """The same of a long motion, block by block, each with ends that the filter has forgotten in its core."""
    kept = decimate_index(state.position.shape[0], settings.decimation)
    rows = max(_LONG // settings.decimation // 2, 4 * _FORGOTTEN)
    parts = []
    for first in range(0, kept.size, rows):
        last = min(first + rows, kept.size)
        begin = kept[first - _FORGOTTEN] if first > _FORGOTTEN else 0
        end = min(last + _FORGOTTEN, kept.size)
        part = slice(begin, kept[end - 1] + 1)  # its last sample is kept, as that of every record is
        piece = State(state.position[part], state.velocity[part], state.acceleration[part])
        found = _columns_at_once(base, piece, settings, step)
        parts.append(found[len(found) - (end - first) : len(found) - (end - last)])
    return one_after_the_other(parts)


def _series(
    base: BaseParameters, of: Sequence[_Columns], state: State
) -> tuple[IntArray, IntArray, FloatArray]:
    """Joint and base parameter of the columns of effects that are not zero by structure, and these as rows,
    so that each is a run of memory for the filter. Evaluated piece by piece, since a piece stays in the
    cache; an effect with a history sees the whole motion at once.
    """
    samples = state.position.shape[0]
    alone = [number for number, (effect, _, _) in enumerate(of) if _without_history([effect])]
    places, whole = _places(base, of, state)
    ends = np.cumsum([0, *(joint.size for joint, _ in places)])
    series = np.empty((ends[-1], samples))
    for number, columns in whole.items():
        series[ends[number] : ends[number + 1]] = columns
    for start in range(0, samples if alone else 0, _SAMPLES_AT_ONCE):
        part = slice(start, start + _SAMPLES_AT_ONCE)
        piece = State(state.position[part], state.velocity[part], state.acceleration[part])
        for number in alone:
            effect, _, own = of[number]
            joint, column = places[number]
            series[ends[number] : ends[number + 1], part] = effect.columns(piece)[:, joint, own[column]].T
    empty = np.empty(0, dtype=np.int64)
    names = [one[1][column] for one, (_, column) in zip(of, places, strict=True)]
    return np.concatenate([empty, *(joint for joint, _ in places)]), np.concatenate([empty, *names]), series


def _places(
    base: BaseParameters, of: Sequence[_Columns], state: State
) -> tuple[list[tuple[IntArray, IntArray]], dict[int, FloatArray]]:
    """Joint and own column of what is not zero of each effect; of one with a history also the columns."""
    sight = random_states(base.model.robot, 0, _STATES)
    places, whole = [], {}
    for number, (effect, _, own) in enumerate(of):
        alone = _without_history([effect])
        columns = effect.columns(sight if alone else state)[:, :, own]
        joint, column = np.nonzero(columns.any(axis=0))
        places.append((joint, column))
        if not alone:
            whole[number] = columns[:, joint, column].T
    return places, whole


def _without_history(effects: Iterable[Effect]) -> bool:
    return all(isinstance(effect, _WITHOUT_HISTORY) for effect in effects)
