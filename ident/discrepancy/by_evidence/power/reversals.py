"""The smallest size of what shows at reversals alone: asked of the simulated loop, where the search looks.

Rows of the moving arm leave reversals out. In a simulation of the arm under the references that are planned
the effect answers as it will in the search's own; noise is that of the drives' torque. How dry friction turns
its sign is chosen by the recordings before anything is looked for, and takes of the effect what is like it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.peaks import tried_at
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.problem import usual_misfit
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows, expected_rows, noise_of
from ident.discrepancy.by_evidence.evidence.noise import Noise
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.discrepancy.by_evidence.power.smallest import CHANCE, Smallest, smallest_sizes
from ident.discrepancy.loop import FINE, Loop, Standstill
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_parts import simulated_parts
from ident.discrepancy.prepared_recording import prepared_recordings
from ident.discrepancy.presliding import standstill_of, usual_standstill
from ident.discrepancy.prior import Prior
from ident.discrepancy.settings import searching
from ident.effects import FrictionSign
from ident.effects.simulated import Bristle, SoftConstraint
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray

_log = logging.getLogger(__name__)

_STEP = 1.25
"""Times the way over which dry friction turns its sign, to learn what that changes."""


@dataclass(frozen=True)
class SeenInLoop:
    """What earlier recordings have shown of the drives.

    Attributes:
        noise: of each drive's torque at the loop's rows.
        standstill: how each drive's dry friction turns its sign; as gears usually do where None.
    """

    noise: tuple[Noise, ...]
    standstill: Standstill | None = None


@dataclass(frozen=True)
class AsKnown:
    """An arm as it is known before it moves.

    Attributes:
        base: its model.
        prior: of the parameters.
        values: they themselves (b,).
        seen: of its drives.
    """

    base: BaseParameters
    prior: Prior | None
    values: FloatArray
    seen: SeenInLoop


def sizes_at_reversals(
    known: AsKnown,
    motion: Sequence[Recording],
    wanted: Sequence[Candidate],
    chance: float = CHANCE,
) -> tuple[Smallest, ...]:
    """Of effects that show at reversals alone; none where the loop is not looked at, or not simulated.

    Args:
        known: the arm.
        motion: with the references that it is to follow; the torque in it is not read.
        wanted: the vocabulary on this arm.
        chance: as of :func:`.smallest.smallest_sizes`.
    """
    robot = searching(known.base.model.robot, motion[0])
    base = base_parameters(RegressorModel(robot, known.base.model.effects))
    alone = [one for one in wanted if one.family.shows == "reversal"]
    try:
        loop = Loop.of(base.model, prepared_recordings(robot, motion))
        standstill = known.seen.standstill or usual_standstill(robot)
        rows = expected_rows(loop, base, known.prior, known.values, standstill, known.seen.noise)
    except IdentificationError as error:
        _log.info("no sizes at reversals: %s", error)
        return ()
    rows = rows.exactly()
    misfit = usual_misfit(known.seen.noise)
    present = PresentWith(rows.loop.present, (), apart=True)
    entries = [entry for one in alone for entry in tried_at(rows, one, [_quickest(one)], present)]
    return smallest_in_loop(rows, Level(misfit, np.ones_like(misfit)), entries, chance)


def smallest_in_loop(
    rows: LoopRows, level: Level, entries: Sequence[Entry], chance: float = CHANCE, judged: float = 1.0
) -> tuple[Smallest, ...]:
    """Of some effects, which the loop alone has to be sure of.

    Args:
        rows: of the loop, in which they were simulated.
        level: of its misfit.
        entries: the effects; of a name that form answers that says most.
        chance, judged: as of :func:`.smallest.smallest_sizes`.
    """
    columns = _of_standstill(rows.loop)
    if columns is not None:
        known = rows.known
        whole = np.concatenate([known.columns, columns[:, :, np.newaxis]], axis=2)
        rows = replace(rows, known=replace(known, columns=whole, precision=np.r_[known.precision, 1.0]))
    entries = [replace(one, white=rows.effect(one.placed)) for one in entries]
    entries.sort(key=lambda one: -one.white.count)
    return smallest_sizes(rows, level, (), entries, SURE, chance, judged, by_fit=SURE)


def _of_standstill(loop: LoopEvidence) -> FloatArray | None:
    """What turning its sign e times as slowly changes of the drives' torque, rows × drives."""
    slower = tuple(_slower(one, _STEP) for one in loop.standstill)
    parts = simulated_parts(loop.loop, loop.base, loop.present.standard, slower)
    change = loop.change_to(parts, FINE)
    return None if change is None else np.asarray(change / np.log(_STEP))


def _slower(
    one: Bristle | FrictionSign | SoftConstraint, times: float
) -> Bristle | FrictionSign | SoftConstraint:
    """The same law with its way, its speed or its time so many times as large."""
    if isinstance(one, Bristle):
        return replace(one, length=times * one.length)
    if isinstance(one, FrictionSign):
        return replace(one, width=times * one.width)
    return replace(one, width=times * one.width, time=times * one.time)


def _quickest(candidate: Candidate) -> tuple[float, ...]:
    """The shape that acts for the shortest way, with which the search begins."""
    return tuple(shape.grid[0] for shape in candidate.shapes)


def seen_in_loop(
    base: BaseParameters, values: FloatArray, recordings: Sequence[Recording]
) -> SeenInLoop | None:
    """What recordings show of the drives; None where nothing repeats, or they are not simulated.

    Args:
        base: the model.
        values: its parameters (b,).
        recordings: of the arm.
    """
    robot = searching(base.model.robot, recordings[0])
    base = base_parameters(RegressorModel(robot, base.model.effects))
    try:
        loop = Loop.of(base.model, prepared_recordings(robot, recordings))
        return SeenInLoop(noise_of(loop), standstill_of(loop, base, values))
    except IdentificationError as error:
        _log.info("the loop is not looked at: %s", error)
        return None
