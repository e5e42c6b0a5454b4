"""The whole search: gap, where, candidates, name, add, gap again; until the floor or until nothing passes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.base import BaseParameters, base_parameters
from ident.discrepancy.align import TAKEN_BY_ALIGNMENT, aligned, lag_is_known
from ident.discrepancy.clone import with_clone
from ident.discrepancy.decision import Choice, choose
from ident.discrepancy.examination import Examination, examine
from ident.discrepancy.extension import extended, extended_prior
from ident.discrepancy.gap import (
    Gap,
    LoopGap,
    LoopTrace,
    closed_loop_gap,
    position_floor,
    torque_floor,
    torque_gap,
    torque_residual,
)
from ident.discrepancy.library import Library, build_library
from ident.discrepancy.loop_examination import examine_in_loop, loop_gap
from ident.discrepancy.portrait import Portrait, portrait
from ident.discrepancy.present import Present
from ident.discrepancy.prior import Prior
from ident.discrepancy.refine import Component, Refined, refine
from ident.discrepancy.results import Candidate, Diagnosis, DiagnosisVerdict, Finding, FoundParameter
from ident.discrepancy.scene import Scene, make_scene
from ident.discrepancy.scoring import Score
from ident.discrepancy.settings import DEFAULTS, SearchSettings, searching
from ident.discrepancy.shown import shown_values
from ident.discrepancy.unrepeated import Unrepeated, unrepeated
from ident.discrepancy.unrepeating_noise import noise_beyond_vocabulary
from ident.discrepancy.where import Habitat, habitats
from ident.effects.family import EffectFamily
from ident.effects.gain_drift import WITHOUT_A_NAME
from ident.errors import IdentificationError
from ident.recording import Recording
from ident.regressor import RegressorModel
from ident.whitening import Whitening
from robots.arrays import FloatArray
from robots.description import Robot

_log = logging.getLogger(__name__)

Progress = Callable[[str, float], None]
"""Called with a step in words and the share of the whole that is done, 0 to 1."""

AT_REVERSALS = (
    "static_friction",
    "stribeck_friction",
    "hysteresis",
    "backlash",
    "joint_elasticity",
)
"""Effects that may show at reversals alone, which are looked at in closed loop."""

_FORMS = tuple(family.name for family in WITHOUT_A_NAME)

_SURE = 5.0
"""Standard deviations by which a parameter differs from zero to be simulated."""

_RANKED = 12
"""Candidates that a finding lists."""


@dataclass(frozen=True)
class Question:
    """What is asked of the search.

    Attributes:
        robot: the arm.
        fit: recordings that names and parameters are taken from.
        validation: recordings that the gap is shown on, never fitted.
        families: the vocabulary to choose from.
        prior: a function that gives the prior of a base set; None to search after a refit.
        model: the model that is examined; the arm's usual one where None.
        settings: thresholds.
        at_reversals: look at reversals and standstills, too, where the loop can be simulated.
    """

    robot: Robot
    fit: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    families: tuple[EffectFamily, ...]
    prior: Callable[[BaseParameters], Prior] | None = None
    model: RegressorModel | None = None
    settings: SearchSettings = DEFAULTS
    at_reversals: bool = True


def _silent(step: str, share: float) -> None:
    """Nobody watches."""


def diagnose(question: Question, progress: Progress = _silent) -> Diagnosis:
    """Find, name and add what the model lacks.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    if not question.fit or not question.validation:
        raise IdentificationError("the search needs one recording to fit and another to validate")
    progress("filter", 0.0)
    robot = searching(question.robot, question.fit[0])
    model = question.model or RegressorModel.of(robot)
    robot = aligned(RegressorModel(robot, model.effects), _scenes(robot, question.fit))
    scenes = _scenes(robot, question.fit)
    base = base_parameters(RegressorModel(robot, model.effects))
    prior = question.prior(base) if question.prior else None
    search = _Search(question, _Step.of(base, scenes, prior), scenes, progress)
    return search.run()


