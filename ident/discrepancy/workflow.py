"""The whole search: gap, where, candidates, name, add, gap again; until the floor or until nothing passes."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from ident.discrepancy.accepted import Accepted, confusable_with_found, joints_not_told
from ident.discrepancy.align import aligned, lag_is_known
from ident.discrepancy.basis import ranking_of
from ident.discrepancy.course import Course
from ident.discrepancy.decision import Choice, choose
from ident.discrepancy.library import Library, build_library
from ident.discrepancy.prepared_recording import PreparedRecording, prepared_recordings
from ident.discrepancy.question import Progress, Question
from ident.discrepancy.residual_dependence import dependences_beside
from ident.discrepancy.results import Candidate, Diagnosis, Finding
from ident.discrepancy.scoring import Score
from ident.discrepancy.settings import searching
from ident.discrepancy.step import LoopStep, Step
from ident.discrepancy.unrepeated import unrepeated
from ident.discrepancy.unrepeating_noise import noise_beyond_vocabulary
from ident.discrepancy.validation import Validation
from ident.discrepancy.verdict import Left, description, lags_of_noise, loop_does_otherwise, verdict_of
from ident.effects.family import EffectFamily
from ident.effects.gain_drift import UNNAMED_FAMILIES
from ident.errors import IdentificationError
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel

_log = logging.getLogger(__name__)

_UNNAMED = tuple(family.name for family in UNNAMED_FAMILIES)


def silent(step: str, share: float) -> None:
    """Nobody watches."""


def diagnose(question: Question, progress: Progress = silent) -> Diagnosis:
    """Find, name and add what the model lacks.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    if not question.fit or not question.validation:
        raise IdentificationError("the search needs one recording to fit and another to validate")
    return Search(question, progress).run()


