"""What a motion would show, before anything moves: from its positions, the noise and what is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.by_evidence.accepted import prior_of, widened
from ident.discrepancy.by_evidence.decide.instruments import fitted_motion, predicted
from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.peaks import tried_at
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.problem import Problem, misfit_basis, pose, usual_misfit
from ident.discrepancy.by_evidence.decide.state import Found, Member
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.known import known_columns
from ident.discrepancy.by_evidence.evidence.noise import Noise
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, prepare, settings_for
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry, candidates, library
from ident.discrepancy.by_evidence.power.odds import Key
from ident.discrepancy.by_evidence.power.reversals import (
    AsKnown,
    SeenInLoop,
    seen_in_loop,
    sizes_at_reversals,
)
from ident.discrepancy.by_evidence.power.smallest import CHANCE, Smallest, smallest_sizes
from ident.discrepancy.prior import Prior
from ident.effects.family import EffectFamily, PresentModel
from ident.effects.vocabulary import VOCABULARY
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot

CHANNELS: Key = ("lag between the channels", ())
"""What a delay is not told from where it is estimated."""

_DEPTHS = (0.1, 0.2, 0.3)
"""Of a joint's way, from either end: where something may stand that it presses against."""


@dataclass(frozen=True)
class KnownBefore:
    """What is known of an arm before it moves.

    Attributes:
        noise: per joint, of rows at the rate of the search.
        prior: of the base parameters; None for what this very motion shows of them.
        in_loop: of the drives; the noise of the joints where None.
    """

    noise: tuple[Noise, ...]
    prior: Prior | None = None
    in_loop: SeenInLoop | None = None


@dataclass(frozen=True)
class BesideModel:
    """What sizes are asked beside: of a problem all but its rows, which are large.

    Attributes:
        base, prior, start, present: as of :class:`Problem`.
        noise: per joint, of rows.
    """

    base: BaseParameters
    prior: Prior | None
    start: FloatArray
    present: Present
    noise: tuple[Noise, ...]

    @classmethod
    def of(cls, problem: Problem) -> BesideModel:
        """Without its rows."""
        return cls(problem.base, problem.prior, problem.start, problem.present, problem.rows.noise)


