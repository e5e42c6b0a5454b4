"""The regressor of an arm: the columns of its effects side by side, over all standard parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    CurrentOffset,
    Effect,
    FrictionSign,
    RigidBody,
    RotorInertia,
    State,
    ViscousFriction,
    WristCoupling,
)
from ident.effects.family import StandardParameter
from ident.effects.wrist_coupling import coupled_drives
from robots import cad_parameters, link_parameter_names, rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class RegressorModel:
    """The inverse dynamic model τ = IDM(q, q̇, q̈) · p over standard parameters p (eq. 2 before grouping).

    Attributes:
        robot: the arm.
        effects: what its torque consists of, in column order.
    """

    robot: Robot
    effects: tuple[Effect, ...]

    @classmethod
    def of(cls, robot: Robot) -> RegressorModel:
        """The usual model: links, rotors, viscous and Coulomb friction, coupled drives, offsets."""
        settings = robot.identification
        sign = FrictionSign(settings.friction_sign, settings.friction_width)
        effects: list[Effect] = [RigidBody(robot)]
        if settings.rotor_inertia:
            effects.append(RotorInertia(robot))
        if settings.friction == "asymmetric":
            effects.append(AsymmetricFriction(robot, sign))
        else:
            effects += [ViscousFriction(robot), CoulombFriction(robot, sign)]
        if np.any(settings.offset):
            effects.append(CurrentOffset(robot))
        if coupled_drives(robot):
            effects.append(WristCoupling(robot, sign))
        return cls(robot, tuple(effects))

    @cached_property
    def parameters(self) -> tuple[StandardParameter, ...]:
        """One per column."""
        return tuple(parameter for effect in self.effects for parameter in effect.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """Standard parameter names, one per column."""
        return tuple(parameter.name for parameter in self.parameters)

    @cached_property
    def columns_of_effects(self) -> tuple[tuple[Effect, slice], ...]:
        """Each effect and which columns are its own."""
        ends = list(accumulate(len(effect.parameters) for effect in self.effects))
        return tuple(
            (effect, slice(start, end))
            for effect, start, end in zip(self.effects, [0, *ends], ends, strict=False)
        )

    def columns(self, state: State) -> FloatArray:
        """The standard regressor, samples × joints × p."""
        return np.concatenate([effect.columns(state) for effect in self.effects], axis=2)

    def standard_parameters(self, values: dict[str, float]) -> FloatArray:
        """A standard vector (p,) from named values; what is not named is zero."""
        return np.array([values.get(name, 0.0) for name in self.names])

    def prior(self) -> FloatArray:
        """The standard vector (p,) of URDF inertias and the drives' a-priori figures."""
        links = cad_parameters(rigid_body_model(self.robot))
        named = dict(zip(link_parameter_names(self.robot.n), links, strict=True))
        return self.standard_parameters(named | drive_parameters(self.robot))


def drive_parameters(
    robot: Robot,
    inertia: FloatArray | None = None,
    viscous: FloatArray | None = None,
    coulomb: FloatArray | None = None,
) -> dict[str, float]:
    """Parameters of the drives at their outputs, written as the model's Ia, Fv, Fc, Iam, Fvm, Fcm.

    A drive that moves with one joint gives that joint its Ia, Fv and Fc. A coupled drive gives its
    inertia and viscous friction to every joint it moves with (the diagonal of TᵀDT) and, once more, to
    the coupling between them; its Coulomb friction belongs to the coupling alone.

    Args:
        robot: the arm; its description's figures stand in for what is not given.
        inertia, viscous, coulomb: one per drive, at the drive output, SI.
    """
    described = [drive.dynamics for drive in robot.drive]
    inertia = np.array([d.inertia for d in described]) if inertia is None else inertia
    viscous = np.array([d.viscous for d in described]) if viscous is None else viscous
    coulomb = np.array([d.coulomb for d in described]) if coulomb is None else coulomb
    squared = robot.transmission_matrix**2
    coupled = coupled_drives(robot)
    values: dict[str, float] = {}
    for joint in range(robot.n):
        values[f"Ia{joint + 1}"] = float(squared[:, joint] @ inertia)
        values[f"Fv{joint + 1}"] = float(squared[:, joint] @ viscous)
        own = [abs(row[joint]) for k, row in enumerate(robot.transmission_matrix) if k not in coupled]
        own_drives = [k for k in range(robot.n) if k not in coupled]
        values[f"Fc{joint + 1}"] = float(np.dot(own, coulomb[own_drives]))
        for direction in ("p", "n"):
            values[f"Fv{direction}{joint + 1}"] = values[f"Fv{joint + 1}"]
            values[f"Fc{direction}{joint + 1}"] = values[f"Fc{joint + 1}"]
    for drive in coupled:
        values[f"Iam{drive + 1}"] = float(inertia[drive])
        values[f"Fvm{drive + 1}"] = float(viscous[drive])
        values[f"Fcm{drive + 1}"] = float(coulomb[drive])
    return values
