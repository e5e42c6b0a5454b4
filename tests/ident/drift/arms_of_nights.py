"""Nights of an arm drawn from known parameters: what the comparison's tests share."""

from __future__ import annotations

import numpy as np

import robots
from ident import RegressorModel, base_parameters
from ident.drift import Geometry, Night
from ident.parameters.base import random_states
from robots.arrays import FloatArray


def geometry(name: str = "tx40", seed: int = 0, friction: float = 1.0) -> Geometry:
    """Of random states within the limits, with the parameters of the description and some friction."""
    robot = robots.load(name)
    base = base_parameters(RegressorModel.of(robot))
    rows = base.columns(random_states(robot, seed, 400))
    rng = np.random.default_rng(seed)
    standard = {}
    for column, symbol in enumerate(base.model.names):
        standard[symbol] = float(rng.uniform(0.5, 2.0)) if symbol[0] in "FMIo" else float(rng.uniform(0, 0.1))
        assert base.model.names[column] == symbol
        standard[symbol] *= friction if symbol[0] == "F" else 1.0
    moments = np.einsum("sia,sjb->ijab", rows, rows, optimize=True) / len(rows)
    return Geometry(base, moments, np.full(robot.n, 0.05), base.regroup(standard))


def covariance_within(made: Geometry, samples: int = 400) -> FloatArray:
    """(b, b) of least squares on so many samples per joint."""
    information = np.einsum("j,jjab->ab", samples / made.sigma**2, made.moments)
    return np.asarray(np.linalg.inv(information))


def draw_nights(
    made: Geometry,
    count: int,
    seed: int,
    *,
    change: FloatArray | None = None,
    first: int = 0,
    ramp: bool = False,
    between: float = 0.004,
    per_kelvin: float = -0.01,
) -> list[Night]:
    """Nights with noise within the run, friction that varies between runs and with temperature.

    From night ``first`` on the parameters are moved by ``change`` (a ramp reaches it on the last night).
    """
    rng = np.random.default_rng(seed)
    within = covariance_within(made)
    root = np.linalg.cholesky(within)
    friction = np.array([name.startswith("F") for name in made.base.names])
    nights = []
    for night in range(count):
        celsius = 22.0 + 4.0 * np.sin(night / 9.0) + rng.normal(0.0, 1.0)
        values = made.beta * (
            1.0 + friction * (per_kelvin * (celsius - 22.0) + rng.normal(0, between, made.beta.size))
        )
        values = values + root @ rng.normal(size=made.beta.size)
        if change is not None and night >= first:
            values = values + change * ((night - first + 1) / (count - first) if ramp else 1.0)
        nights.append(
            Night(float(night), values, within, np.full(made.joints, celsius), True, f"night {night}")
        )
    return nights
