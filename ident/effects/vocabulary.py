"""The vocabulary: every effect that has a name here (method.md 6).

A file in this folder that declares a :class:`Family` with a ``row`` is part of it; nothing else lists it.
"""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from pkgutil import iter_modules

from ident import effects
from ident.effects.entry import EffectEntry
from ident.effects.family import PlacedEffect, PresentModel
from ident.effects.found import Found
from ident.effects.placed import Family, Placed
from ident.effects.term_family import TERM, is_term, term_family
from ident.errors import IdentificationError
from robots.description import Robot


def _declared() -> tuple[Family, ...]:
    """Every family of the effects' own files that has a row, in that order."""
    names = (found.name for found in iter_modules(effects.__path__, f"{effects.__name__}."))
    modules = (import_module(name) for name in names if name != __name__)
    values = (value for module in modules for value in vars(module).values())
    families = {value.name: value for value in values if isinstance(value, Family) and value.row}
    return tuple(sorted(families.values(), key=lambda family: (family.row, family.name)))


VOCABULARY = _declared()


def family_named(name: str) -> Family:
    """The family of a name of the vocabulary.

    Raises:
        IdentificationError: no such name; lists those that there are.
    """
    for family in VOCABULARY:
        if family.name == name:
            return family
    raise IdentificationError(
        f"effect {name} is not in the vocabulary; allowed: {', '.join(f.name for f in VOCABULARY)}"
    )


def confused_with(name: str) -> tuple[str, ...]:
    """Names that the same data often cannot tell from one of the vocabulary, in its order.

    Each is declared on one of the two and holds for both. A name that is not in the vocabulary has none.
    """
    own = {other for family in VOCABULARY if family.name == name for other in family.confused_with}
    return tuple(
        family.name
        for family in VOCABULARY
        if family.name != name and (family.name in own or name in family.confused_with)
    )


def hidden_from_motion(one: str, other: str) -> bool:
    """Whether no motion tells two names of the vocabulary apart at one place: it is declared on either."""
    pairs = {(family.name, name) for family in VOCABULARY for name in family.not_by_motion}
    return (one, other) in pairs or (other, one) in pairs


def form_of(robot: Robot, name: str, shape_names: Collection[str]) -> Family:
    """The form of a name of the vocabulary that has these shapes; the first one where none has.

    A term's name is its formula; it has one form.

    Raises:
        IdentificationError: no such name.
    """
    if is_term(name):
        return term_family(robot, name.removeprefix(TERM))
    family = family_named(name)
    for form in family.nested:
        named = ({shape.name for shape in form.shapes(robot, place)} for place in form.places(robot))
        if set(shape_names) in named:
            return form
    return family


def entry_of(robot: Robot, placed: PlacedEffect) -> EffectEntry:
    """The plain values of a placed effect."""
    values = zip(placed.shape_names, placed.shape, strict=True)
    return EffectEntry(
        placed.name,
        tuple(joint + 1 for joint in placed.place.joints),
        dict(values),
        placed.source if isinstance(placed, Found) else "",
    )


def effect_from(robot: Robot, entry: EffectEntry, present: PresentModel) -> Placed:
    """The placed effect of plain values, on this arm.

    Raises:
        IdentificationError: no such effect, no such place on this arm, or other shape parameters.
    """
    family = form_of(robot, entry.name, entry.shape)
    joints = tuple(joint - 1 for joint in entry.joints)
    places = [place for place in family.places(robot) if place.joints == joints]
    if not places:
        allowed = "; ".join(
            ", ".join(str(joint + 1) for joint in place.joints) or "none" for place in family.places(robot)
        )
        raise IdentificationError(f"{entry.name} at joints {list(entry.joints)}; allowed: {allowed}")
    shapes = family.shapes(robot, places[0])
    wanted = [shape.name for shape in shapes]
    given = {shape.name: shape.usual for shape in shapes if shape.usual is not None} | dict(entry.shape)
    if set(wanted) != set(given):
        raise IdentificationError(
            f"{entry.name} with shape {sorted(entry.shape)}; allowed: {', '.join(wanted) or 'none'}"
        )
    return family.effect(robot, places[0], tuple(given[name] for name in wanted), present)
