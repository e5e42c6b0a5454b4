"""An identification that takes a moment: a moving carriage, known to the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident import Fitted, Recording, identify
from robots import Robot

MASS, VISCOUS, COULOMB, OFFSET = 95.0, 200.0, 20.0, -3.0


def carriage(emps: Robot) -> Fitted:
    """Identified without a reference, so by least squares alone."""
    time = np.arange(6000) * 1e-3
    rates = 2 * np.pi * np.array([0.4, 1.1, 1.9])
    sizes = np.array([0.05, 0.02, 0.01])
    phase = np.multiply.outer(time, rates)
    position = np.sin(phase) @ sizes
    velocity = np.cos(phase) @ (sizes * rates)
    acceleration = -np.sin(phase) @ (sizes * rates**2)
    force = MASS * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity) + OFFSET
    force += np.random.default_rng(0).normal(scale=1.0, size=time.size)
    signal = (force / emps.gains[0])[:, np.newaxis]
    recording = Recording("carriage.csv", time, None, position[:, np.newaxis], signal)
    return identify(emps, (recording,))


def endogenous(fitted: Fitted) -> Fitted:
    """The same with an estimate by instrumental variables and the verdict that recommends it."""
    result = fitted.result
    shifted = tuple(replace(p, value=p.value * 1.01) for p in result.least_squares.parameters)
    instrumental = replace(result.least_squares, method="iv", parameters=shifted, iterations=3)
    test = replace(result.test, verdict="endogenous", recommendation="Use the instrumental variables.")
    return replace(
        fitted, result=replace(result.with_estimates(instrumental), instrumental_reason="", test=test)
    )
