"""The whole answer: names by evidence, with the sizes, confirmations and reversals that a diagnosis has.

The evidence says which set of effects the moving arm shows. That set is then fitted, shown on recordings that
were not fitted and simulated in closed loop, and reversals, which the evidence of the moving arm leaves out,
are looked at in the simulated loop. So a name is given where two things say so that share nothing but the
recordings: the evidence of the rows that were fitted, and the gap on those that were not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ident.closed_loop.at_once import beside
from ident.discrepancy.align import aligned
from ident.discrepancy.by_evidence.in_loop import InLoop, leaves_the_usual
from ident.discrepancy.by_evidence.in_motion import found_in_motion
from ident.discrepancy.by_evidence.power.planned import or_less, share_that_judges
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.report.answer import EvidenceAnswer
from ident.discrepancy.by_evidence.taken import candidates_of, weighed
from ident.discrepancy.by_evidence.workflow import named_by_evidence
from ident.discrepancy.course import Course
from ident.discrepancy.loop import Standstill
from ident.discrepancy.prepared_recording import PreparedRecording, prepared_recordings
from ident.discrepancy.question import Progress, Question, silent
from ident.discrepancy.residual_dependence import dependences_beside
from ident.discrepancy.results import Diagnosis, Finding
from ident.discrepancy.settings import searching
from ident.discrepancy.step import Step
from ident.discrepancy.unknown_feed_forward import with_feed_forward
from ident.discrepancy.unrepeated import unrepeated
from ident.discrepancy.validation import Validation
from ident.discrepancy.verdict import Left, description, lags_of_noise, verdict_of
from ident.effects.entry import joint_words
from ident.effects.torque_ripple import WITHOUT_GEAR
from ident.errors import IdentificationError
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots.free_memory import give_back


def diagnose_with_evidence(
    question: Question, progress: Progress = silent, sizes: bool = True
) -> tuple[Diagnosis, EvidenceAnswer]:
    """Find, name and add what the model lacks, names by evidence.

    Args:
        question: recordings, model, vocabulary and prior.
        progress: told of each step.
        sizes: whether those that would still be named are asked for, a sixth of the work.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    if not question.fit or not question.validation:
        raise IdentificationError("the search needs one recording to fit and another to validate")
    recordings, notes = with_feed_forward(question.robot, (*question.fit, *question.validation))
    count = len(question.fit)
    question = replace(question, fit=recordings[:count], validation=recordings[count:])
    progress("filter", 0.0)
    course = course_of(question)
    held = prepared_recordings(course.first.base.model.robot, question.validation)
    question = replace(question, standstill=course.first.standstill if question.at_reversals else None)
    answer, sized = named_by_evidence(
        question, lambda step, share: progress(step, 0.6 * share), simulated=False
    )

    def diagnosed() -> tuple[Diagnosis, tuple[Smallest, ...]]:
        loop = _looked_at(question, course, answer)
        progress("gap", 0.98)
        return _answer(question, loop, held), loop.nameable

    (diagnosis, at_reversals), nameable = beside(diagnosed, sized) if sizes else (diagnosed(), ())
    nameable = or_less(nameable, at_reversals) if sizes else ()
    notes = (*notes, *(one.words() for one in answer.refuted), *diagnosis.notes, *_periods(diagnosis))
    return replace(diagnosis, notes=notes), replace(answer, nameable=nameable)


