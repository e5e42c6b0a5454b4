"""The whole answer by evidence: its names, with the sizes, confirmations and reversals that a diagnosis has.

The evidence says which set of effects the moving arm shows. That set is then fitted, shown on recordings that
were not fitted and simulated in closed loop as any finding is, and reversals, which the evidence leaves out,
are looked at in the simulated loop. So a name is given where two things say so that share nothing but the
recordings: the evidence of the rows that were fitted, and the gap on those that were not.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from ident.closed_loop.at_once import beside
from ident.discrepancy.by_evidence.decide.left_over import ABOVE, above_accepted
from ident.discrepancy.by_evidence.decide.names import SURE, Key, Named, Slot, with_nats
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.report.answer import EvidenceAnswer, EvidenceFinding
from ident.discrepancy.by_evidence.reversals import (
    beyond_margin,
    by_any_law,
    likeliest_in_loop,
    posed_in_loop,
    standstill_in,
)
from ident.discrepancy.by_evidence.taken import (
    at_reversals,
    basis_of,
    candidates_of,
    component_of,
    is_of_reversals,
)
from ident.discrepancy.by_evidence.workflow import named_by_evidence
from ident.discrepancy.course import Course
from ident.discrepancy.library import partialled
from ident.discrepancy.loop import Standstill
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.question import Progress, Question
from ident.discrepancy.results import Candidate, Diagnosis
from ident.discrepancy.step import LoopStep
from ident.discrepancy.unknown_feed_forward import with_feed_forward
from ident.discrepancy.validation import Validation
from ident.discrepancy.verdict import loop_does_otherwise
from ident.discrepancy.workflow import Search, silent
from ident.effects.entry import joint_words
from ident.effects.torque_ripple import WITHOUT_GEAR
from ident.errors import IdentificationError
from robots.free_memory import give_back

_log = logging.getLogger(__name__)

ANY_LAW = (
    "at standstill the drives' friction follows none of the laws that are known here; an effect that shows"
    " there alone could hide in it"
)
"""Said of an arm whose loop another law of friction at standstill explains."""


def diagnose_with_evidence(
    question: Question, progress: Progress = silent
) -> tuple[Diagnosis, EvidenceAnswer]:
    """Find, name and add what the model lacks, names by evidence.

    Args:
        question: recordings, model, vocabulary and prior.
        progress: told of each step.

    Raises:
        IdentificationError: recordings that do not fit the arm, or that determine too little.
    """
    if not question.fit or not question.validation:
        raise IdentificationError("the search needs one recording to fit and another to validate")
    recordings, notes = with_feed_forward(question.robot, (*question.fit, *question.validation))
    count = len(question.fit)
    question = replace(question, fit=recordings[:count], validation=recordings[count:])
    led = _Led(question, lambda step, share: progress(step, 0.6 + 0.4 * share))
    known = replace(question, standstill=led.step.standstill if question.at_reversals else None)
    answer, sizes = named_by_evidence(known, lambda step, share: progress(step, 0.6 * share), simulated=False)
    led.answer, led.notes = answer, tuple(one.words() for one in answer.refuted)
    diagnosis, nameable = beside(led.run, sizes)
    answer, standstill = replace(answer, nameable=nameable), led.standstill or known.standstill
    notes = (*notes, *led.notes, *_periods(diagnosis))
    return replace(diagnosis, notes=notes, standstill=standstill), answer


def _periods(diagnosis: Diagnosis) -> list[str]:
    """How often a ripple comes that no gear explains, a sentence each."""
    return [
        f"torque ripple of {joint_words(one.joints)} comes {shape.value:.1f} times"
        f" {WITHOUT_GEAR[shape.name]}; no gear of the description explains it"
        for one in diagnosis.findings
        for shape in one.parameters
        if shape.name in WITHOUT_GEAR
    ]


class _Led(Search):
    """A search whose effects of motion are those of the evidence."""

    answer: EvidenceAnswer

    def __init__(self, question: Question, progress: Progress) -> None:
        super().__init__(question, progress)
        self.notes: tuple[str, ...] = ()
        """What is said of the arm beside what its model lacks."""
        self.standstill: Standstill | None = None
        """As of a diagnosis."""

    def _search_in_motion(self) -> None:
        found = [one for one in self.answer.findings if one.something >= SURE and self._has_size(one)]
        if found:
            robot = self.step.base.model.robot
            components = [component_of(robot, one.placed) for one in found]
            try:
                self.course.take(
                    components,
                    [basis_of(one.key, Slot(one.names), one.unsure, one.doubt) for one in found],
                )
            except ArithmeticError as error:
                # What a refit takes up whole has no size: it is in the ranking, and the arm is unnamed.
                _log.warning("%s: %s", ", ".join(one.words() for one in found), error)
                return
            for number, one in enumerate(found):
                self._settle_in_loop(number, one)

    def _has_size(self, finding: EvidenceFinding) -> bool:
        """Whether rows that are fitted show it; if not, it stays in the ranking, and the others get sizes.

        Where no motion repeats a measured torque would explain itself, so there a drive that saturates has no
        rows; such a one would leave a whole set without sizes, and so without names.
        """
        first = self.course.first
        component = component_of(first.base.model.robot, finding.placed)
        if partialled(first.examination, component.effect(first.examination, first.present)) is not None:
            return True
        _log.warning("%s: the rows that are fitted show nothing of it", finding.words())
        return False

    def _settle_in_loop(self, number: int, finding: EvidenceFinding) -> None:
        """Rivals that differ at reversals, by rows and the simulated loop together; the likeliest stands.

        What the loop shows between two names is in the odds of both, as other motion is. Names that show in
        motion alone do at reversals as the finding does, and what another finding is already is none here.
        These nats are not coarsened: σ over blocks of time already holds what neighbouring errors share.

        Args:
            number: of the finding.
            finding: as the moving rows show it.
        """
        stands, place, nats = finding.key, Slot(finding.names), dict[Key, float]()
        taken = {one.component.key for k, one in enumerate(self.findings) if k != number}
        rivals = at_reversals(self.step.base.model.robot, finding)
        for rival in (one for one in rivals if one.key not in taken):
            course = self._with_rival(number, rival)
            fitted = self._validation(self.prepared)
            shown = fitted.shown_in_loop(fitted.loop_run(self.step), fitted.loop_run(course.step))
            _log.info("%s in the place of %s in closed loop: %s", rival.name, stands[0], shown)
            if shown is None:
                continue
            nats[rival.key] = nats.get(stands, 0.0) + shown.nats_in_loop
            place = Slot(with_nats(finding.names, nats))
            if shown.there and place.log_odds(rival.key) > place.log_odds(stands):
                self.course, stands = course, rival.key
        if nats:
            unsure = finding.unsure if stands == finding.key else None
            basis = basis_of(stands, place, unsure, finding.doubt)
            self.course.findings[number] = replace(self.findings[number], basis=basis)

    def _with_rival(self, number: int, rival: Named) -> Course:
        """Where the search would be with another name in the place of a finding."""
        assert rival.placed is not None
        components = [one.component for one in self.findings]
        components[number] = component_of(self.step.base.model.robot, rival.placed)
        course = Course.begun(self.prepared, self.course.first)
        course.take(components, [one.basis for one in self.findings])
        return course

    def _validation(self, prepared: tuple[PreparedRecording, ...]) -> Validation:
        """With friction at standstill as fitted recordings show it, beside what was found where it was asked.

        The description's is a guess: beside its bristles a friction of the load that other motion shows whole
        (1.02 ± 0.01) had −2.6 ± 0.5 of it in the simulated positions of an arm that sticks otherwise.
        """
        beside_nothing = self.course.first.standstill if self.question.at_reversals else None
        known = self.standstill or beside_nothing
        return replace(super()._validation(prepared), standstill=known)

    def _search_at_reversals(self) -> None:
        """At most one more finding, by the same evidence of the simulated loop."""
        in_loop = self.step.in_loop()
        if in_loop is None:
            return
        give_back()
        try:
            problem = posed_in_loop(in_loop)
        except IdentificationError as error:
            # Parameters that the loop's rows want can be none that an arm has: a gap of less than nothing.
            _log.info("no look at reversals: %s", error)
            return
        self.standstill = in_loop.examination.loop.standstill
        self._leave_to_motion()
        families = [family for family in self.question.families if family.shows != "motion"]
        joints = set(range(problem.rows.n)) - self.settled
        one = likeliest_in_loop(problem, families, self._no_further(), joints)
        if one is not None:
            self.course.step = self.course.reversing = in_loop
            self.course.add_in_loop(
                component_of(in_loop.base.model.robot, one.placed), basis_of(one.key, one.names)
            )
        elif not self.findings and not self._more_in_motion():
            self._tell_problem(problem)

    def _answer(self) -> Diagnosis:
        give_back()  # rows of the loop and their vocabulary, which refer to each other
        return super()._answer()

    def _tell_loop(self, in_loop: LoopStep) -> None:
        self._tell_problem(posed_in_loop(in_loop))

    def _tell_problem(self, problem: Problem) -> None:
        """A loop that does otherwise by any law of friction at standstill is no clean arm's."""
        self.unnamed = _otherwise(problem)
        if not self.unnamed:
            return
        other = by_any_law(self.step, problem)
        if other is not None and not beyond_margin(other):
            self.unnamed, self.notes = "", (*self.notes, ANY_LAW)
            self.standstill = standstill_in(other)

    def _ranking(self) -> tuple[Candidate, ...]:
        if not self.findings:
            return candidates_of(self.answer.ranking)
        return candidates_of(self.answer.beside)

    def _leaves_the_usual(self) -> bool:
        """Beside what was found: where nothing repeats a residual is its own noise, but misfit is learned."""
        return all(one.above <= 1.0 - SURE for one in self.answer.joints)

    def _more_in_motion(self) -> bool:
        """What shows at reversals alone is asked of the simulated loop, where there is one."""
        answer = self.answer
        if answer.verdict == "clean":
            return False
        if self.standstill is None or answer.findings or not self._leaves_the_usual():
            return True
        robot = self.step.base.model.robot
        moving = sum(one.probability for one in answer.ranking if not is_of_reversals(robot, one))
        return answer.probability_clean < SURE * moving


def _otherwise(problem: Problem) -> str:
    """What is said of a loop that leaves more than an accepted model may; empty where it does not."""
    above = above_accepted(problem, without_effects(problem))
    return loop_does_otherwise(int(np.argmax(above))) if above.max() > ABOVE else ""
