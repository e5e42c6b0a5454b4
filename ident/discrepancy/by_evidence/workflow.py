"""From a question to the answer of the evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import expit

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.before_after import gate_of
from ident.discrepancy.by_evidence.confirm.borne_out import borne_out
from ident.discrepancy.by_evidence.confirm.held_out import HeldOut
from ident.discrepancy.by_evidence.decide.beside_motion import searched_beside_motion
from ident.discrepancy.by_evidence.decide.instruments import fitted_motion, with_found
from ident.discrepancy.by_evidence.decide.left_over import (
    above_accepted,
    misfit_of,
    own_joint,
    torque_of,
    usual_at,
)
from ident.discrepancy.by_evidence.decide.likeliest import likeliest
from ident.discrepancy.by_evidence.decide.names import (
    NOTHING,
    Key,
    Named,
    of_nothing,
    slot,
)
from ident.discrepancy.by_evidence.decide.present_with import standard_of
from ident.discrepancy.by_evidence.decide.problem import Problem, pose
from ident.discrepancy.by_evidence.decide.screening import Screened, screen
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.decide.told import simplified, unsure
from ident.discrepancy.by_evidence.evidence.gram import Gram
from ident.discrepancy.by_evidence.evidence.lag import aligned
from ident.discrepancy.by_evidence.evidence.prepared import settings_for
from ident.discrepancy.by_evidence.evidence.turned import where_turned
from ident.discrepancy.by_evidence.power.planned import BesideModel, sizes_beside
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.report.answer import (
    TOO_POOR,
    WORSE,
    EvidenceAnswer,
    EvidenceFinding,
    JointMisfit,
    parameters_of,
    verdict_of,
)
from ident.discrepancy.gain_doubt import scales_with_gains
from ident.discrepancy.question import Progress, Question, silent
from ident.discrepancy.settings import searching
from ident.errors import IdentificationError
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot
from robots.free_memory import give_back


def diagnose_by_evidence(
    question: Question, progress: Progress = silent, simulated: bool = True
) -> EvidenceAnswer:
    """Find and name what the model lacks, with probabilities.

    Args:
        question: recordings, model, vocabulary and prior.
        progress: told of each step.
        simulated: whether gate 1 is asked of an arm that is otherwise clean.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    answer, sizes = named_by_evidence(question, progress, simulated)
    return replace(answer, nameable=sizes())


def named_by_evidence(
    question: Question, progress: Progress, simulated: bool
) -> tuple[EvidenceAnswer, Callable[[], tuple[Smallest, ...]]]:
    """The answer but for sizes that would still be named, and these: nothing but a reader waits for them.

    Args:
        question, progress, simulated: as of :func:`diagnose_by_evidence`.

    Raises:
        IdentificationError: as there.
    """
    if not question.fit or not question.validation:
        raise IdentificationError("the search needs one recording to fit and another to validate")
    give_back()
    progress("filter", 0.0)
    answer, sizes = _answered(question, progress, simulated)
    give_back()  # the rows of the search and its vocabulary: the sizes have as many of their own
    return answer, sizes


def _answered(
    question: Question, progress: Progress, simulated: bool
) -> tuple[EvidenceAnswer, Callable[[], tuple[Smallest, ...]]]:
    """As :func:`named_by_evidence`; what is left behind is free memory then."""
    search, searched = searched_beside_motion(posed(question), question, progress)
    problem = search.problem
    progress("validation", 0.95)
    unfitted = with_found(problem, searched.found, question.validation)
    held = HeldOut.of(problem, where_turned(unfitted, question.standstill))
    searched, refuted = borne_out(search, searched, held)
    searched = simplified(search, likeliest(search, searched, held), held)
    found = searched.found
    findings = [_finding(search, searched, held, k) for k in range(len(found.members))]
    findings.sort(key=lambda one: -one.explains / one.left)
    ranking = of_nothing(search, searched)
    beside = screen(problem, found, searched.entries)
    joints = _joints(problem, searched, held, beside)
    nothing = next(one.probability for one in ranking if one.name == NOTHING[0])
    verdict, rejected = verdict_of(tuple(findings), nothing, joints), None
    if verdict == "clean" and simulated:
        rejected = _gate_one_rejects(question, problem)
        verdict = "unnamed" if rejected else "clean"
    answer = EvidenceAnswer(
        verdict=verdict,
        findings=tuple(findings),
        refuted=refuted,
        ranking=ranking,
        beside=tuple(_against_nothing(one) for one in _likeliest_forms(beside)),
        joints=tuple(sorted(joints, key=lambda one: -one.after)),
        nameable=(),
        gate_one_rejected=rejected,
        repeats=problem.prepared.repeats,
        log_evidence=(searched.empty.log_evidence, found.log_evidence),
        standard=standard_of(problem, found),
    )
    problem.present.forget()
    searched.present.forget()
    for member in found.members:
        member.entry.white.forget()
    sizes = partial(
        sizes_beside,
        BesideModel.of(problem),
        found,
        searched.present,
        search.wanted,
        question.fit,
        question.validation,
        lag_is_known(question.robot),
    )
    return answer, sizes