def course_of(question: Question) -> Course:
    """The question's model on its recordings, before anything is found.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    robot = searching(question.robot, question.fit[0])
    effects = (question.model or RegressorModel.of(robot)).effects
    robot = aligned(RegressorModel(robot, effects), prepared_recordings(robot, question.fit))
    prepared = prepared_recordings(robot, question.fit)
    base = base_parameters(RegressorModel(robot, effects))
    return Course.begun(prepared, Step.of(base, prepared, question.prior(base) if question.prior else None))


def _looked_at(question: Question, course: Course, answer: EvidenceAnswer) -> InLoop:
    """What the evidence found, with sizes, and what the simulated loop shows beside it."""
    fitted = validation_of(course, course.prepared, question.standstill)
    judged = share_that_judges(question.validation, question.fit)
    loop = InLoop(found_in_motion(course, answer, fitted), answer, question.families, judged)
    if question.at_reversals and loop.is_worth_a_look():
        loop.look()
    give_back()  # rows of the loop and their vocabulary, which refer to each other
    return loop


def validation_of(
    course: Course, prepared: tuple[PreparedRecording, ...], standstill: Standstill | None
) -> Validation:
    """What recordings say of models, with friction at standstill as fitted recordings show it.

    The description's is a guess: beside its bristles a friction of the load that other motion shows whole
    (1.02 ± 0.01) had −2.6 ± 0.5 of it in the simulated positions of an arm that sticks otherwise. Noise is
    what stays beside all that moves: with a drag in it, that comes at other times in each period, rows were
    nearly differences, and of the drag that closes nine tenths of the gap they showed 1.9 ± 0.7 %.
    """
    return Validation(prepared, course.moving.examination.of_noise, standstill)


def _answer(question: Question, loop: InLoop, held: tuple[PreparedRecording, ...]) -> Diagnosis:
    """What the recordings that were not fitted (``held``) say of the findings, and of what is left."""
    course, answer, first = loop.course, loop.answer, loop.course.first
    validation = validation_of(course, held, loop.standstill or question.standstill)
    findings, rejected, last = course.validated(validation, lambda one: weighed(one, question.robot))
    loop.look_again(findings)
    nothing = _made_by_noise(course, answer, validation, findings)
    if nothing:
        course = Course.begun(course.prepared, first)
        findings, rejected, last = [], [*rejected, *findings], validation.loop_run(first)
    examination = course.step.examination
    left = Left(
        dependences_beside(course.step.base, examination.beta, course.prepared),
        unrepeated(examination, course.prepared[0].row_time),
        loop.unnamed,
        not nothing and loop.more_in_motion(),
        validation.unexplained(course.step),
        first.base.model.robot.identification.torque_margin,
    )
    verdict = verdict_of(findings, left)
    ranking = candidates_of(answer.beside if course.findings else answer.ranking)
    loops = validation.loop_gaps(validation.loop_run(first) if findings else last, last)
    return Diagnosis(
        verdict=verdict,
        findings=tuple(course.with_other_forms(findings)),
        rejected=tuple(rejected),
        ranking=ranking,
        unexplained=left.unexplained,
        description=description(verdict, left, ranking),
        dependences=left.dependences,
        unrepeated=left.unrepeated,
        torque=validation.gap(first, course.step),
        position=loops.position,
        control_signal=loops.control_signal,
        loop_reason=loops.reason,
        loop=loops.trace,
        base=course.step.base,
        beta=examination.beta,
        covariance=examination.covariance,
        examinations=(first.examination, examination),
        notes=(loop.note,) if loop.note else (),
        standstill=loop.standstill or question.standstill,
    )


def _made_by_noise(
    course: Course, answer: EvidenceAnswer, validation: Validation, findings: Sequence[Finding]
) -> bool:
    """Whether the findings are lags that noise has made, where nothing repeats."""
    first = course.first
    return (
        course.reversing is None
        and not first.examination.repeats
        and lags_of_noise(
            findings,
            leaves_the_usual(answer),
            validation.unexplained(first),
            validation.changes(first, course.step),
            first.base.model.robot.identification.torque_margin,
        )
    )


def _periods(diagnosis: Diagnosis) -> list[str]:
    """How often a ripple comes that no gear explains, a sentence each."""
    return [
        f"torque ripple of {joint_words(one.joints)} comes {shape.value:.1f} times"
        f" {WITHOUT_GEAR[shape.name]}; no gear of the description explains it"
        for one in diagnosis.findings
        for shape in one.parameters
        if shape.name in WITHOUT_GEAR
    ]
