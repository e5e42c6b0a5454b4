"""The model with everything that is found, as effects ask it for torques: a payload is in its links."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found
from ident.effects import RigidBody, State
from ident.effects.family import PlacedEffect
from ident.effects.giving_way import ways_of
from ident.effects.placed import Placed
from ident.effects.ways import Pliant, Way
from ident.parameters.present import Present
from robots.arrays import FloatArray
from robots.identity_cache import IdentityCache


@dataclass(frozen=True)
class PresentWith:
    """A model with effects of given values; see :class:`ident.effects.family.PresentModel`.

    Attributes:
        model: without them.
        beside: effects and values.
        apart: whether no sample's own noise is in the motion that it is asked about.
        places: where it gives way, and behind them those of an effect that is asked beside it.
        own: how many of these are the effect's.
    """

    model: Present
    beside: Sequence[tuple[PlacedEffect, FloatArray]]
    apart: bool
    places: tuple[Pliant, ...] = ()
    own: int = 0
    _torques: IdentityCache[FloatArray] = field(default_factory=IdentityCache, repr=False, compare=False)

    def forget(self) -> None:
        """Motions that it was asked about, and what is made of them."""
        self.model.forget()
        self._torques.forget()

    def torque(self, state: State) -> FloatArray:
        """Joint torque of the whole model, samples × joints, N·m (or N)."""
        if state.torque is None:  # a moved motion, which is asked about once and would be kept
            return self._torque(state)
        return self._torques.of(state, lambda: self._torque(state))

    def _torque(self, state: State) -> FloatArray:
        total = self.model.torque(state)
        for effect, values in self.beside:
            total = total + effect.columns(state) @ values
        return total

    def own_torque(self, state: State) -> FloatArray:
        """Of all but the links, wherever these give way."""
        total = self.model.own_torque(state)
        for effect, values in self.beside:
            if not effect.gives_way:
                total = total + effect.columns(state) @ values
        return total

    def low_cutoff(self, state: State) -> State:
        """The motion for rates of torques: one without a sample's own noise needs no filter of its own.

        Such a filter takes a third off a torque near its cut-off, and the rest would look for another name.
        """
        return state if self.apart else self.model.low_cutoff(state)

    def link_torque(self, state: State) -> FloatArray:
        """Torque of the links alone, samples × joints."""
        return self.model.link_torque(state)

    def ways(self, state: State) -> tuple[Way, ...]:
        """How far links give way: all at once, those of the effect that asks among them."""
        before = self.model.ways(state)
        if len(self.places) == self.own:
            return before
        ways = state.once(
            self, "ways", lambda: ways_of((*(one.place for one in before), *self.places), self, state)
        )
        return ways[: len(ways) - self.own]

    def foot_torque(self, state: State, rocking: FloatArray) -> FloatArray:
        """Of the links on a foot that rocks, samples × (2 + joints)."""
        return self.model.foot_torque(state, rocking)

    def link_mass_matrix(self, position: FloatArray) -> FloatArray:
        """Of the links alone, samples × joints × joints."""
        return self.model.link_mass_matrix(position)

    def offset_torque(self) -> FloatArray:
        """Constant torque on each joint (n,)."""
        return self.model.offset_torque()

    def drive_friction(self, drive: int) -> tuple[float, float]:
        """Dry and viscous friction of a drive."""
        return self.model.drive_friction(drive)

    def has(self, symbols: Collection[str], drive: int) -> bool:
        """Whether the model has a usual term for a drive."""
        return self.model.has(symbols, drive)

    def gravity_torque(self, position: FloatArray, gravity: FloatArray) -> FloatArray:
        """Torque that holds the links against a gravity (3,): samples × joints."""
        return self.model.gravity_torque(position, gravity)


def present_with(problem: Problem, found: Found, but: int | None = None) -> PresentWith:
    """The model at a set's posterior mean. What a load adds to the links passes through the gears, too.

    Args:
        problem: the data.
        found: the set.
        but: a member to leave out: what an effect does is not made of its own torque. A delay of a model that
            has the delay already comes out half as long, and the rest looks for other names.
    """
    base, robot = problem.base, problem.prepared.robot
    standard = standard_of(problem, found)
    torques = []
    for number, member in enumerate(found.members):
        placed, values = member.entry.placed, found.theta(number)[0]
        assert isinstance(placed, Placed)
        links = placed.simulated(values).links
        if links is None:
            torques.append((number, member, values))
        elif number != but:
            standard = standard + _in_links(problem, np.asarray(links))
    model, apart = Present(base.model, standard), problem.prepared.apart
    places = [(number, place) for number, member, _ in torques for place in member.entry.placed.gives_way]

    def seen_by(asking: int | None) -> Present | PresentWith:
        """The model without torques beside it; it gives way as it does with the effect that asks."""
        others = tuple(place for number, place in places if number != asking)
        own = tuple(place for number, place in places if number == asking)
        return PresentWith(model, (), apart, (*others, *own), len(own)) if others else model

    rigid = seen_by(None)
    giving = {number for number, _ in places}
    # Made of the model alone: of each other they would ask on without end, twice as long with every fit.
    beside = [
        (
            member.candidate.at(
                robot, member.entry.placed.shape, seen_by(number) if number in giving else rigid
            ),
            values,
        )
        for number, member, values in torques
        if number != but
    ]
    whole = seen_by(but)
    places_of = (whole.places, whole.own) if isinstance(whole, PresentWith) else ()
    return PresentWith(model, tuple(beside), apart, *places_of)


def standard_of(problem: Problem, found: Found) -> FloatArray:
    """(p,) parameters of the model beside a set, at its posterior mean."""
    base = problem.base
    return base.standard_from(problem.beta.mean(found.posterior.known), base.model.prior())


def _in_links(problem: Problem, links: FloatArray) -> FloatArray:
    """(p,) standard parameters of links (n, 10)."""
    model = problem.base.model
    body = next(effect for effect in model.effects if isinstance(effect, RigidBody))
    start = model.parameters.index(body.parameters[0])
    added = np.zeros(len(model.names))
    added[start : start + links.size] = links.reshape(-1)
    return added