@dataclass(frozen=True)
class _Step:
    """The present model, examined."""

    base: BaseParameters
    prior: Prior | None
    examination: Examination
    present: Present
    plain: BaseParameters
    """The model before anything was found."""

    @classmethod
    def of(
        cls,
        base: BaseParameters,
        scenes: Sequence[Scene],
        prior: Prior | None,
        before: _Step | None = None,
        whitening: Whitening | None = None,
        start: FloatArray | None = None,
    ) -> _Step:
        if before is not None:
            whitening = before.examination.whitening
        plain = base if before is None else before.plain
        if before is not None and before.examination.loop is not None:
            assert start is not None
            examination = examine_in_loop(base, scenes, prior, start, before.examination)
            standard = base.standard_from(examination.beta, base.model.prior())
            return cls(base, prior, examination, Present(base.model, standard), plain)
        examination = examine(base, scenes, prior, whitening)
        standard = base.standard_from(examination.beta, base.model.prior())
        return cls(
            base, prior, with_clone(examination, standard, plain), Present(base.model, standard), plain
        )

    def in_loop(self) -> _Step | None:
        """The same model in closed loop; None where the recordings or the model have none."""
        scenes = self.examination.scenes
        if not lag_is_known(self.base.model.robot) or any(scene.period is None for scene in scenes):
            return None
        try:
            examination = examine_in_loop(self.base, scenes, self.prior, self.examination.beta)
        except IdentificationError as error:
            _log.info("not examined in closed loop: %s", error)
            return None
        standard = self.base.standard_from(examination.beta, self.base.model.prior())
        return _Step(self.base, self.prior, examination, Present(self.base.model, standard), self.plain)


