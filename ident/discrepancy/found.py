"""What is said of an effect that was found: parameters, gap before and after, what else it could be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.decision import Choice
from ident.discrepancy.gap import Gap, torque_floor, torque_gap, torque_residual
from ident.discrepancy.loop_examination import loop_gap
from ident.discrepancy.portrait import Portrait, portrait
from ident.discrepancy.refined import Refined
from ident.discrepancy.results import Candidate, Finding, FoundParameter
from ident.discrepancy.scene import Scene
from ident.discrepancy.scoring import Score
from ident.discrepancy.step import Step
from ident.discrepancy.where import habitats
from ident.effects.family import EffectFamily

_RANKED = 12
"""Candidates that a finding lists."""


def findings_of(
    step: Step, refined: Refined, choice: Choice, gap: Gap, picture: Portrait
) -> tuple[Finding, ...]:
    """One for each effect that was chosen together, most of it shared.

    Args:
        step: the model that lacks them.
        refined: their parameters.
        choice: why these.
        gap: on validation, before and after.
        picture: where the residual lives.
    """
    return tuple(_finding(step, k, refined, choice, gap, picture) for k in range(len(refined.effects)))


def _finding(
    step: Step, position: int, refined: Refined, choice: Choice, gap: Gap, picture: Portrait
) -> Finding:
    chosen = choice.chosen
    assert chosen is not None
    effect = refined.effects[position]
    family = chosen.trials[position].family
    return Finding(
        effect=effect.name,
        sentence=effect.sentence,
        scope=effect.place.scope,
        joints=tuple(joint + 1 for joint in effect.place.joints),
        parameters=_parameters(step, family, position, refined),
        p_value=choice.p_value,
        score=chosen.value,
        threshold=choice.threshold,
        held_out_gain=_closed_share(gap),
        indistinguishable_from=tuple(_candidate(score, choice.excess) for score in choice.alike),
        mode="refit" if step.prior is None else "prior",
        gap=gap,
        placed=effect,
        portrait=picture,
        ranking=tuple(_candidate(score, choice.excess) for score in choice.ranking[:_RANKED]),
    )


def shown_gap(validation: Sequence[Scene], before: Step, after: Step) -> Gap:
    """Torque gap on validation: of the simulated loop where the step was examined in it, else of the rows."""
    if after.examination.loop is not None:
        found = loop_gap(
            validation,
            after.examination.loop.lengths,
            ((before.base, before.shown), (after.base, after.shown)),
        )
        if found is not None:
            return found
    return Gap(
        torque_gap(before.base, before.shown, validation),
        torque_gap(after.base, after.shown, validation),
        torque_floor(after.base, after.shown, validation),
    )


def portrait_of(validation: Sequence[Scene], before: Step, after: Step) -> Portrait:
    """Where the residual on validation lives before and after."""
    first, last = (
        [scene.thin(torque_residual(step.base, step.shown, scene)) for scene in validation]
        for step in (before, after)
    )
    torques = [scene.torque - residual for scene, residual in zip(validation, first, strict=True)]
    places = habitats(validation, first, torques)
    return portrait(validation, first, last, torques, places)


def _closed_share(gap: Gap) -> float:
    """Share of the explainable gap (energy, in units of the gap before) that is closed."""
    before, after = gap.explainable(gap.before), gap.explainable(gap.after)
    unit = np.where(np.isfinite(gap.floor) & (gap.floor > 0), gap.floor, 1.0)
    whole = float(np.sum((before / unit) ** 2))
    return float(1.0 - np.sum((after / unit) ** 2) / whole) if whole else 0.0


def _parameters(
    step: Step, family: EffectFamily, position: int, refined: Refined
) -> tuple[FoundParameter, ...]:
    effect = refined.effects[position]
    shapes = family.shapes(step.base.model.robot, effect.place)
    linear = zip(
        effect.parameter_names,
        refined.linear[position],
        refined.linear_sigma[position],
        effect.units,
        strict=True,
    )
    shaped = zip(shapes, effect.shape, refined.shape_sigma[position], strict=True)
    return (
        *(FoundParameter(n, float(v), float(s), u, False) for n, v, s, u in linear),
        *(FoundParameter(shape.name, v, float(s), shape.unit, True) for shape, v, s in shaped),
    )


def _candidate(score: Score, excess: float) -> Candidate:
    return Candidate(
        tuple(trial.family.name for trial in score.trials),
        tuple(tuple(joint + 1 for joint in trial.place.joints) for trial in score.trials),
        score.value,
        score.gain / excess if excess > 0 else 0.0,
        tuple(trial.effect for trial in score.trials),
    )
