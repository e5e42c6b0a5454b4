"""The vocabulary on this arm: every name at every place, with every shape of its grids, as white columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.evidence.rows import Rows, WhiteEffects
from ident.effects.family import EffectFamily, Place, PlacedEffect, PresentModel, Shape
from ident.effects.simulated import Bristle, FrictionTorque, HasSimulatedParts
from robots.description import Robot


@dataclass(frozen=True, eq=False)
class Candidate:
    """One form of a name at one place.

    Attributes:
        family: the form.
        place: where.
        shapes: its shape parameters there.
        names, places, forms: how many names there are, places for this one, and forms of it at this place.
    """

    family: EffectFamily
    place: Place
    shapes: tuple[Shape, ...]
    names: int
    places: int
    forms: int

    @property
    def key(self) -> tuple[str, tuple[int, ...]]:
        """Name and place, which an answer gives; forms are not told apart."""
        return self.family.name, self.place.joints

    @property
    def share(self) -> float:
        """Of the prior: equal per name, divided among its places and forms."""
        return 1.0 / (self.names * self.places * self.forms)

    @property
    def is_scanned(self) -> bool:
        """Whether the data say which of its shapes are tried (:mod:`..decide.scanned`)."""
        return bool(self.over)

    @property
    def over(self) -> str:
        """What its scanned shapes are of: ``position``, ``time``, a ``corner``, or nothing."""
        return next((shape.scanned for shape in self.shapes if shape.scanned), "")

    @property
    def combinations(self) -> int:
        """Of its grids' values."""
        return math.prod(len(shape.grid) for shape in self.shapes)

    def at(self, robot: Robot, shape: tuple[float, ...], present: PresentModel) -> PlacedEffect:
        """The effect with these shape values."""
        return self.family.effect(robot, self.place, shape, present)


@dataclass(frozen=True, eq=False)
class Entry:
    """A candidate with one shape of its grid."""

    candidate: Candidate
    placed: PlacedEffect
    white: WhiteEffects

    @cached_property
    def is_friction(self) -> bool:
        """As :func:`is_friction`; kept, since each round asks it of each entry."""
        return is_friction(self.placed)

    @cached_property
    def is_law_of_speed(self) -> bool:
        """As :func:`is_law_of_speed`, kept as well."""
        return is_law_of_speed(self.candidate.family, self.placed)


def is_friction(placed: PlacedEffect) -> bool:
    """Whether an effect is torque against the speed of a drive."""
    return _friction_of(placed) is not None


def is_law_of_speed(form: EffectFamily, placed: PlacedEffect) -> bool:
    """Whether an effect is friction that follows a drive's speed where it moves, and nothing else."""
    friction = None if form.shows == "reversal" else _friction_of(placed)
    return friction is not None and all(
        not isinstance(one.law, Bristle)
        and one.direction == 0
        and one.curve is None
        and one.course is None
        and one.load_row is None
        and one.warming is None
        and one.other_row is None
        for one in friction
    )


def _friction_of(placed: PlacedEffect) -> tuple[FrictionTorque, ...] | None:
    """Friction of an effect beside its damping; None where it has neither."""
    if not isinstance(placed, HasSimulatedParts):
        return None
    parts = placed.simulated(np.ones(len(placed.parameters)))
    return parts.friction if parts.friction or parts.damping is not None else None


def candidates(robot: Robot, families: Sequence[EffectFamily]) -> tuple[Candidate, ...]:
    """Every form of every name at every place of this arm."""
    with_places = [(family, family.places(robot)) for family in families if family.places(robot)]
    found = []
    for family, places in with_places:
        forms = [(form, form.places(robot)) for form in family.nested]
        for form, own in forms:
            for place in own:
                count = sum(place in others for _, others in forms)
                shapes = form.shapes(robot, place)
                found.append(Candidate(form, place, shapes, len(with_places), len(places), count))
    return tuple(found)


def library(
    rows: Rows,
    wanted: Sequence[Candidate],
    present: PresentModel,
) -> tuple[Entry, ...]:
    """Candidates with every combination of their grids, those that the data show anything of.

    What is scanned is not among them.
    """
    some = [candidate for candidate in wanted if not candidate.is_scanned]
    made = at_once(lambda candidate: _entries(rows, candidate, present), some)
    entries = tuple(entry for some in made for entry in some)
    rows.keep_products_with([entry.white for entry in entries])
    return entries


def _entries(rows: Rows, candidate: Candidate, present: PresentModel) -> list[Entry]:
    """A candidate with every combination of its grids."""
    entries = []
    for shape in product(*(one.grid for one in candidate.shapes)):
        placed = candidate.at(rows.prepared.robot, shape, present)
        white = rows.effect(placed, single=True)
        if white.there:
            entries.append(Entry(candidate, placed, white))
    return entries
