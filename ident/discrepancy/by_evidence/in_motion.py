"""What the evidence found in motion, with sizes; names that rows do not tell apart, settled in the loop."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

from ident.discrepancy.basis import Basis
from ident.discrepancy.by_evidence.decide.names import SURE, Key, Named, Slot, as_limit, with_nats
from ident.discrepancy.by_evidence.report.answer import EvidenceAnswer, EvidenceFinding
from ident.discrepancy.by_evidence.taken import (
    basis_of,
    component_of,
    is_of_reversals,
    rivals_in_loop,
)
from ident.discrepancy.component import Component
from ident.discrepancy.course import Course
from ident.discrepancy.partialled import partialled
from ident.discrepancy.validation import Validation
from ident.effects.vocabulary import family_named

_log = logging.getLogger(__name__)


def found_in_motion(course: Course, answer: EvidenceAnswer, fitted: Validation) -> Course:
    """Go on with a model that has what the evidence found.

    Args:
        course: nothing is found yet.
        answer: of the evidence.
        fitted: the recordings that were fitted, in closed loop.
    """
    found = [one for one in answer.findings if one.something >= SURE and _has_size(course, one)]
    if not found:
        return course
    robot = course.step.base.model.robot
    try:
        course.take(
            [component_of(robot, one.placed) for one in found],
            [basis_of(one.key, Slot(one.names), one.unsure, one.doubt) for one in found],
            [one.linear for one in found],
            answer.standard,
        )
    except ArithmeticError as error:
        # What a refit takes up whole has no size: it is in the ranking, and the arm is unnamed.
        _log.warning("%s: %s", ", ".join(one.words() for one in found), error)
        return course
    for number, one in enumerate(found):
        course = settled_in_loop(course, number, one, fitted)
    return course


def _has_size(course: Course, finding: EvidenceFinding) -> bool:
    """Whether rows that are fitted show it; if not, it stays in the ranking, and the others get sizes.

    What the present model takes up whole would leave a whole set without sizes, and so without names.
    """
    first = course.first
    component = component_of(first.base.model.robot, finding.placed)
    if partialled(first.examination, component.effect(first.examination, first.present)) is not None:
        return True
    _log.warning("%s: the rows that are fitted show nothing of it", finding.words())
    return False


def settled_in_loop(course: Course, number: int, finding: EvidenceFinding, fitted: Validation) -> Course:
    """Rivals by rows and the simulated loop together; the likeliest stands.

    What the loop shows between two names is in the odds of both, as other motion is: of those that differ at
    reversals, and of those that the rows do not tell apart (with a delay of 4.5 ms in the place of a lag the
    loop rings). Of the rest it is taken to do as with the finding; what another finding is already is none
    here. These nats are not coarsened: σ over blocks of time already holds what neighbouring errors share. A
    rival that the rows fit with no size is nothing by another name, and the loop without the finding is no
    rival's; nor is one that does no better than all names together that it contains.

    Args:
        course: with all that was found.
        number: of the finding.
        finding: as the moving rows show it.
        fitted: the recordings that were fitted, in closed loop.
    """
    names, apart = Slot(finding.names).each.names, [one.key for one in finding.names[1:]]
    stands, place, nats = finding.key, Slot(names), dict[Key, float]()
    taken = {one.component.key for k, one in enumerate(course.findings) if k != number}
    robot = course.step.base.model.robot
    rivals = rivals_in_loop(robot, finding)
    for rival in (one for one in rivals if one.key not in taken):
        other = _with_rival(course, number, rival)
        if other is None or _may_be_nothing(other, number) or _is_its_parts(course, number, other, fitted):
            continue
        shown = fitted.shown_in_loop(fitted.loop_run(course.step), fitted.loop_run(other.step))
        _log.info("%s in the place of %s in closed loop: %s", rival.name, stands[0], shown)
        if shown is None:
            continue
        nats[rival.key] = nats.get(stands, 0.0) + shown.nats_in_loop(is_of_reversals(robot, rival))
        place = Slot(with_nats(names, nats))
        if shown.there and place.log_odds(rival.key) > place.log_odds(stands):
            course, stands = other, rival.key
    if nats:
        unsure = finding.unsure if stands == finding.key else None
        apart += [
            one.key for one in finding.names[0].forms if place.log_odds(one.key) < place.log_odds(stands)
        ]
        place = Slot(as_limit(place.names, stands, apart))
        basis = basis_of(stands, place, unsure, finding.doubt_of(stands))
        course.findings[number] = replace(course.findings[number], basis=basis)
    return course


def _may_be_nothing(course: Course, number: int) -> bool:
    """Whether what makes a finding that effect is not told from nothing by its own fit."""
    one = course.findings[number]
    return bool(replace(one, basis=replace(one.basis, unsure=None)).unsure)


def _is_its_parts(course: Course, number: int, other: Course, fitted: Validation) -> bool:
    """Whether the loop does with all names together that a rival contains as it does with the rival.

    The loop has no price for parameters: dry and viscous friction of one drive were a drift that settles in
    43 ± 2000 s with a share of 0.985 ± 0.039, and a power of the speed was hidden.
    """
    rival = other.findings[number].component
    robot, named = course.step.base.model.robot, map(family_named, rival.family.contains)
    parts = [
        Component(family, rival.place, ())
        for family in named
        if rival.place in family.places(robot) and not family.shapes(robot, rival.place)
    ]
    if len(parts) < 2:
        return False
    components = [one.component for k, one in enumerate(course.findings) if k != number] + parts
    together = _taken(course, components, [course.findings[number].basis] * len(components))
    if together is None:
        return False
    shown = fitted.shown_in_loop(fitted.loop_run(together.step), fitted.loop_run(other.step))
    _log.info("%s in the place of what it contains in closed loop: %s", rival.family.name, shown)
    return shown is not None and not shown.there


def _with_rival(course: Course, number: int, rival: Named) -> Course | None:
    """Where the search would be with another name in a finding's place; None where it has no size there."""
    assert rival.placed is not None
    components = [one.component for one in course.findings]
    components[number] = component_of(course.step.base.model.robot, rival.placed)
    return _taken(course, components, [one.basis for one in course.findings])


def _taken(course: Course, components: Sequence[Component], bases: Sequence[Basis]) -> Course | None:
    """Where the search would be with these effects for its findings; None where one has no size.

    Nor have two with a column in common: a power of the speed in the place of dry friction, beside a
    finding of viscous friction, left equations without an answer, and the diagnosis ended with these.
    """
    try:
        other = course.instead(components, bases)
        _ = other.step.shown  # raises where two have a column in common
    except ArithmeticError as error:
        _log.info("%s: %s", ", ".join(one.key[0] for one in components), error)
        return None
    return other
