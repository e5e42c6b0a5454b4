"""A one-axis rig whose dry friction is the force of a soft constraint, simulated by the law under test."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from ident import BaseParameters, Recording, RegressorModel, base_parameters
from ident.discrepancy.loop_parts import simulated_with
from ident.discrepancy.settings import searching
from ident.effects import FrictionSign
from ident.effects.simulated import SoftConstraint
from robots.arrays import FloatArray

NOISE = 1e-2
"""Of the control signal, V."""


@cache
def rig(motion: int = 0) -> tuple[BaseParameters, FloatArray, Recording]:
    """The rig with its standard parameters, and a recording that says what it is to follow."""
    robot = robots.load("emps")
    path = simulate_offline(robot, draw_truth(robot, 3), exercise(robot, 5.0, motion), periods=2, seed=1)
    given = Recording(f"given {motion}", path.time, path.reference, path.position, path.control_signal)
    base = base_parameters(RegressorModel.of(searching(robot, given)))
    return base, base.model.prior(), given


def recorded(law: SoftConstraint | FrictionSign, motion: int = 0) -> Recording:
    """What such a rig does of a motion."""
    base, standard, given = rig(motion)
    run = simulated_with(base, standard, (law,), given)
    noise = NOISE * np.random.default_rng(motion).normal(size=run.control_signal.shape)
    return replace(given, position=run.position, control_signal=run.control_signal + noise)