class _Search:
    """One run of the search over the recordings of a question."""

    def __init__(
        self, question: Question, step: _Step, scenes: tuple[Scene, ...], progress: Progress
    ) -> None:
        self.question = question
        self.step = step
        self.first = step
        self.scenes = scenes
        self.progress = progress
        robot = step.base.model.robot
        self.validation = _scenes(robot, question.validation)
        self.findings: list[Finding] = []
        self.form = ""
        """What the residual is, where it has a form without a name."""

    def run(self) -> Diagnosis:
        """Search, name, add; again and again."""
        choice = self._search(self._families(), self.question.settings.most)
        in_loop = self.step.in_loop() if self._at_reversals() else None
        if in_loop is not None:
            moving = self.step
            self.step = in_loop
            reversing = [family for family in self.question.families if family.name in AT_REVERSALS]
            self._search(reversing, 1)
            if self.step is in_loop:
                self.step = moving
        self.progress("gap", 0.95)
        return self._answer(choice)

    def _at_reversals(self) -> bool:
        """Whether to look there: where motion has shown nothing that has a name or a form."""
        if not self.question.at_reversals or self.findings or self.form:
            return False
        strange = unrepeated(self.step.examination, _row_time(self.scenes[0]))
        return all(item.kind == "shocks" for item in strange)

    def _search(self, families: Sequence[EffectFamily], most: int) -> Choice | None:
        """Until nothing more passes."""
        choice: Choice | None = None
        while len(self.findings) < most:
            self.progress("candidates", 0.1 + 0.8 * len(self.findings) / most)
            library = build_library(self.step.examination, families, self.step.present)
            if not self.findings and not self.step.examination.repeats:
                self._measure_noise(library)
                library = build_library(self.step.examination, families, self.step.present)
            if not library.trials:
                break
            choice = choose(self.step.examination, library, self.step.present, self.question.settings)
            if choice.chosen is None or not self._worth_naming(choice):
                break
            forms = [t for t in choice.chosen.trials if t.family.name in _FORMS]
            if forms:
                self.form = f"drive {forms[0].place.joints[0] + 1} has {forms[0].family.sentence}"
                break
            self._add(choice.chosen, choice)
        return choice

    def _measure_noise(self, library: Library) -> None:
        """Start again with the noise that the vocabulary leaves, where nothing repeats to tell it from."""
        whitening = noise_beyond_vocabulary(self.step.examination, library)
        self.step = _Step.of(self.step.base, self.scenes, self.step.prior, None, whitening)
        self.first = self.step

    def _families(self) -> tuple[EffectFamily, ...]:
        present = {effect.name for effect in self.step.base.model.effects[: len(self._usual())]}
        with_prior, known = self.step.prior is not None, lag_is_known(self.question.robot)
        return tuple(
            family
            for family in (*self.question.families, *(WITHOUT_A_NAME if self.question.prior else ()))
            if (with_prior or not (family.needs_prior or family.name in present))
            and (known or family.name not in TAKEN_BY_ALIGNMENT)
        )

    def _usual(self) -> tuple[object, ...]:
        return self.first.base.model.effects

    def _worth_naming(self, choice: Choice) -> bool:
        """A candidate that explains too little of what the data show is not its name.

        What rests on the prior is no part of that: a changed parameter shows in the prior's rows.
        """
        assert choice.chosen is not None
        settings, rows = self.question.settings, self.step.examination.torque.shape[0]
        beyond_misfit = choice.excess - settings.misfit_of(self.step.examination) * rows
        of_data = 1.0 - min(trial.prior_share for trial in choice.chosen.trials)
        return bool(choice.chosen.gain >= settings.explained * of_data * beyond_misfit)

    def _add(self, chosen: Score, choice: Choice) -> None:
        components = [Component.of(trial) for trial in chosen.trials]
        refined = refine(self.step.examination, components, self.step.present)
        before = self.step
        more = int(sum(seen.sum() for seen in refined.seen))
        after = _Step.of(
            extended(before.base, refined.effects, refined.seen),
            self.scenes,
            extended_prior(before.prior, more),
            before,
            start=np.concatenate([before.examination.beta, *_shown_values(refined)]),
        )
        gap, picture = self._torque_gap(before, after), self._portrait(before, after)
        for position, effect in enumerate(refined.effects):
            self.findings.append(self._finding(position, refined, chosen, choice, gap, picture))
            _log.info("found %s at %s", effect.name, effect.place)
        self.step = after

    def _finding(
        self,
        position: int,
        refined: Refined,
        chosen: Score,
        choice: Choice,
        gap: Gap,
        picture: Portrait,
    ) -> Finding:
        effect = refined.effects[position]
        family = chosen.trials[position].family
        return Finding(
            effect=effect.name,
            sentence=effect.sentence,
            scope=effect.place.scope,
            joints=tuple(joint + 1 for joint in effect.place.joints),
            parameters=_parameters(self.step, family, position, refined),
            p_value=choice.p_value,
            score=chosen.value,
            threshold=choice.threshold,
            held_out_gain=_closed_share(gap),
            indistinguishable_from=tuple(_candidate(score, choice.excess) for score in choice.alike),
            mode="refit" if self.step.prior is None else "prior",
            gap=gap,
            placed=effect,
            portrait=picture,
            ranking=tuple(_candidate(score, choice.excess) for score in choice.ranking[:_RANKED]),
        )

    def _torque_gap(self, before: _Step, after: _Step) -> Gap:
        if after.examination.loop is not None:
            found = loop_gap(
                self.validation,
                after.examination.loop.lengths,
                ((before.base, _shown(before)), (after.base, _shown(after))),
            )
            if found is not None:
                return found
        return Gap(
            torque_gap(before.base, _shown(before), self.validation),
            torque_gap(after.base, _shown(after), self.validation),
            torque_floor(after.base, _shown(after), self.validation),
        )

    def _portrait(self, before: _Step, after: _Step) -> Portrait:
        first, last = (
            [scene.thin(torque_residual(step.base, _shown(step), scene)) for scene in self.validation]
            for step in (before, after)
        )
        torques = [scene.torque - residual for scene, residual in zip(self.validation, first, strict=True)]
        places = habitats(self.validation, first, torques)
        return portrait(self.validation, first, last, torques, places)

    def _answer(self, choice: Choice | None) -> Diagnosis:
        examination = self.step.examination
        strange = unrepeated(examination, _row_time(self.scenes[0]))
        places = self._habitats()
        verdict = self._verdict(choice, strange)
        position, signal, loop, reason = self._loop_gaps()
        return Diagnosis(
            verdict=verdict,
            findings=tuple(self.findings),
            description=_description(verdict, places, strange, self.form),
            habitats=places,
            unrepeated=strange,
            torque=self._torque_gap(self.first, self.step),
            position=position,
            control_signal=signal,
            loop_reason=reason,
            loop=loop,
            base=self.step.base,
            beta=examination.beta,
            covariance=_covariance(examination),
            examinations=(self.first.examination, examination),
        )

    def _verdict(self, choice: Choice | None, strange: Sequence[Unrepeated]) -> DiagnosisVerdict:
        if any(finding.indistinguishable_from for finding in self.findings):
            return "ambiguous"
        if self.findings:
            return "named"
        rows = self.step.examination.torque.shape[0]
        settings, examination = self.question.settings, self.step.examination
        named = settings.unnamed_share + settings.misfit_of(examination) - settings.smallest_share
        if choice is not None and choice.excess > named * rows:
            return "unnamed"
        return "unnamed" if strange or self.form else "clean"

    def _habitats(self) -> tuple[Habitat, ...]:
        beta = self.step.examination.beta
        residuals = [scene.thin(torque_residual(self.step.base, beta, scene)) for scene in self.scenes]
        torques = [scene.thin(self.step.base.columns(scene.measured) @ beta) for scene in self.scenes]
        return habitats(self.scenes, residuals, torques)

    def _loop_gaps(self) -> tuple[Gap | None, Gap | None, LoopTrace | None, str]:
        before, reason = self._loop_gap(self.first)
        after, reason_after = self._loop_gap(self.step)
        if before is None or after is None:
            return None, None, None, reason or reason_after
        floor = position_floor(self.validation)
        none = np.full_like(floor, np.nan)
        return (
            Gap(before.position, after.position, floor),
            Gap(before.control_signal, after.control_signal, none),
            LoopTrace(self.validation[0].recording.time, before.error, after.error),
            "",
        )

    def _loop_gap(self, step: _Step) -> tuple[LoopGap | None, str]:
        standard = step.base.standard_from(_shown(step), step.base.model.prior())
        return closed_loop_gap(step.base, standard, self.validation)