class Search:
    """One run of the search over the recordings of a question."""

    def __init__(self, question: Question, progress: Progress) -> None:
        progress("filter", 0.0)
        robot = searching(question.robot, question.fit[0])
        model = question.model or RegressorModel.of(robot)
        robot = aligned(RegressorModel(robot, model.effects), prepared_recordings(robot, question.fit))
        prepared = prepared_recordings(robot, question.fit)
        base = base_parameters(RegressorModel(robot, model.effects))
        step = Step.of(base, prepared, question.prior(base) if question.prior else None)
        self.question = question
        self.course = Course.begun(prepared, step)
        self.prepared = prepared
        self.progress = progress
        self.validation = prepared_recordings(robot, question.validation)
        self.settled: set[int] = set()
        """Joints on which nothing more is looked for."""
        self.confusable: set[tuple[str, tuple[int, ...]]] = set()
        """Effects and joints that are no further effect beside what was found there."""
        self.unnamed = ""
        """What the residual is, where an unnamed family explains it."""
        self.choice: Choice | None = None
        """Of the last step in motion."""

    @property
    def step(self) -> Step:
        return self.course.step

    @property
    def findings(self) -> list[Accepted]:
        return self.course.findings

    def run(self) -> Diagnosis:
        """Search, name, add; again and again."""
        self._search_in_motion()
        if self._at_reversals():
            self._search_at_reversals()
        self.progress("gap", 0.95)
        return self._answer()

    def _search_in_motion(self) -> None:
        """What the moving arm shows."""
        self.choice = self._search(self._families(), self.question.settings.most)

    def _ranking(self) -> tuple[Candidate, ...]:
        """Candidates beside the final model, best first."""
        return () if self.choice is None else ranking_of(self.choice)

    def _at_reversals(self) -> bool:
        """Whether to look there: not where it is something else, without a name or without repeats."""
        if (
            not self.question.at_reversals
            or self.unnamed
            or len(self.findings) >= self.question.settings.most
        ):
            return False
        not_repeating = unrepeated(self.step.examination, self.prepared[0].row_time)
        return all(item.kind == "shocks" for item in not_repeating)

    def _search_at_reversals(self) -> None:
        """At most one more finding; a simulated loop that does otherwise, for no known reason, is told."""
        moving, in_loop = self.step, self.step.in_loop()
        if in_loop is None:
            return
        if self._is_the_arm(in_loop):
            self._leave_to_motion()
            self.course.step = self.course.reversing = in_loop
            reversing = [family for family in self.question.families if family.shows != "motion"]
            self._search(reversing, len(self.findings) + 1)
            if self.step is in_loop:
                self.course.step = moving
        if not self.findings and not self._more_than_clean():
            self._tell_loop(in_loop)

    def _tell_loop(self, in_loop: LoopStep) -> None:
        """A simulated loop that leaves more than the model of an arm may is no clean arm's."""
        joint = in_loop.misfit_joint(self.question.settings.unnamed_in_loop)
        if joint is not None:
            self.unnamed = loop_does_otherwise(joint)

    def _leave_to_motion(self) -> None:
        """What findings do at reversals, and joints on which motion leaves more than has a name."""
        if not self.findings:
            return
        self.confusable = confusable_with_found(self.findings)
        self.settled |= joints_not_told(self.findings)
        left, rows = self.step.examination.excess_of_joints, self.step.examination.rows_of_joints
        self.settled |= set(np.flatnonzero(left > self._misfit_threshold_per_row() * rows).tolist())

    def _is_the_arm(self, in_loop: Step) -> bool:
        """Whether the simulated loop does about what the arm does; a small error of a delay can spoil it.

        Where nothing was found in motion, single joints may do otherwise: that is what is looked for.
        """
        examination, limit = in_loop.examination, self.question.settings.not_the_arm_in_loop
        matches = examination.excess <= limit * examination.torque.shape[0]
        if not self.findings:
            of_joints = examination.excess_of_joints / np.maximum(examination.rows_of_joints, 1)
            matches = matches or float(np.median(of_joints)) <= limit
        if not matches:
            _log.info("no look at reversals: the simulated loop does not do what the arm does")
        return bool(matches)

    def _search(self, families: Sequence[EffectFamily], most: int) -> Choice | None:
        """Until nothing more passes."""
        choice: Choice | None = None
        while len(self.findings) < most:
            self.progress("candidates", 0.1 + 0.8 * len(self.findings) / most)
            library = self._library(families)
            if not self.findings and not self.step.examination.repeats:
                self._measure_noise(library)
                library = self._library(families)
            if not library.trials:
                break
            choice = choose(self.step.examination, library, self.step.present, self.question.settings)
            if choice.chosen is not None and self._form_of_found(choice.chosen):
                self.settled |= {joint for trial in choice.chosen.trials for joint in trial.place.joints}
                continue
            if choice.chosen is None or not self._worth_naming(choice):
                break
            unnamed = [t for t in choice.chosen.trials if t.family.name in _UNNAMED]
            if unnamed:
                self.unnamed = f"drive {unnamed[0].place.joints[0] + 1} has {unnamed[0].family.sentence}"
                break
            self.course.add(choice.chosen, choice)
        return choice

    def _library(self, families: Sequence[EffectFamily]) -> Library:
        return build_library(
            self.step.examination, families, self.step.present, self._no_further(), self.settled
        )

    def _no_further(self) -> set[tuple[str, tuple[int, ...]]]:
        """Effects and joints that are no further effect: the model has them, found now or before."""
        return {(effect.name, effect.place.joints) for effect in self.step.placed} | self.confusable

    def _measure_noise(self, library: Library) -> None:
        """Start again with the noise that the vocabulary leaves, where nothing repeats to tell it from."""
        whitening = noise_beyond_vocabulary(self.step.examination, library)
        first = Step.of(self.step.base, self.prepared, self.step.prior, whitening)
        self.course = Course.begun(self.prepared, first)

    def _families(self) -> tuple[EffectFamily, ...]:
        present = {effect.name for effect in self.course.first.base.model.effects}
        with_prior = self.step.prior is not None
        # Where the channels were too far apart to be aligned their delay is what has to be found.
        known = lag_is_known(self.question.robot) or not lag_is_known(self.step.base.model.robot)
        families = tuple(
            family
            for family in (*self.question.families, *(UNNAMED_FAMILIES if self.question.prior else ()))
            if (with_prior or not (family.needs_prior or family.name in present))
            and (known or not family.taken_by_alignment)
        )
        return tuple(form for family in families for form in (family, *family.forms))

    def _worth_naming(self, choice: Choice) -> bool:
        """A candidate that explains too little of what the data show is not its name.

        What rests on the prior is no part of that, unless the data show plenty: then it shows in its rows.
        """
        assert choice.chosen is not None
        plenty = float(self.step.examination.excess_of_joints.sum()) > self._misfit_threshold()
        of_data = 1.0 if plenty else 1.0 - min(trial.prior_share for trial in choice.chosen.trials)
        return bool(choice.chosen.gain >= self.question.settings.explained * of_data * choice.unexplained)

    def _form_of_found(self, chosen: Score) -> bool:
        """Whether it takes away so little beside what was found on its joints that it is that one's form."""
        joints = {joint + 1 for trial in chosen.trials for joint in trial.place.joints}
        beside = [finding.score for finding in self.findings if joints & set(finding.joints)]
        return bool(beside) and chosen.gain < self.question.settings.form_share * max(beside)

    def _answer(self) -> Diagnosis:
        first = self.course.first
        validation = self._validation(self.validation)
        findings, rejected, last = self.course.validated(validation)
        self._look_again(findings)
        margin = first.base.model.robot.identification.torque_margin
        moved_once = self.course.reversing is None and not first.examination.repeats
        nothing = moved_once and lags_of_noise(
            findings,
            self._leaves_the_usual(),
            validation.unexplained(first),
            validation.changes(first, self.step),
            margin,
        )
        if nothing:
            self.course = Course.begun(self.prepared, first)
            findings, rejected, last = [], [*rejected, *findings], validation.loop_run(first)
        examination = self.step.examination
        left = Left(
            dependences_beside(self.step.base, examination.beta, self.prepared),
            unrepeated(examination, self.prepared[0].row_time),
            self.unnamed,
            not nothing and self._more_in_motion(),
            validation.unexplained(self.step),
            margin,
        )
        verdict = verdict_of(findings, left)
        loops = validation.loop_gaps(validation.loop_run(first) if findings else last, last)
        return Diagnosis(
            verdict=verdict,
            findings=tuple(findings),
            rejected=tuple(rejected),
            ranking=self._ranking(),
            unexplained=left.unexplained,
            description=description(verdict, left),
            dependences=left.dependences,
            unrepeated=left.unrepeated,
            torque=validation.gap(first, self.step),
            position=loops.position,
            control_signal=loops.control_signal,
            loop_reason=loops.reason,
            loop=loops.trace,
            base=self.step.base,
            beta=examination.beta,
            covariance=examination.covariance,
            examinations=(first.examination, examination),
        )

    def _validation(self, prepared: tuple[PreparedRecording, ...]) -> Validation:
        """What recordings say of models; drives hold at standstill as they are described."""
        return Validation(prepared, self.course.first.examination.whitening)

    def _leaves_the_usual(self) -> bool:
        """Whether before anything was found rows that are fitted leave no more than an accepted model."""
        return self.course.first.examination.excess <= self._misfit_threshold()

    def _look_again(self, findings: Sequence[Finding]) -> None:
        """What the loop showed has gone again: is the loop then the arm's?"""
        if self.course.reversing is not None and not findings and not self._more_in_motion():
            self._tell_loop(self.course.reversing)

    def _more_in_motion(self) -> bool:
        """Whether the moving arm shows more than noise and the usual misfit."""
        return self.choice is not None and self._more_than_clean()

    def _more_than_clean(self) -> bool:
        """Whether the present model leaves more than the misfit threshold, though it has no name."""
        return bool(self.step.examination.excess > self._misfit_threshold())

    def _misfit_threshold(self) -> float:
        """Residual sum of squares beyond noise from which on a model is not clean."""
        return float(self._misfit_threshold_per_row() * self.step.examination.torque.shape[0])

    def _misfit_threshold_per_row(self) -> float:
        settings = self.question.settings
        return settings.unnamed_share + self.step.examination.misfit(settings) - settings.smallest_share
