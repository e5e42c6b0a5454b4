"""The library of effects: everything a joint torque can consist of, one small file each.

An effect is one object whose ``columns`` serve the regressor and, times its parameters, the simulation.
"""

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
    from ident.effects.drive_terms import (
        AsymmetricFriction,
        CoulombFriction,
        CurrentOffset,
        RotorInertia,
        ViscousFriction,
    )
    from ident.effects.family import Effect
    from ident.effects.rigid_body import RigidBody
    from ident.effects.speed_term import FrictionSign, HasSpeedTerms, SpeedTerm, speed_columns
    from ident.effects.state import State
    from ident.effects.wrist_coupling import WristCoupling

__all__ = [
    "AsymmetricFriction",
    "CoulombFriction",
    "CurrentOffset",
    "Effect",
    "FrictionSign",
    "HasSpeedTerms",
    "RigidBody",
    "RotorInertia",
    "SpeedTerm",
    "State",
    "ViscousFriction",
    "WristCoupling",
    "speed_columns",
]

__getattr__ = exporter(
    __name__,
    {
        "ident.effects.drive_terms": (
            "AsymmetricFriction",
            "CoulombFriction",
            "CurrentOffset",
            "RotorInertia",
            "ViscousFriction",
        ),
        "ident.effects.family": (
            "Effect",
            "State",
        ),
        "ident.effects.rigid_body": ("RigidBody",),
        "ident.effects.speed_term": (
            "FrictionSign",
            "HasSpeedTerms",
            "SpeedTerm",
            "speed_columns",
        ),
        "ident.effects.wrist_coupling": ("WristCoupling",),
    },
)
