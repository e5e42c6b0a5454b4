"""The motion that tells apart what a finding cannot be told from, and what no motion tells apart."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.diagnosis.apart import PlanSettings, TellingApart, Unsettled, pairs_of
from daq.diagnosis.settled_by import settled_by
from ident.discrepancy import Diagnosis, Finding
from ident.discrepancy.before_after import Stage, stages
from ident.discrepancy.component import inner
from ident.effects.entry import joint_words
from ident.effects.family import EffectFamily, PlacedEffect, Shape
from ident.effects.vocabulary import family_named, hidden_from_motion
from ident.parameters.present import Present
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Motion, PlanError, TrajectoryError
from trajectories.discriminate import Discrimination, discriminate
from trajectories.information.separation import Separation
from trajectories.motions.sampled import sampled_motion

_MOST = 4
"""Candidates that one motion is planned for; more make a worse motion for each pair."""

_PARTS = 2
"""Of a motion: one is fitted, one judges."""

TOLD_APART = 0.95
"""Canonical correlation above which a pair stays as good as one effect on a motion."""

WORTH_DRIVING = 0.5
"""Share of the probability that names have to hold which a motion tells from all others: if it holds less, it
would more likely than not leave the name open."""


@dataclass(frozen=True)
class _Explanation:
    """One way to explain the misfit: its words, how likely it is, and the effect."""

    words: str
    probability: float
    effect: PlacedEffect


def tell_apart(
    robot: Robot,
    diagnosis: Diagnosis,
    settings: PlanSettings,
    progress: Callable[[float, float], None] | None = None,
) -> tuple[TellingApart, ...]:
    """Plan one motion for each ambiguous finding.

    Args:
        robot: the arm with the limits that the motion has to keep.
        diagnosis: of the search.
        settings: how to plan.
        progress: told the share that is done and the score.

    A motion that cannot be planned (a collision mesh is missing, home is not allowed, no way leads there) is
    missing alone, with the reason.
    """
    models, before = stages(diagnosis), _recorded(diagnosis)
    return tuple(
        _for_finding(robot, models[number - 1], number, finding, settings, before, progress)
        for number, finding in enumerate(diagnosis.findings, start=1)
        if finding.indistinguishable_from
    )


def _recorded(diagnosis: Diagnosis) -> Motion | None:
    """The motion of the first fitted recording, by its references; None where there are none."""
    recordings = [piece.recording for found in diagnosis.examinations[:1] for piece in found.prepared]
    if not recordings or recordings[0].reference is None:
        return None
    time = recordings[0].time
    return sampled_motion(time - time[0], recordings[0].reference)


def _for_finding(
    robot: Robot,
    stage: Stage,
    number: int,
    finding: Finding,
    settings: PlanSettings,
    before: Motion | None,
    progress: Callable[[float, float], None] | None,
) -> TellingApart:
    rivals = finding.indistinguishable_from[: _MOST - 1]
    words = f"{finding.effect} ({joint_words(finding.joints)})"
    named = _Explanation(words, finding.probability, finding.placed)
    everything = (named, *(_Explanation(one.words(), one.probability, one.placed) for one in rivals))
    try:
        return _planned(robot, stage, number, everything, settings, before, progress)
    except TrajectoryError as error:
        return TellingApart(number, tuple(one.words for one in everything), (), (), str(error))


def _planned(
    robot: Robot,
    stage: Stage,
    number: int,
    everything: Sequence[_Explanation],
    settings: PlanSettings,
    before: Motion | None,
    progress: Callable[[float, float], None] | None,
) -> TellingApart:
    words, names = tuple(one.words for one in everything), {one.effect.name for one in everything}
    everything = [_away_from_limits(stage, one, names) for one in everything]
    kept, unsettled = [everything[0]], []
    for other in everything[1:]:
        # Two rivals that no motion tells apart are one to it: the others can be told from it all the same.
        hidden = ((one, _hidden_from_motion(robot, stage, one, other, settings)) for one in kept)
        like, why = next(((one, why) for one, why in hidden if why is not None), (other, None))
        if why is None:
            kept.append(other)
        else:
            unsettled.append(_unsettled(like, other, why))
    if len(kept) < 2 or not _settles(everything, unsettled):
        return TellingApart(number, words, (), tuple(unsettled))
    parts = _parts(robot, stage, kept, settings, before, progress)
    by_words, pairs = {one.words: one for one in kept}, [after for _, after in pairs_of(parts)]
    for pair in pairs:
        if pair.correlation > TOLD_APART:
            first, second = by_words[pair.first], by_words[pair.second]
            unsettled.append(_unsettled(first, second, _too_similar(pair)))
    # A motion that leaves the name open is not offered: what is to be changed on the arm is asked for.
    return TellingApart(number, words, parts if _settles(everything, unsettled) else (), tuple(unsettled))


def _settles(everything: Sequence[_Explanation], unsettled: Sequence[Unsettled]) -> bool:
    """Whether most of the probability is that of names which are told from every other one."""
    left_open = {words for pair in unsettled for words in (pair.first, pair.second)}
    told = sum(one.probability for one in everything if one.words not in left_open)
    return told > WORTH_DRIVING * sum(one.probability for one in everything)


def _parts(
    robot: Robot,
    stage: Stage,
    kept: Sequence[_Explanation],
    settings: PlanSettings,
    before: Motion | None,
    progress: Callable[[float, float], None] | None,
) -> tuple[Discrimination, ...]:
    """The part to fit and the one to validate."""
    parts = []
    for number in range(_PARTS):
        own = replace(settings, seed=settings.seed + number)

        def told(share: float, score: float, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / _PARTS, score)

        parts.append(_discriminate(robot, stage, kept, own, settings.evaluations, before, told))
    return tuple(parts)


def _away_from_limits(stage: Stage, one: _Explanation, names: Collection[str]) -> _Explanation:
    """A form that has another candidate in its limit, with the nearest shapes of its grids.

    On a motion that does not tell them apart a form may well be fitted with a shape at which it is that
    limit, and no motion tells those apart. Grids stay away from limits.
    """
    robot = stage.base.model.robot
    present = Present(stage.base.model, stage.base.standard_from(stage.beta, stage.base.model.prior()))
    effect, family = one.effect, _form_of(robot, one.effect)
    if set(family.contains) & set(names):
        shapes = family.shapes(robot, effect.place)
        values = tuple(map(_nearest_of_grid, shapes, effect.shape))
        effect = family.effect(robot, effect.place, values, present)
    return replace(one, effect=effect)


def _form_of(robot: Robot, effect: PlacedEffect) -> EffectFamily:
    """The form of a candidate's name that has its shapes."""
    for form in family_named(effect.name).nested:
        if {shape.name for shape in form.shapes(robot, effect.place)} == set(effect.shape_names):
            return form
    return family_named(effect.name)


