"""What the drives' parameters may be in nature, and how far a prior is believed to be from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    Effect,
    RotorInertia,
    ViscousFriction,
    WristCoupling,
)
from ident.effects.wrist_coupling import coupled_drives
from ident.parameters.base import BaseParameters, random_states
from robots.arrays import BoolArray, FloatArray
from robots.pseudo_inertia import LINK_SIZE

_UNKNOWN_SHARE = 0.02
"""A parameter whose prior is zero is believed to make about this share of a joint's torque limit."""

_AT_BOUND = 1e-3
"""A parameter is at its limit within this share of its scale."""

_NEVER_NEGATIVE = (RotorInertia, ViscousFriction, CoulombFriction, AsymmetricFriction, WristCoupling)


@dataclass(frozen=True)
class Scalars:
    """The standard parameters that are not those of links.

    Attributes:
        names: (k,).
        prior: (k,).
        scale: (k,) unit in which a departure from the prior is counted.
        pulled: (k,) false where the data alone decide: the parameter is a base parameter by itself.
        lower, upper: (k,) bounds, ±∞ where there are none.
        positive: matrices that must be positive semidefinite: each a name and (k, n, n) per unit of each.
    """

    names: tuple[str, ...]
    prior: FloatArray
    scale: FloatArray
    pulled: BoolArray
    lower: FloatArray
    upper: FloatArray
    positive: tuple[tuple[str, FloatArray], ...]

    @classmethod
    def of(cls, base: BaseParameters, prior: FloatArray) -> Scalars:
        """Those of a model about a prior standard vector (p,)."""
        robot = base.model.robot
        first = LINK_SIZE * robot.n
        names = base.model.names[first:]
        values = prior[first:]
        alone = np.abs(base.relation[np.count_nonzero(base.relation, axis=1) == 1]).max(axis=0, initial=0.0)
        pulled = alone[first:] == 0.0
        scale = np.abs(values)
        unknown = (scale == 0.0) & pulled
        if unknown.any():
            scale[unknown] = _scale_by_torque(base)[first:][unknown]
        scale[scale == 0.0] = 1.0
        bounds = np.array([bound for effect in base.model.effects[1:] for bound in _bounds(effect)])
        lower, upper = bounds.reshape(-1, 2).T
        return cls(names, values, scale, pulled, lower, upper, _positive(base, names))

    def holding(self, standard: FloatArray, before: FloatArray) -> tuple[str, ...]:
        """Names of the limits that a standard vector (p,) lies at and that an earlier one (p,) was beyond."""
        if not self.names:
            return ()
        values, earlier = standard[-len(self.names) :], before[-len(self.names) :]
        near = _AT_BOUND * self.scale
        low = (values - self.lower < near) & (earlier < self.lower)
        high = (self.upper - values < near) & (earlier > self.upper)
        found = [name for name, there in zip(self.names, low | high, strict=True) if there]
        for name, matrices in self.positive:
            now, then = (np.linalg.eigvalsh(np.einsum("k,kij->ij", v, matrices)) for v in (values, earlier))
            if now[0] < _AT_BOUND * now[-1] and then[0] < 0.0:
                found.append(name)
        return tuple(found)


def _bounds(effect: Effect) -> list[tuple[float, float]]:
    """Of each parameter of an effect; effects that the discrepancy search adds say their own."""
    count = len(effect.parameters)
    own = getattr(effect, "bounds", None)
    if own is not None:
        return list(own)
    return [(0.0 if isinstance(effect, _NEVER_NEGATIVE) else -np.inf, np.inf)] * count


def _positive(base: BaseParameters, names: tuple[str, ...]) -> tuple[tuple[str, FloatArray], ...]:
    """Coupled drives: diag(Ia) + Σ Iam_k (T_kT_kᵀ − its diagonal) ⪰ 0, and the same of viscous friction."""
    robot = base.model.robot
    coupled = coupled_drives(robot)
    found = []
    for own, shared, words in (("Ia", "Iam", "drive inertia"), ("Fv", "Fvm", "viscous friction")):
        if not all(f"{shared}{k + 1}" in names for k in coupled) or f"{own}1" not in names or not coupled:
            continue
        matrices = np.zeros((len(names), robot.n, robot.n))
        for joint in range(robot.n):
            matrices[names.index(f"{own}{joint + 1}"), joint, joint] = 1.0
        for drive in coupled:
            product = np.outer(robot.transmission_matrix[drive], robot.transmission_matrix[drive])
            matrices[names.index(f"{shared}{drive + 1}")] = product - np.diag(np.diag(product))
        moved = np.flatnonzero((robot.transmission_matrix[list(coupled)] != 0.0).any(axis=0))
        joints = ", ".join(str(joint + 1) for joint in moved)
        found.append((f"{words} of the coupled joints {joints}", matrices[:, moved][:, :, moved]))
    return tuple(found)


def _scale_by_torque(base: BaseParameters) -> FloatArray:
    """(p,) size of each parameter that makes its share of the torque limit in random motion."""
    robot = base.model.robot
    columns = base.model.columns(random_states(robot, seed=2, states=50))
    share = np.abs(columns).max(axis=0) / robot.torque_limits[:, np.newaxis]
    largest = share.max(axis=0)
    return np.asarray(np.where(largest > 0.0, _UNKNOWN_SHARE / np.maximum(largest, 1e-300), 1.0))