def _scenes(robot: Robot, recordings: Sequence[Recording]) -> tuple[Scene, ...]:
    """Scenes one after the other, as if recorded without a pause."""
    scenes, started = [], 0.0
    for recording in recordings:
        scenes.append(make_scene(robot, recording, started - float(recording.time[0])))
        started += float(recording.time[-1] - recording.time[0])
    return tuple(scenes)


def _row_time(scene: Scene) -> float:
    return scene.recording.sample_time * scene.decimation


def _shown_values(refined: Refined) -> list[FloatArray]:
    """Per effect, the parameters that the data show, as far as nature allows them."""
    found = []
    parts = zip(refined.effects, refined.linear, refined.linear_sigma, refined.seen, strict=True)
    for effect, values, sigma, seen in parts:
        lowest, highest = np.array(effect.bounds).T
        # One that is hardly determined was found by a small step, and may be far off where it is not small.
        sure = np.abs(values) >= _SURE * sigma
        sure |= not sure.any()  # What was named is there, though how it divides up is not sure.
        found.append(np.where(sure, np.clip(values, lowest, highest), 0.0)[seen])
    return found


def _shown(step: _Step) -> FloatArray:
    return shown_values(step.examination)


def _covariance(examination: Examination) -> FloatArray:
    """Of β̂ (b, b): rows are white and of unit variance up to what is left unexplained."""
    residual = examination.residual
    left = float(residual @ residual / max(1, residual.size - examination.beta.size))
    scale = np.linalg.norm(examination.instruments, axis=0)
    z = examination.instruments / scale
    inverse = np.linalg.inv(z.T @ z) / np.outer(scale, scale)
    return np.asarray(max(1.0, left) * inverse)


def _closed_share(gap: Gap) -> float:
    """Share of the explainable gap (energy, in units of the gap before) that is closed."""
    before, after = gap.explainable(gap.before), gap.explainable(gap.after)
    unit = np.where(np.isfinite(gap.floor) & (gap.floor > 0), gap.floor, 1.0)
    whole = float(np.sum((before / unit) ** 2))
    return float(1.0 - np.sum((after / unit) ** 2) / whole) if whole else 0.0


def _parameters(
    step: _Step, family: EffectFamily, position: int, refined: Refined
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


def _description(
    verdict: DiagnosisVerdict, places: Sequence[Habitat], strange: Sequence[Unrepeated], form: str
) -> str:
    """What is left, in words, where it has no name."""
    if verdict != "unnamed":
        return ""
    if form:
        return form
    if strange:
        return "; ".join(item.sentence for item in strange)
    worst = max(places, key=lambda place: place.strongest[1] * place.rms)
    return f"the residual follows no effect of the vocabulary; {worst.sentence()}"
