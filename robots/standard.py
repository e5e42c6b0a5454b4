"""The standard parameters of a serial arm: their names (the paper's), order, units and CAD values.

Link order is Pinocchio's ``Inertia.toDynamicParameters``: mass, first moments and the inertia tensor
about the *joint frame* (not the centre of mass), so that the inverse dynamic model is linear in them.
Per drive: Ia, Fv, Fc at the drive output, and a torque offset per joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from robots.arrays import FloatArray

if TYPE_CHECKING:
    import pinocchio

LINK_SYMBOLS = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")
DRIVE_SYMBOLS = ("Ia", "Fv", "Fc", "off")

DRIVE_VARIANTS = {
    "Iam": "Ia",
    "Fvp": "Fv",
    "Fvn": "Fv",
    "Fvm": "Fv",
    "Fcp": "Fc",
    "Fcn": "Fc",
    "Fcm": "Fc",
}
"""Variants of a drive's parameter: forwards (p), backwards (n), of a shaft that moves several joints (m)."""

EITHER_UNIT = "N·m or N"
"""Of the torque of a joint of which nobody knows whether it turns or slides."""

_LINK_UNITS = dict.fromkeys(LINK_SYMBOLS, "kg·m²") | {
    "M": "kg",
    "MX": "kg·m",
    "MY": "kg·m",
    "MZ": "kg·m",
}
_DRIVE_UNITS = {
    "revolute": {"Ia": "kg·m²", "Fv": "N·m·s/rad", "Fc": "N·m", "off": "N·m"},
    "prismatic": {"Ia": "kg", "Fv": "N·s/m", "Fc": "N", "off": "N"},
}


def link_parameter_names(n: int) -> tuple[str, ...]:
    """Names of the 10·n link parameters, link by link: ``M1 MX1 … ZZ1 M2 …``."""
    return tuple(f"{symbol}{j}" for j in range(1, n + 1) for symbol in LINK_SYMBOLS)


def drive_parameter_names(n: int) -> tuple[str, ...]:
    """Names of the 4·n drive and joint parameters: ``Ia1 Fv1 Fc1 off1 Ia2 …``."""
    return tuple(f"{symbol}{j}" for j in range(1, n + 1) for symbol in DRIVE_SYMBOLS)


def cad_parameters(model: pinocchio.Model) -> FloatArray:
    """The link parameters that the URDF states, (10·n,), in the order of :func:`link_parameter_names`."""
    moving = [model.inertias[j].toDynamicParameters() for j in range(1, model.njoints)]
    return np.concatenate(moving).astype(np.float64)


def unit_of(symbol: str, kind: str) -> str:
    """The SI unit of a standard parameter by the kind of its joint: ``Fv`` is in N·m·s/rad or in N·s/m.

    Raises:
        KeyError: when the symbol is none of a link's or a drive's.
    """
    return _LINK_UNITS.get(symbol) or _DRIVE_UNITS[kind][DRIVE_VARIANTS.get(symbol, symbol)]


def torque_unit(kind: str) -> str:
    """Of what a joint takes: a torque where it turns, a force where it slides."""
    return unit_of("off", kind)


def torque_units_of(parameters: Mapping[str, str], n: int) -> tuple[str, ...]:
    """Units of the torques of n joints, as the units of a model's drive parameters tell their kinds.

    A model of the catalogue has no description of its arm with it. A joint without any parameter of its drive
    may be of either kind, and its unit says so.

    Args:
        parameters: unit by name, e.g. ``{"Fc1": "N"}``.
        n: number of joints.
    """
    return tuple(_torque_unit_of(parameters, str(joint)) for joint in range(1, n + 1))


def _torque_unit_of(parameters: Mapping[str, str], joint: str) -> str:
    for symbol in (*DRIVE_SYMBOLS, *DRIVE_VARIANTS):
        for kind in _DRIVE_UNITS:
            if parameters.get(symbol + joint) == unit_of(symbol, kind):
                return torque_unit(kind)
    return EITHER_UNIT
