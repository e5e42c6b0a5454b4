"""The model of an arm with the effects that a search has found: made again from plain values.

A model file or the catalogue holds of such an effect its name, its place and its shape, and the values of
all parameters. Some effects follow the torque of the rest of the model (a delay, a gear that gives way); they
get it from these values, those found before them included, as in the search. So the columns of a night do not
depend on what that night's recording makes of the parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.effects.entry import EffectEntry
from ident.effects.found import Found
from ident.errors import IdentificationError
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.description import Robot


@dataclass(frozen=True)
class FoundModel:
    """What is known of a model with found effects.

    Attributes:
        source: where it is from, for messages.
        usual: names of its other effects, in column order.
        found: the effects that were found, in the order of the findings.
        values: base parameters by name, SI.
        covariance: of the parameters of what was found, by two names each; empty where it is not known.
    """

    source: str
    usual: tuple[str, ...]
    found: tuple[EffectEntry, ...]
    values: Mapping[str, float]
    covariance: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        source: str,
        effects: tuple[str, ...],
        found: tuple[EffectEntry, ...],
        values: Mapping[str, float],
    ) -> FoundModel:
        """Out of the names of all its effects, those that were found last."""
        return cls(source, effects[: len(effects) - len(found)], found, values)


def extended_model(robot: Robot, known: FoundModel) -> RegressorModel:
    """The arm's usual model with the effects that were found.

    Args:
        robot: the arm, with the settings of the identification.
        known: of the model that they were found in.

    Raises:
        IdentificationError: the model is not one of this arm with these settings, or this arm cannot have
            one of the effects; one line that begins with the source.
    """
    model = _usual(robot, known)
    base = base_parameters(model)
    standard = base.standard_from(_values_of(base.names, known), model.prior())
    for entry in known.found:
        # Imported here: the search stands on the identification, and most identifications need none of it.
        from ident.effects.vocabulary import effect_from
        from ident.parameters.present import Present

        try:
            placed = effect_from(robot, entry, Present(model, standard))
        except IdentificationError as error:
            raise IdentificationError(f"{known.source}: {error}") from None
        effect = Found.of(placed, model.names, entry.source)
        kept = tuple(one.name in known.values for one in effect.parameters)
        if not any(kept):
            wanted = ", ".join(one.name for one in effect.parameters)
            raise IdentificationError(
                f"{known.source}: has {entry.name} without a parameter; allowed: {wanted}"
            )
        model = RegressorModel(robot, (*model.effects, effect.keeping(kept)))
        found = [known.values.get(one.name, 0.0) for one in effect.parameters]
        standard = np.concatenate([standard, found])
    return model


def found_entries(model: RegressorModel) -> tuple[EffectEntry, ...]:
    """The effects of a model that were found, as plain values."""
    found = [effect for effect in model.effects if isinstance(effect, Found)]
    if not found:
        return ()
    from ident.effects.vocabulary import entry_of  # every effect and the compiler, which load slowly

    return tuple(entry_of(model.robot, effect) for effect in found)


def end_to_end(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings whose time runs on from one to the next, from zero: what warms up does not cool between."""
    moved, started = [], 0.0
    for recording in recordings:
        time = recording.time - recording.time[0]
        moved.append(replace(recording, time=time + started))
        started += float(time[-1])
    return tuple(moved)


def _usual(robot: Robot, known: FoundModel) -> RegressorModel:
    usual = RegressorModel.of(robot)
    names = [effect.name for effect in usual.effects]
    for name in known.usual:
        if name not in names:
            raise IdentificationError(
                f"{known.source}: has {name}; allowed: a model of {robot.name} with the settings of now, of"
                f" {', '.join(names)}"
            )
    return RegressorModel(robot, tuple(effect for effect in usual.effects if effect.name in known.usual))


def _values_of(names: tuple[str, ...], known: FoundModel) -> np.ndarray:
    for name in names:
        if name not in known.values:
            raise IdentificationError(
                f"{known.source}: has no parameter {name}; allowed: a model of the arm as it is described now"
            )
    return np.array([known.values[name] for name in names])
