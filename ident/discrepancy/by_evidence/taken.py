"""What the evidence found, as the rest of a diagnosis takes it: with what it rests on, and its rivals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import logit

from ident.discrepancy.basis import Basis
from ident.discrepancy.by_evidence.decide.names import NOTHING, SURE, Key, Named, Slot, smallest
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME, form_error
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE
from ident.discrepancy.by_evidence.library.candidates import is_friction
from ident.discrepancy.by_evidence.report.answer import EvidenceFinding
from ident.discrepancy.component import Component
from ident.discrepancy.results import Candidate, Finding, Possible
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import form_of
from robots.description import Robot

RANKED = 12
"""Candidates that a ranking lists."""

_BY_CHANCE = 0.05
"""Of what speaks against a name at 95 %, what does so by chance."""


def rivals_in_loop(robot: Robot, finding: EvidenceFinding) -> list[Named]:
    """Names that explain the moving rows in a finding's place, and of which the simulated loop is asked.

    These are those that such rows do not tell from it, and after them names that show where no such row is:
    what shows in motion is asked beside the finding, and does at reversals as that does.
    """
    every = Slot(finding.names).each
    indistinguishable = {one.key for one in every.held}
    there = [
        one for one in every.names if one.placed is not None and one.log_odds > 0.0 and one.key != finding.key
    ]
    of_reversals = [one for one in there if is_of_reversals(robot, one)]
    in_motion = [one for one in there if one not in of_reversals and one.key in indistinguishable]
    here = [one for one in of_reversals if one.key in indistinguishable or one.joints == finding.key[1]]
    return [*in_motion, *here]


def is_of_reversals(robot: Robot, one: Named) -> bool:
    """Whether a name shows at reversals alone."""
    return one.placed is not None and form_of(robot, one.name, one.placed.shape_names).shows == "reversal"


def component_of(robot: Robot, placed: PlacedEffect) -> Component:
    """In the form that a model file tells by its name and shapes."""
    return Component(form_of(robot, placed.name, placed.shape_names), placed.place, placed.shape)


def basis_of(key: Key, place: Slot, unsure: str | None = None, doubt: str = "") -> Basis:
    """What the evidence takes an effect for; it scores in nats, coarsened, against nothing in its place.

    Args:
        key: name and joints, from 0.
        place: names for it.
        unsure: what of its sizes is not told from nothing; None where they are of another fit.
        doubt: why the evidence does not take it for confirmed; empty where it does.
    """
    place = place.each
    held = () if place.probability(key) >= SURE else place.held
    others = [one for one in held if one.key not in (key, NOTHING)]
    return Basis(
        p_value=1.0 - place.something,
        score=place.log_odds(key),
        threshold=float(logit(SURE)),
        probability=place.probability(key),
        indistinguishable_from=candidates_of(others),
        ranking=candidates_of(place.names),
        unsure=unsure,
        doubt=doubt,
        held=tuple(
            Possible(one.name, tuple(joint + 1 for joint in one.joints), one.probability)
            for one in place.held
        ),
    )


def candidates_of(names: tuple[Named, ...] | list[Named]) -> tuple[Candidate, ...]:
    """Entries of a ranking, joints from 1; nothing is no candidate."""
    return tuple(
        Candidate(
            one.name, tuple(joint + 1 for joint in one.joints), one.log_odds, one.probability, one.placed
        )
        for one in names
        if one.placed is not None
    )[:RANKED]


def weighed(finding: Finding, robot: Robot) -> Finding:
    """A finding with its probability and its set after what data that was not fitted says of it.

    That was asked when all was fitted together, in torque and in the simulated loop, after the names had
    their probabilities. What it takes from the name something without a name has. What speaks against a name
    is told at 95 %, so one in twenty is by chance, and takes nothing. Of what reversals showed no other
    motion was asked before, so something without a name has what that says for or against it; where too much
    of the place has no name then, the name is not confirmed.

    Args:
        finding: with what confirms it.
        robot: of the diagnosis.
    """
    placed, confirmation = finding.placed, finding.confirmation
    against, of_reversals = confirmation.against, confirmation.of_reversals
    if not (against or of_reversals):
        return finding
    rough = of_reversals or form_of(robot, placed.name, placed.shape_names).rough
    form = form_error(rough, is_friction(placed))
    kept = float(np.exp(-max((one.nats_against(form) for one in against), default=0.0)))
    by_chance = _BY_CHANCE if against else 0.0
    own, unknown = finding.probability, (NO_NAME, finding.joints)
    rest = {(one.name, one.joints): one.probability for one in finding.held}
    rest.pop((finding.effect, finding.joints), None)
    unlisted = max(float(np.finfo(np.float64).eps), 1.0 - own - sum(rest.values()))
    rest[unknown] = rest.get(unknown, 0.0) + unlisted
    if of_reversals and not against:
        rest[unknown] *= float(np.exp(TEMPERATURE * confirmation.torque.to_form(form).nats_of_no_name))
    whole = own * kept + sum(rest.values())
    before = {(finding.effect, finding.joints): own, **rest}
    after = {**before, (finding.effect, finding.joints): own * kept}
    names = tuple(
        Named(*key, by_chance * before[key] + (1.0 - by_chance) * value / whole)
        for key, value in after.items()
    )
    held = smallest(tuple(sorted(names, key=lambda one: -one.probability)))
    nameless = sum(one.probability for one in names if one.name in (NO_NAME, NOTHING[0]))
    if of_reversals and not confirmation.unsure and nameless > 1.0 - SURE:
        confirmation = replace(confirmation, unsure=f"{NO_NAME} is there with probability {nameless:.2f}")
    return replace(
        finding,
        probability=names[0].probability,
        confirmation=confirmation,
        held=tuple(Possible(one.name, one.joints, one.probability) for one in held),
    )
