"""How an effect shows in the base parameters: the directions in which it moves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.drift.geometry import Geometry
from ident.drift.values import DriftSettings
from ident.effects.found import Found
from robots.arrays import FloatArray
from robots.standard import DRIVE_VARIANTS, LINK_SYMBOLS

_WORDS = {
    "Fc": ("coulomb_friction", "Coulomb friction"),
    "Fv": ("viscous_friction", "viscous friction"),
    "off": ("current_offset", "torque offset"),
    "Ia": ("rotor_inertia", "rotor inertia"),
}
_SIDES = {"p": " in the positive direction", "n": " in the negative direction", "m": " (coupled shaft)"}
_USUAL = {symbol: (*words, "") for symbol, words in _WORDS.items()} | {
    form: (*_WORDS[symbol], _SIDES[form[-1]]) for form, symbol in DRIVE_VARIANTS.items()
}
"""Effect and words of a drive's parameter, and of which side or shaft."""
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
    return np.column_stack(_of_last_link(geometry)[4:])


def _per_joint(geometry: Geometry) -> list[Pattern]:
    found = []
    for column, parameter in enumerate(geometry.base.model.parameters):
        if not parameter.is_usual(_USUAL) or parameter.joint is None:
            continue
        effect, words, side = _USUAL[parameter.symbol]
        joint = parameter.joint + 1
        said = f"{words} of joint {joint}{side}"
        direction = geometry.base.relation[:, column]
        leading = int(np.argmax(np.abs(direction)))
        value = float(geometry.beta[leading] / direction[leading])
        has_share = effect != "current_offset" and _is_worth_a_share(value * direction, geometry)
        scale = value if has_share else None
        found.append(Pattern(effect, joint, said, direction[:, np.newaxis], (parameter.unit,), scale))
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
    columns = _of_last_link(geometry)[:4]
    # An axis along a rail feels a mass and none of its moments.
    seen = [k for k, column in enumerate(columns) if np.abs(column).max() > _SEEN]
    if not seen:
        return []
    units = tuple(("kg", "kg·m", "kg·m", "kg·m")[k] for k in seen)
    directions = np.column_stack([columns[k] for k in seen])
    return [Pattern("payload", None, "payload on the tool", directions, units)]


def _found(geometry: Geometry) -> list[Pattern]:
    """What the baseline has found before may have become more or less."""
    base = geometry.base
    patterns = []
    for effect, columns in base.model.columns_of_effects:
        own = np.flatnonzero((base.independent >= columns.start) & (base.independent < columns.stop))
        # Usual friction that a baseline was made without, and found, is a usual effect here.
        if not isinstance(effect, Found) or any(p.is_usual(_USUAL) for p in effect.parameters):
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


def _of_last_link(geometry: Geometry) -> list[FloatArray]:
    """Directions (b,) of the ten parameters of the last link."""
    model, last = geometry.base.model, geometry.joints - 1
    columns = [k for k, p in enumerate(model.parameters) if p.joint == last and p.is_usual(LINK_SYMBOLS)]
    return list(geometry.base.relation[:, columns].T)


def _is_seen(pattern: Pattern) -> bool:
    return bool(np.abs(pattern.directions).max() > _SEEN)