def _gate_one_rejects(question: Question, problem: Problem) -> bool | None:
    """Whether the simulated arm is not the real one; None where it cannot be simulated.

    Asked of the recordings that the parameters are fitted to, as an identification asks it: on others the
    margin of 0.5 % of a following error is what two fits of one arm differ by.
    """
    lag = problem.prepared.robot.identification.control_signal_lag
    settings = question.robot.identification.model_copy(update={"control_signal_lag": lag})
    robot = question.robot.model_copy(update={"identification": settings})
    robot = searching(robot, question.fit[0])
    base = base_parameters(RegressorModel(robot, problem.base.model.effects))
    beta = problem.beta.mean(problem.posterior.known)
    gate, _ = gate_of(base, beta, problem.prior, question.fit)
    return None if gate is None else gate.passed is False


def posed(question: Question) -> Problem:
    """The question's model against its recordings, before any effect is added."""
    robot = _aligned(question)
    effects = (question.model or RegressorModel.of(robot)).effects
    base = base_parameters(RegressorModel(robot, effects))
    prior = question.prior(base) if question.prior else None
    accepted = None if prior is None else prior.misfit
    prepared = where_turned(fitted_motion(base, prior, question.fit), question.standstill)
    return pose(base, prior, prepared, accepted)


def _aligned(question: Question) -> Robot:
    """The arm with the settings of the evidence and the lag that the recordings show."""
    robot = settings_for(question.robot, question.fit[0])
    effects = (question.model or RegressorModel.of(robot)).effects
    return aligned(robot, base_parameters(RegressorModel(robot, effects)), question.fit)


def _finding(search: Search, searched: Searched, held: HeldOut, number: int) -> EvidenceFinding:
    found = searched.found
    without = search.without(found, number)
    member = found.members[number]
    theta, covariance = found.theta(number)
    placed = member.entry.placed
    deviation = np.hypot(np.sqrt(np.diag(covariance)), _of_gains(search.problem, found, number))
    units = tuple(shape.unit for shape in member.candidate.shapes)
    sizes = torque_of(search.problem, found, number)
    joint = own_joint(found, number, sizes)
    return EvidenceFinding(
        placed=placed,
        names=slot(search, searched, number, without, held).names,
        parameters=parameters_of(placed, units, theta, deviation),
        unsure=unsure(found, number, deviation),
        confirmation=held.confirmation(found, without),
        explains=float(sizes[joint]),
        left=usual_at(search.problem, found, joint),
        fails=_fails(searched, held, joint),
    )


def _of_gains(problem: Problem, found: Found, number: int) -> FloatArray:
    """(p,) what the drives' gains leave open of a member's parameters, in their units, against a prior."""
    member = found.members[number]
    white = member.entry.white
    if problem.prior is None or not scales_with_gains(member.entry.placed):
        return np.zeros(white.count)
    robot, k = problem.prepared.robot, found.posterior.known.size
    start = k + sum(one.entry.white.count for one in found.members[:number])
    own = np.arange(start, start + white.count)
    gram = Gram(problem.rows, tuple(one.entry.white for one in found.members))
    inner = np.delete(np.arange(gram.size), k)
    variance = np.zeros(white.count)
    theta = found.posterior.theta[own - k]
    for joint, drive in enumerate(robot.drive):
        # The rows of a joint stand for its drive: of a coupled one, whose gain two joints feel, nearly so.
        products = gram.reduced(found.level, [joint])[0][inner][:, own + 1] @ theta
        shift = found.posterior.covariance[own] @ products
        variance += (drive.gain_relative_uncertainty * shift * white.scale) ** 2
    return np.asarray(np.sqrt(variance))


def _fails(searched: Searched, held: HeldOut, joint: int) -> str:
    """How a set does worse at a joint than no effect, or than no model; empty where it does not.

    Of what a recording hardly shows it leaves more or less by chance: a share that is below one half, and not
    told from it over blocks of time, is nothing against a set. A model that leaves more than the torque was
    not determined by its motion, and findings make up for that (a wrist coupling: 850 % of 1180 % left).
    """
    if held.in_blocks(searched.found, searched.empty, joint).contradicted:
        return WORSE
    return TOO_POOR if held.unexplained(searched.found)[joint] > 1.0 else ""


def _likeliest_forms(beside: Sequence[Screened]) -> list[Screened]:
    """Of each name at each place the likeliest form; the order is kept."""
    best: dict[Key, Screened] = {}
    for one in beside:
        best.setdefault(one.candidate.key, one)
    return list(best.values())


def _against_nothing(one: Screened) -> Named:
    return Named(*one.candidate.key, float(expit(one.log_odds)), one.best.entry.placed, one.log_odds)


def _nearest(joint: int, beside: Sequence[Screened]) -> Named | None:
    """The likeliest name that acts at a joint alone, or at least there, with its odds against nothing."""
    here = [one for one in beside if joint in (one.candidate.place.joints or one.best.entry.white.at)]
    if not here:
        return None
    best = max(here, key=lambda one: one.log_odds)
    return _against_nothing(best)


def _joints(
    problem: Problem, searched: Searched, held: HeldOut, beside: Sequence[Screened]
) -> tuple[JointMisfit, ...]:
    above = above_accepted(problem, searched.found)
    misfit = misfit_of(problem, searched.found)
    before, after = held.unexplained(searched.empty), held.unexplained(searched.found)
    return tuple(
        JointMisfit(
            joint=j + 1,
            before=float(before[j]),
            after=float(after[j]),
            kappa=float(misfit[j]),
            accepted=float(problem.misfit.accepted[j]),
            above=float(above[j]),
            nearest=_nearest(j, beside),
        )
        for j in range(problem.rows.n)
    )
