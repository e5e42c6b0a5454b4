"""Effects that were found, and that a refit cannot tell from the rest of the model.

Against a prior a payload or a wrong drive gain is told from the parameters of the links. An identification
has no prior: there such an effect lies in the span of the other columns, and the parameters take it up. What
they take up of it is kept, so that a model with the effect and one without can be compared.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.effects.found import Found
from ident.listing import listed
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation.observation import Rows
from ident.statistics.restricted import independent_whitening
from robots.arrays import FloatArray
from robots.description import Robot

_SPANNED = 1e-6
"""A column with less than this share of it beside the others depends on them."""

_REFITTED = 0.1
"""The same of an effect that only a prior tells: what is left would be known to a tenth of what is there."""


@dataclass(frozen=True)
class TakenUp:
    """What of the effects that were found is not identified.

    Attributes:
        names: (k,) parameters of theirs that are left out.
        factors: (b, k) what a unit of each adds to the base parameters that are identified.
        sentences: for the user.
    """

    names: tuple[str, ...] = ()
    factors: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    sentences: tuple[str, ...] = ()


def without_taken_up(
    base: BaseParameters, rows: Rows, known: Collection[str] = ()
) -> tuple[BaseParameters, Rows, TakenUp]:
    """The model less what these rows do not tell of its found effects, and the rows of what is left.

    Args:
        base: of a model with found effects.
        rows: all columns of it.
        known: parameters of effects whose size is known before: these are taken up only where the columns of
            the others make up for theirs exactly.
    """
    found = [effect for effect in base.model.effects if isinstance(effect, Found)]
    plain = len(base.names) - sum(sum(effect.kept) for effect in found)
    omega = independent_whitening(rows.torque, rows.regressor[:, :, :plain], rows.segment, rows.used)
    columns = (rows.regressor / omega.sigma[:, np.newaxis])[rows.used]
    size = np.linalg.norm(columns, axis=0)
    unit = columns / np.where(size > 0.0, size, 1.0)
    basis = np.linalg.qr(unit[:, :plain][:, size[:plain] > 0.0])[0]
    told, kept, sentences = np.ones(len(base.names), dtype=np.bool_), [], []
    start = plain
    for effect in found:
        end = start + sum(effect.kept)
        before = any(parameter.name in known for parameter in effect.parameters)
        least = _SPANNED if before else _REFITTED
        own, basis = _told(base.model.robot, effect, basis, unit[:, start:end], least)
        told[start:end] = own
        if not own.all():
            sentences.append(_sentence(effect, base.names[start:end], own, seen=bool(size[start:end].any())))
        if own.any():
            flags = iter(own.tolist())
            kept.append(effect.keeping(tuple(has and next(flags) for has in effect.kept)))
        start = end
    if told.all():
        return base, rows, TakenUp()
    model = RegressorModel(base.model.robot, (*base.model.effects[: -len(found)], *kept))
    scale = np.where(size[told] > 0.0, size[told], 1.0)
    solved = np.linalg.lstsq(columns[:, told] / scale, columns[:, ~told], rcond=None)[0]
    factors: FloatArray = np.asarray(solved / scale[:, np.newaxis], dtype=np.float64)
    names = tuple(name for name, own in zip(base.names, told, strict=True) if not own)
    rest = replace(rows, regressor=rows.regressor.transpose(2, 1, 0)[told].transpose(2, 1, 0))
    return base_parameters(model), rest, TakenUp(names, factors, tuple(sentences))


def _told(
    robot: Robot, effect: Found, basis: FloatArray, columns: FloatArray, least: float
) -> tuple[np.ndarray, FloatArray]:
    """(m,) which columns of unit norm the rows tell from the basis before them, and the basis with these.

    Of an effect that only a prior tells, one of them by at least a share of itself.
    """
    from ident.effects.vocabulary import form_of  # loads every effect and the compiler

    family = form_of(robot, effect.name, effect.shape_names)
    own, wider, largest = [], basis, 0.0
    for column in columns.T:
        rest = column - basis @ (basis.T @ column)
        largest = max(largest, float(np.linalg.norm(rest)))
        rest = column - wider @ (wider.T @ column)
        rest -= wider @ (wider.T @ rest)
        left = float(np.linalg.norm(rest))
        own.append(left > _SPANNED)
        if own[-1]:
            wider = np.column_stack([wider, rest / left])
    place = iter(own)
    whole = [has and next(place) for has in effect.kept]
    none = any(not whole[index] for index in family.essential) or (family.needs_prior and largest < least)
    return (np.zeros(len(own), dtype=np.bool_), basis) if none else (np.array(own, dtype=np.bool_), wider)


def _sentence(effect: Found, names: Sequence[str], own: np.ndarray, *, seen: bool) -> str:
    what = f"{effect.name.replace('_', ' ')} ({effect.place.words})"
    if not seen:
        return f"{what} does not show in these recordings; the model that is identified is without it"
    if own.any():
        lost = listed([name for name, is_told in zip(names, own, strict=True) if not is_told])
        what = f"{lost} of {what}"
    return f"{what}: without a prior the other parameters take it up; it is in their values now"