def _nearest_of_grid(shape: Shape, value: float) -> float:
    return min(shape.grid, key=lambda one: abs(inner(shape, one) - inner(shape, value)))


def _unsettled(first: _Explanation, second: _Explanation, why: str) -> Unsettled:
    return Unsettled(first.words, second.words, why, settled_by((first.effect.name, second.effect.name)))


def _too_similar(pair: Separation) -> str:
    return f"correlation {pair.correlation:.3f} even on the motion that tells them apart best"


def _hidden_from_motion(
    robot: Robot, stage: Stage, first: _Explanation, second: _Explanation, settings: PlanSettings
) -> str | None:
    """Why no motion shows the difference; None where one may."""
    if _declared_hidden(first, second):
        return "while the arm moves both make the same torque"
    try:
        _discriminate(robot, stage, (first, second), settings, evaluations=1)
    except PlanError as error:
        if error.constraint == "candidates":
            return str(error)
        if error.constraint != "separation":
            raise
    return None


def _declared_hidden(first: _Explanation, second: _Explanation) -> bool:
    """Whether the two are at one place, of names that no motion tells apart."""
    one, other = first.effect, second.effect
    same = set(one.place.joints) <= set(other.place.joints) or set(other.place.joints) <= set(
        one.place.joints
    )
    return same and hidden_from_motion(one.name, other.name)


def _discriminate(
    robot: Robot,
    stage: Stage,
    explanations: Sequence[_Explanation],
    settings: PlanSettings,
    evaluations: int,
    before: Motion | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Discrimination:
    return discriminate(
        robot,
        stage.base,
        [(one.effect,) for one in explanations],
        cycle_time=robot.bus.cycle_time,
        duration=settings.duration,
        seed=settings.seed,
        names=[one.words for one in explanations],
        before=before,
        known=_known(stage),
        every_row=any(family_named(one.effect.name).shows == "reversal" for one in explanations),
        conditions=settings.conditions,
        evaluations=evaluations,
        periods=settings.periods,
        progress=progress,
    )


def _known(stage: Stage) -> FloatArray | None:
    """(b, b) information that the prior has; None without one."""
    if stage.prior is None:
        return None
    covariance = stage.prior.covariance
    held = np.isfinite(np.diag(covariance))
    known = np.zeros_like(covariance)
    known[np.ix_(held, held)] = np.linalg.inv(covariance[np.ix_(held, held)])
    return known
