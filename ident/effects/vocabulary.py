"""The vocabulary: every effect that has a name here (method.md 6)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from ident.effects.base_tilt import BASE_TILT
from ident.effects.coupled_pair import WRIST_COUPLING
from ident.effects.current_loop_lag import CURRENT_LOOP_LAG
from ident.effects.directional_efficiency import DIRECTIONAL_EFFICIENCY
from ident.effects.drifting_friction import DRIFTING_FRICTION
from ident.effects.drive_gain_error import DRIVE_GAIN_ERROR
from ident.effects.elastic_gear import BACKLASH, JOINT_ELASTICITY
from ident.effects.family import PlacedEffect, PresentModel
from ident.effects.gear_ripple import GEAR_RIPPLE
from ident.effects.hysteresis import HYSTERESIS
from ident.effects.load_dependent_friction import LOAD_DEPENDENT_FRICTION
from ident.effects.nonlinear_viscous_friction import NONLINEAR_VISCOUS_FRICTION
from ident.effects.payload import PAYLOAD
from ident.effects.placed import Family, Placed
from ident.effects.position_dependent_friction import POSITION_DEPENDENT_FRICTION
from ident.effects.saturation import SATURATION
from ident.effects.springs import CABLE_SPRING, CONTACT, GRAVITY_SPRING
from ident.effects.stribeck_friction import STATIC_FRICTION, STRIBECK_FRICTION
from ident.effects.time_delay import TIME_DELAY
from ident.effects.torque_ripple import TORQUE_RIPPLE
from ident.effects.usual import (
    ASYMMETRIC_FRICTION,
    COULOMB_FRICTION,
    CURRENT_OFFSET,
    ROTOR_INERTIA,
    VISCOUS_FRICTION,
)
from ident.errors import IdentificationError
from robots.description import Robot

VOCABULARY: tuple[Family, ...] = (
    VISCOUS_FRICTION,
    COULOMB_FRICTION,
    ASYMMETRIC_FRICTION,
    STRIBECK_FRICTION,
    STATIC_FRICTION,
    NONLINEAR_VISCOUS_FRICTION,
    LOAD_DEPENDENT_FRICTION,
    DIRECTIONAL_EFFICIENCY,
    DRIFTING_FRICTION,
    POSITION_DEPENDENT_FRICTION,
    JOINT_ELASTICITY,
    BACKLASH,
    HYSTERESIS,
    WRIST_COUPLING,
    GEAR_RIPPLE,
    DRIVE_GAIN_ERROR,
    CURRENT_OFFSET,
    TORQUE_RIPPLE,
    SATURATION,
    ROTOR_INERTIA,
    CURRENT_LOOP_LAG,
    PAYLOAD,
    GRAVITY_SPRING,
    BASE_TILT,
    TIME_DELAY,
    CABLE_SPRING,
    CONTACT,
)


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


def form_of(robot: Robot, name: str, shape_names: Collection[str]) -> Family:
    """The form of a name of the vocabulary that has these shapes; the first one where none has.

    Raises:
        IdentificationError: no such name.
    """
    family = family_named(name)
    for form in (family, *family.forms):
        places = form.places(robot)
        if places and {shape.name for shape in form.shapes(robot, places[0])} == set(shape_names):
            return form
    return family


@dataclass(frozen=True)
class EffectEntry:
    """A placed effect as plain values: what a model file holds. Joints count from 1."""

    name: str
    joints: tuple[int, ...]
    shape: Mapping[str, float]


def entry_of(robot: Robot, placed: PlacedEffect) -> EffectEntry:
    """The plain values of a placed effect."""
    values = zip(placed.shape_names, placed.shape, strict=True)
    return EffectEntry(
        placed.name,
        tuple(joint + 1 for joint in placed.place.joints),
        dict(values),
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
    wanted = [shape.name for shape in family.shapes(robot, places[0])]
    if set(wanted) != set(entry.shape):
        raise IdentificationError(
            f"{entry.name} with shape {sorted(entry.shape)}; allowed: {', '.join(wanted) or 'none'}"
        )
    return family.effect(robot, places[0], tuple(entry.shape[name] for name in wanted), present)
