"""How an effect shows in the base parameters: the directions in which it moves them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.drift.geometry import Geometry
from ident.drift.values import DriftSettings
from ident.effects.found import Found
from robots.arrays import FloatArray

_LINK = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")
_WORDS = {
    "Fc": ("coulomb_friction", "Coulomb friction"),
    "Fv": ("viscous_friction", "viscous friction"),
    "off": ("current_offset", "torque offset"),
    "Ia": ("rotor_inertia", "rotor inertia"),
}
_NAME = re.compile(r"([A-Za-z]+?)(p|n|m)?(\d+)")
_SIDES = {"p": " in the positive direction", "n": " in the negative direction", "m": " (coupled shaft)"}
_SEEN = 1e-9
_LEAST_SHARE = 0.002
"""Share of a joint's torque below which the value of a parameter is nearly zero."""
WARMTH = "warmth"
"""Effect of a chart: all gears colder by so many kelvin, as far as no thermometer says so."""


@dataclass(frozen=True)
class Pattern:
    """One effect at one place.

    Attributes:
        effect: name as in the vocabulary of effects.
        joint: from 1; None for the tool.
        words: for an operator.
        directions: (b, m) change of the base parameters per unit of each of the m amounts.
        units: m of them; ``1`` for a share.
        scale: value of the first amount in the baseline; None where a share of it has no meaning.
    """

    effect: str
    joint: int | None
    words: str
    directions: FloatArray
    units: tuple[str, ...]
    scale: float | None = None


def patterns_of(geometry: Geometry) -> tuple[Pattern, ...]:
    """All effects that one look at the base parameters can tell apart on this arm.

    Friction, offset and rotor inertia of each joint, the gain of each drive (every parameter of the joint
    scaled together), a body on the tool by its mass and first moments, and effects that a search has found.
    """
    found = [*_per_joint(geometry), *_gains(geometry), *_payload(geometry), *_found(geometry)]
    return tuple(pattern for pattern in found if _is_seen(pattern))


def with_warmth(patterns: Sequence[Pattern], settings: DriftSettings) -> tuple[Pattern, ...]:
    """The effects and, last, the warmth of all gears together: in kelvin, positive where colder."""
    direction = np.zeros(patterns[0].directions.shape[0]) if patterns else np.zeros(0)
    for pattern in patterns:
        share, _ = warmth_share(pattern.effect, settings)
        if pattern.scale is not None and pattern.joint is not None:
            direction = direction + share * pattern.scale * pattern.directions[:, 0]
    if not direction.any():
        return tuple(patterns)
    words = "all gears as if colder"
    return (*patterns, Pattern(WARMTH, None, words, direction[:, np.newaxis], ("K",)))


def warmth_share(effect: str, settings: DriftSettings) -> tuple[float, float]:
    """Relative increase for each kelvin colder, and its deviation; zeros for what is not friction."""
    return {
        "coulomb_friction": (settings.coulomb_per_kelvin, settings.coulomb_per_kelvin_sigma),
        "viscous_friction": (settings.viscous_per_kelvin, settings.viscous_per_kelvin_sigma),
    }.get(effect, (0.0, 0.0))


def payload_inertia(geometry: Geometry) -> FloatArray:
    """Directions (b, 6) of a tool's moments of inertia: what a payload may move besides."""
    last = geometry.joints
    return np.column_stack([_direction(geometry, f"{symbol}{last}") for symbol in _LINK[4:]])


def _per_joint(geometry: Geometry) -> list[Pattern]:
    names, units = geometry.base.model.names, geometry.base.model.units
    found = []
    for name, unit in zip(names, units, strict=True):
        match = _NAME.fullmatch(name)
        if match is None or match[1] not in _WORDS:
            continue
        effect, words = _WORDS[match[1]]
        joint = int(match[3])
        said = f"{words} of joint {joint}{_SIDES.get(match[2] or '', '')}"
        direction = _direction(geometry, name)
        leading = int(np.argmax(np.abs(direction)))
        value = float(geometry.beta[leading] / direction[leading])
        has_share = effect != "current_offset" and _is_worth_a_share(value * direction, geometry)
        scale = value if has_share else None
        found.append(Pattern(effect, joint, said, direction[:, np.newaxis], (unit,), scale))
    return found


def _is_worth_a_share(torque_of: FloatArray, geometry: Geometry) -> bool:
    """A share of a value that is nearly zero says nothing."""
    usual = np.maximum(geometry.torque_rms(geometry.beta), np.finfo(float).tiny)
    return bool(np.max(geometry.torque_rms(torque_of) / usual) > _LEAST_SHARE)


def _gains(geometry: Geometry) -> list[Pattern]:
    return [
        Pattern(
            "drive_gain_error",
            drive + 1,
            f"drive gain of joint {drive + 1}",
            geometry.gain_direction(drive)[:, np.newaxis],
            ("1",),
        )
        for drive in range(geometry.joints)
    ]


def _payload(geometry: Geometry) -> list[Pattern]:
    last = geometry.joints
    columns = [_direction(geometry, f"{symbol}{last}") for symbol in _LINK[:4]]
    # An axis along a rail feels a mass and none of its moments.
    seen = [k for k, column in enumerate(columns) if np.abs(column).max() > _SEEN]
    if not seen:
        return []
    units = tuple(("kg", "kg·m", "kg·m", "kg·m")[k] for k in seen)
    directions = np.column_stack([columns[k] for k in seen])
    return [Pattern("payload", None, "payload on the tool", directions, units)]


def _found(geometry: Geometry) -> list[Pattern]:
    """What the baseline has found before may have become more or less."""
    base, end = geometry.base, 0
    patterns = []
    for effect in base.model.effects:
        start, end = end, end + len(effect.parameter_names)
        own = np.flatnonzero((base.independent >= start) & (base.independent < end))
        # Usual friction that a baseline was made without, and found, is a usual effect here.
        if not isinstance(effect, Found) or any(map(_is_usual, effect.parameter_names)):
            continue
        patterns.append(
            Pattern(
                effect.name,
                effect.place.joints[0] + 1 if effect.place.joints else None,
                f"{effect.name.replace('_', ' ')} of {effect.place.words}",
                np.eye(len(base.independent))[:, own],
                tuple(base.units[k] for k in own),
                float(geometry.beta[own[0]]) if len(own) == 1 else None,
            )
        )
    return patterns


def _is_usual(name: str) -> bool:
    match = _NAME.fullmatch(name)
    return match is not None and match[1] in _WORDS


def _direction(geometry: Geometry, standard: str) -> FloatArray:
    names = geometry.base.model.names
    if standard not in names:
        return np.zeros(geometry.base.relation.shape[0])
    return np.asarray(geometry.base.relation[:, names.index(standard)])


def _is_seen(pattern: Pattern) -> bool:
    return bool(np.abs(pattern.directions).max() > _SEEN)
