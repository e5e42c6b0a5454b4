"""What shows in the simulated closed loop beside what the moving arm shows: one effect more, or none."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.accepted import joints_not_told
from ident.discrepancy.by_evidence.decide.left_over import ABOVE, above_accepted
from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.discrepancy.by_evidence.power.reversals import smallest_in_loop
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.report.answer import EvidenceAnswer, JointMisfit
from ident.discrepancy.by_evidence.reversals import (
    AtReversals,
    beyond_margin,
    by_any_law,
    likeliest_in_loop,
    posed_in_loop,
    standstill_in,
)
from ident.discrepancy.by_evidence.taken import basis_of, component_of, is_of_reversals
from ident.discrepancy.course import Course
from ident.discrepancy.loop import Standstill
from ident.discrepancy.results import Finding
from ident.discrepancy.step import LoopStep
from ident.discrepancy.unrepeated import unrepeated
from ident.discrepancy.verdict import loop_does_otherwise
from ident.effects.family import EffectFamily
from ident.errors import IdentificationError
from robots.free_memory import give_back

_log = logging.getLogger(__name__)

ANY_LAW = (
    "at standstill the drives' friction follows none of the laws that are known here; an effect that shows"
    " there alone could hide in it"
)
"""Said of an arm whose loop another law of friction at standstill explains."""

_MOST = 3
"""Effects beside which nothing more is looked for."""


@dataclass
class InLoop:
    """The simulated closed loop of a model that has what the moving arm shows.

    Attributes:
        course: what was found in motion; what the loop shows is added.
        answer: of the evidence.
        families: the vocabulary.
        unnamed: what the loop does otherwise without a name, in words.
        note: on the arm, beside what its model lacks.
        judged: information of the recordings that are not fitted, as a share of that of those that are.
        standstill: how each drive's dry friction turns its sign beside what was found; None where that was
            not asked.
        nameable: the smallest sizes that the loop would have shown of what it alone shows.
    """

    course: Course
    answer: EvidenceAnswer
    families: Sequence[EffectFamily]
    judged: float = 1.0
    unnamed: str = ""
    note: str = ""
    standstill: Standstill | None = None
    nameable: tuple[Smallest, ...] = ()

    def is_worth_a_look(self) -> bool:
        """Not beside many effects, nor where something does not repeat and is no shock."""
        if len(self.course.findings) >= _MOST:
            return False
        not_repeating = unrepeated(self.course.step.examination, self.course.prepared[0].row_time)
        return all(item.kind == "shocks" for item in not_repeating)

    def look(self) -> None:
        """At most one more finding, by the same evidence; a loop that does otherwise without one is told."""
        in_loop = self.course.step.in_loop()
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
        found = self.course.findings
        families = [family for family in self.families if family.shows != "motion"]
        known = {(effect.name, effect.place.joints) for effect in self.course.step.placed}
        joints = set(range(problem.rows.n)) - self.left_alone()
        beside = [(finding.placed, finding.linear) for finding in found]
        one = likeliest_in_loop(problem, families, known, joints, beside, self._heard)
        if one is not None:
            self._add(in_loop, one)
        elif not found and not self.more_in_motion():
            self._tell(problem)

    def _heard(self, problem: Problem, entries: Sequence[Entry]) -> None:
        assert isinstance(problem.rows, LoopRows)
        self.nameable = smallest_in_loop(problem.rows, problem.level, entries, judged=self.judged)

    def _add(self, in_loop: LoopStep, one: AtReversals) -> None:
        """Go on with a model that has what the loop shows; without it where that cannot be simulated."""
        component = component_of(in_loop.base.model.robot, one.placed)
        try:
            self.course.add_in_loop(in_loop, component, basis_of(one.key, one.names))
        except (ArithmeticError, IdentificationError) as error:
            _log.info("%s is not simulated: %s", one.key[0], error)

    def look_again(self, findings: Sequence[Finding]) -> None:
        """What the loop showed has gone again: is the loop then the arm's?"""
        reversing = self.course.reversing
        if reversing is not None and not findings and not self.more_in_motion():
            self._tell(posed_in_loop(reversing))

    def left_alone(self) -> set[int]:
        """Joints (from 0) of findings that have more than one name, and those that leave more than usual."""
        if not self.course.findings:
            return set()
        more = {one.joint - 1 for one in self.answer.joints if _leaves_more(one)}
        return joints_not_told(self.course.findings) | more

    def _tell(self, problem: Problem) -> None:
        """A loop that does otherwise by any law of friction at standstill is no clean arm's."""
        self.unnamed = _otherwise(problem)
        if not self.unnamed:
            return
        other = by_any_law(self.course.step, problem)
        if other is not None and not beyond_margin(other):
            self.unnamed, self.note = "", ANY_LAW
            self.standstill = standstill_in(other)

    def more_in_motion(self) -> bool:
        """What shows at reversals alone is asked of the simulated loop, where there is one."""
        answer = self.answer
        if answer.verdict == "clean":
            return False
        if self.standstill is None or answer.findings or not leaves_the_usual(answer):
            return True
        robot = self.course.step.base.model.robot
        moving = sum(one.probability for one in answer.ranking if not is_of_reversals(robot, one))
        return answer.probability_clean < SURE * moving


def leaves_the_usual(answer: EvidenceAnswer) -> bool:
    """Beside what was found: where nothing repeats a residual is its own noise, but misfit is learned."""
    return not any(map(_leaves_more, answer.joints))


def _leaves_more(joint: JointMisfit) -> bool:
    """Whether it may well be that a joint leaves more than the accepted model does."""
    return joint.above > 1.0 - SURE


def _otherwise(problem: Problem) -> str:
    """What is said of a loop that leaves more than an accepted model may; empty where it does not."""
    above = above_accepted(problem, without_effects(problem))
    return loop_does_otherwise(int(np.argmax(above))) if above.max() > ABOVE else ""
