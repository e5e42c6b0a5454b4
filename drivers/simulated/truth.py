"""What the simulated arm really is: standard parameters and noise levels, drawn from a seed.

The description of an arm holds data-sheet figures. No real arm has exactly those, so the plant gets
figures drawn around them, and an identification has something to find.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from drivers.simulated.device import described_increments
from robots import Robot, rigid_body_model
from robots.arrays import FloatArray
from robots.pseudo_inertia import link_of_pseudo_inertia, pseudo_inertia
from robots.standard import cad_parameters, link_parameter_names

LINK_SPREAD = 0.10
INERTIA_SPREAD = 0.10
FRICTION_SPREAD = 0.20
OFFSET_SHARE = 0.02
"""Largest torque offset as a share of the joint's torque limit."""
TORQUE_NOISE_SHARE = 0.05
"""Standard deviation of the process torque as a share of the Coulomb friction."""
BRISTLE_WIDTH = {"revolute": 2e-5, "prismatic": 2e-6}
"""Pre-sliding displacement at which Coulomb friction is fully developed, rad or m."""
ENCODER_NOISE_DEGREES = {"tx40": (5.7e-5, 5.7e-5, 12.2e-5, 11.4e-5, 12.2e-5, 17.2e-5)}
"""Measured position noise of known arms, degrees rms at the drive outputs; others get half a count."""

_LINK_SIZE = 10


@dataclass(frozen=True)
class PlantTruth:
    """Every figure of one simulated arm; the answer that an identification is scored against.

    ``parameters`` maps standard parameter names to values: the link inertials in the joint frames
    (``M1 MX1 … ZZ1``), then ``Ia1 Fv1 Fc1`` … at the drive outputs and ``off1`` … at the joints. Tuples
    have n entries.
    """

    robot: str
    seed: int
    parameters: dict[str, float]
    gain: tuple[float, ...]
    """True drive gains, N·m (or N) at the drive output per unit of the control signal."""
    torque_noise: tuple[float, ...]
    """Standard deviation of the process torque at the drive outputs at each plant step, N·m."""
    torque_noise_time_constant: float
    """0 for white torque noise; else the time constant of first-order coloured noise, s."""
    encoder_noise: tuple[float, ...]
    """Standard deviation of a position reading before it is rounded to counts, rad or m."""
    bristle_width: tuple[float, ...]
    """Pre-sliding displacement of the Coulomb friction, rad or m."""

    def per_drive(self, prefix: str) -> FloatArray:
        """The figures ``prefix1 … prefixn`` (Ia, Fv, Fc or off), shape (n,)."""
        return np.array([self.parameters[f"{prefix}{j + 1}"] for j in range(len(self.gain))])

    def link(self, index: int) -> FloatArray:
        """Dynamic parameters of link ``index`` (from 1) in pinocchio's order, shape (10,)."""
        names = link_parameter_names(len(self.gain))[_LINK_SIZE * (index - 1) : _LINK_SIZE * index]
        return np.array([self.parameters[name] for name in names])

    def as_dict(self) -> dict[str, Any]:
        """A dict of plain numbers that JSON can hold without loss."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of :meth:`as_dict`, also after a JSON round trip."""
        return cls(
            robot=values["robot"],
            seed=values["seed"],
            parameters=dict(values["parameters"]),
            gain=tuple(values["gain"]),
            torque_noise=tuple(values["torque_noise"]),
            torque_noise_time_constant=values["torque_noise_time_constant"],
            encoder_noise=tuple(values["encoder_noise"]),
            bristle_width=tuple(values["bristle_width"]),
        )


def nominal_truth(robot: Robot) -> PlantTruth:
    """An arm exactly as described, without noise: for physics checks."""
    n = robot.n
    links = dict(zip(link_parameter_names(n), cad_parameters(rigid_body_model(robot)), strict=True))
    parameters = {name: float(value) for name, value in links.items()}
    for j, drive in enumerate(robot.drive, start=1):
        parameters |= {
            f"Ia{j}": drive.dynamics.inertia,
            f"Fv{j}": drive.dynamics.viscous,
            f"Fc{j}": drive.dynamics.coulomb,
            f"off{j}": 0.0,
        }
    return PlantTruth(
        robot=robot.name,
        seed=0,
        parameters=parameters,
        gain=tuple(float(g) for g in robot.gains),
        torque_noise=(0.0,) * n,
        torque_noise_time_constant=0.0,
        encoder_noise=(0.0,) * n,
        bristle_width=tuple(BRISTLE_WIDTH[joint.kind] for joint in robot.joint),
    )


def draw_truth(robot: Robot, seed: int = 0) -> PlantTruth:
    """Draws an arm around the description: links and Ia ±10 %, friction ±20 %, offsets of some percent.

    The links stay physically consistent, since their pseudo-inertia is changed by congruence.

    Args:
        robot: the description that gives the centre of the draw.
        seed: the same seed always gives the same arm.
    """
    nominal = nominal_truth(robot)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x7E57]))
    parameters = dict(nominal.parameters)
    names = link_parameter_names(robot.n)
    for j in range(robot.n):
        drawn = _draw_link(nominal.link(j + 1), rng)
        link_names = names[_LINK_SIZE * j : _LINK_SIZE * (j + 1)]
        parameters |= {name: float(value) for name, value in zip(link_names, drawn, strict=True)}
    for j, joint in enumerate(robot.joint, start=1):
        parameters[f"Ia{j}"] *= 1.0 + INERTIA_SPREAD * rng.uniform(-1, 1)
        parameters[f"Fv{j}"] *= 1.0 + FRICTION_SPREAD * rng.uniform(-1, 1)
        parameters[f"Fc{j}"] *= 1.0 + FRICTION_SPREAD * rng.uniform(-1, 1)
        parameters[f"off{j}"] = OFFSET_SHARE * joint.torque * float(rng.uniform(-1, 1))
    coulomb = [parameters[f"Fc{j + 1}"] for j in range(robot.n)]
    return PlantTruth(
        robot=robot.name,
        seed=seed,
        parameters=parameters,
        gain=nominal.gain,
        torque_noise=tuple(TORQUE_NOISE_SHARE * value for value in coulomb),
        torque_noise_time_constant=0.0,
        encoder_noise=_encoder_noise(robot),
        bristle_width=nominal.bristle_width,
    )


def _draw_link(link: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Another body of nearly the same mass, shape and place: P → G P Gᵀ."""
    mass_ratio, stretch, shift = (
        1.0 + LINK_SPREAD * rng.uniform(-1, 1),
        rng.uniform(-1, 1, (3, 3)),
        rng.uniform(-1, 1, 3),
    )
    pseudo = pseudo_inertia(link)
    radius = np.sqrt(max(np.trace(pseudo[:3, :3]), 0.0) / link[0]) if link[0] > 0 else 0.0
    change = np.eye(4)
    change[:3, :3] += 0.5 * LINK_SPREAD * stretch
    change[:3, 3] = 0.5 * LINK_SPREAD * radius * shift
    return link_of_pseudo_inertia(mass_ratio * change @ pseudo @ change.T)


def _encoder_noise(robot: Robot) -> tuple[float, ...]:
    known = ENCODER_NOISE_DEGREES.get(robot.name)
    if known is not None and len(known) == robot.n:
        return tuple(float(value) for value in np.deg2rad(known))
    increments = described_increments(robot)
    return tuple(float(value) for value in 0.5 / np.abs(increments))
