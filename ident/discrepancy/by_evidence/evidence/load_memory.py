"""Friction of a load in a model that does not say how late it follows: columns of a memory.

A film of lubricant follows its load some milliseconds late. A model that was accepted with a friction of the
load can have been fitted where that did not show, or hold it as a term, which has no past. What an unchanged
arm then leaves, at its reversals most of all, is no effect that the model lacks: as with the lag between the
channels, the memory is a factor of every model, normal about none, with a usual
lubricant's as its deviation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.loop import FINE
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.effects import State
from ident.effects.gear_load import MEMORY, followed
from ident.effects.placed import Placed
from ident.effects.simulated import FrictionTorque
from ident.effects.vocabulary import form_of
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from robots.arrays import FloatArray


@dataclass(frozen=True)
class _Late(Present):
    """A model as friction takes it that follows its load late."""

    def link_torque(self, state: State) -> FloatArray:
        return followed(super().link_torque(state), state.time, MEMORY)


def memory_columns(prepared: Prepared, base: BaseParameters, present: Present) -> FloatArray:
    """Rows × joints × effects: what a memory changes of each friction that follows its load at once.

    Args:
        prepared: the recordings; columns are those of the other periods' motion, as of a lag.
        base: the model.
        present: the same, asked for its loads.
    """
    late = _Late(present.model, present.standard)
    columns = [np.zeros((*prepared.torque.shape, 0))]
    for effect, own in base.model.columns_of_effects:
        values = present.standard[own]
        if not (isinstance(effect, Placed) and any(map(_at_once, effect.simulated(values).friction))):
            continue
        form = form_of(prepared.robot, effect.name, effect.shape_names)
        both = [form.effect(prepared.robot, effect.place, effect.shape, one) for one in (present, late)]
        before, after = (np.concatenate([part.columns(one) for part in prepared.parts]) for one in both)
        columns.append(((after - before) @ values)[:, :, np.newaxis])
    return np.concatenate(columns, axis=2)


def simulated_memory(evidence: LoopEvidence) -> FloatArray:
    """The same in the simulated loop, rows × drives × loads.

    Raises:
        IdentificationError: the loop cannot be simulated with it.
    """
    friction = evidence.parts.extra.friction
    rows = {tuple(one.load_row) for one in friction if one.load_row is not None and _at_once(one)}
    columns = [np.zeros((*evidence.loop.measured().shape, 0))]
    for row in sorted(rows):
        late = tuple(
            replace(one, load_memory=MEMORY)
            if one.load_row is not None and tuple(one.load_row) == row and _at_once(one)
            else one
            for one in friction
        )
        parts = replace(evidence.parts, extra=replace(evidence.parts.extra, friction=late))
        runs = evidence.loop.run(parts, FINE)
        change = evidence.loop.torque(runs) - evidence.loop.torque(evidence.run(FINE))
        columns.append(change[:, :, np.newaxis])
    return np.concatenate(columns, axis=2)


def _at_once(torque: FrictionTorque) -> bool:
    return torque.load_row is not None and torque.load_memory <= 0.0