def known_from_run(robot: Robot, recordings: Sequence[Recording]) -> KnownBefore:
    """From the run that a model is accepted on.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    settled = settings_for(robot, recordings[0])
    base = base_parameters(RegressorModel.of(settled))
    problem = pose(base, None, fitted_motion(base, None, recordings), None)
    prior = prior_of(problem)
    return KnownBefore(problem.rows.noise, prior, seen_in_loop(base, prior.values, recordings))


def white_noise(deviation: FloatArray, row_time: float, at: float) -> tuple[Noise, ...]:
    """Noise of rows ``at`` s apart that is as loud per Hz as that of rows ``row_time`` s apart, (n,) N·m."""
    return tuple(Noise(np.zeros(0), float(one)) for one in deviation * np.sqrt(row_time / at))


def row_time_of(robot: Robot, recording: Recording) -> float:
    """s between the rows that the search makes of a recording."""
    return recording.sample_time * settings_for(robot, recording).identification.decimation


def planned_sizes(
    robot: Robot,
    motion: Recording,
    known: KnownBefore,
    families: Sequence[EffectFamily] = VOCABULARY,
    chance: float = CHANCE,
) -> tuple[Smallest, ...]:
    """The smallest size of each effect at each place that a recording of a motion would name rightly.

    Another motion as long judges.

    Args:
        robot: the arm.
        motion: its positions as planned; the torque in it is not read.
        known: noise, and the parameters from before.
        families: the vocabulary.
        chance: of being named.

    Raises:
        IdentificationError: a motion that is too short.
    """
    settled = settings_for(robot, motion)
    base = base_parameters(RegressorModel.of(settled))
    prior = known.prior
    values = base.regroup(base.model.prior()) if prior is None else prior.values
    values = np.where(np.isfinite(values), values, 0.0)
    present = Present(base.model, base.standard_from(values, base.model.prior()))
    prepared = predicted(prepare(settled, (motion,)), present)
    if prior is None:
        prior = _of_this_motion(base, values, prepared, present, known.noise)
    rows = _rows(base, prior, values, prepared, present, known.noise)
    misfit = usual_misfit(known.noise) if prior.misfit is None else prior.misfit
    model = PresentWith(present, (), prepared.apart)
    wanted = candidates(settled, families)
    entries = _vocabulary(rows, wanted, model)
    sizes = smallest_sizes(rows, Level(misfit, np.ones_like(misfit)), (), entries, SURE, chance)
    if not lag_is_known(robot):
        sizes = _beside_alignment(sizes)
    arm = AsKnown(base, prior, values, known.in_loop or SeenInLoop(known.noise))
    return or_less(sizes, sizes_at_reversals(arm, (motion,), wanted, chance))


def sizes_beside(
    model: BesideModel,
    found: Found,
    present: PresentModel,
    wanted: Sequence[Candidate],
    recordings: Sequence[Recording],
    judging: Sequence[Recording],
    lag_known: bool,
) -> tuple[Smallest, ...]:
    """The same of recordings that were searched, beside what was found and stays unexplained in them.

    Asked of the motion that they were to follow: noise of an encoder in a column is no information, but
    the rate of a torque holds a lot of it, and delays would seem to show a tenth as large as they do.

    Args:
        model: without any effect.
        found: the set that the search ended with.
        present: the model with that set.
        wanted: the vocabulary on this arm.
        recordings: that were fitted.
        judging: that were not; taken for as good, for their length.
        lag_known: whether the description says how the channels lie in time.
    """
    robot = model.base.model.robot
    prepared = predicted(prepare(robot, [_as_asked(one) for one in recordings]), model.present)
    rows = _rows(model.base, model.prior, model.start, prepared, model.present, model.noise)
    members = tuple(_on(rows, member) for member in found.members)
    judged = share_that_judges(judging, recordings)
    entries = _vocabulary(rows, wanted, present)
    sizes = smallest_sizes(rows, found.level, members, entries, SURE, judged=judged)
    return sizes if lag_known else _beside_alignment(sizes)


def or_less(sizes: Sequence[Smallest], others: Sequence[Smallest]) -> tuple[Smallest, ...]:
    """Of each effect at each place what is named with less."""
    also = {(one.name, one.joints): one for one in others}

    def least(one: Smallest) -> Smallest:
        other = also.pop((one.name, one.joints), one)
        return other if other.tells_more_than(one) else one

    return (*map(least, sizes), *also.values())


def _vocabulary(rows: Rows, wanted: Sequence[Candidate], present: PresentModel) -> tuple[Entry, ...]:
    """The library, and what begins at a position, at some that the motion passes."""
    passed = np.concatenate([part.at_rows.position for part in rows.prepared.parts])
    corners = [one for one in wanted if one.over == "corner"]
    pressed = [tried_at(rows, one, _passed(one, passed), present) for one in corners]
    return (*library(rows, wanted, present), *(entry for some in pressed for entry in some))


def _passed(candidate: Candidate, position: FloatArray) -> list[tuple[float, float]]:
    """Corner and side, so deep within a joint's way (rows, n) as something is that it presses against."""
    (joint,), (corner, sides) = candidate.place.joints, candidate.shapes
    low, high = float(position[:, joint].min()), float(position[:, joint].max())
    grid = np.array(corner.grid)
    where = {
        (
            float(
                grid[np.argmin(np.abs(grid - (high if side > 0.0 else low) + side * depth * (high - low)))]
            ),
            side,
        )
        for depth, side in product(_DEPTHS, sides.grid)
    }
    return sorted(one for one in where if low < one[0] < high)


def _beside_alignment(sizes: Sequence[Smallest]) -> tuple[Smallest, ...]:
    """Where nobody says how the channels lie in time, what is late is taken for that, whatever its size."""
    taken = {family.name for family in VOCABULARY if family.taken_by_alignment}
    return tuple(
        replace(one, size=np.inf, torque=np.inf, torque_share=np.inf, rival=CHANNELS)
        if one.name in taken
        else one
        for one in sizes
    )


def share_that_judges(judging: Sequence[Recording], fitted: Sequence[Recording]) -> float:
    """Information of recordings that judge, as a share of that of those that are fitted: by their length."""

    def duration(recordings: Sequence[Recording]) -> float:
        return sum(one.sample_time * len(one.time) for one in recordings)

    return duration(judging) / duration(fitted)


def _as_asked(recording: Recording) -> Recording:
    reference = recording.position if recording.reference is None else recording.reference
    return replace(recording, position=reference)


def _on(rows: Rows, member: Member) -> Member:
    """A member with its columns on other rows."""
    entry = member.entry
    return Member(replace(entry, white=rows.effect(entry.placed)), member.volume)


def _rows(
    base: BaseParameters,
    prior: Prior | None,
    values: FloatArray,
    prepared: Prepared,
    present: Present,
    noise: tuple[Noise, ...],
) -> Rows:
    known, _ = known_columns(prepared, base, prior, values, present)
    return Rows(prepared, known, misfit_basis(prepared, present), noise)


def _of_this_motion(
    base: BaseParameters, values: FloatArray, prepared: Prepared, present: Present, noise: tuple[Noise, ...]
) -> Prior:
    """The prior that a model accepted on a clean run of this motion is: as :func:`prior_of` makes it."""
    rows = _rows(base, None, values, prepared, present, noise)
    misfit = usual_misfit(noise)
    posterior = Gram(rows, ()).posterior(Level(misfit, np.ones_like(misfit)))
    b = values.size
    covariance = widened(values, posterior.covariance[:b, :b])
    return Prior(values, covariance, "this motion", np.array([one.marginal for one in noise]), misfit)
