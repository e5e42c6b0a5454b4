"""Machine code of simulations, compiled once before tests run side by side; else each worker compiles it all.

python -m tests.compile_first ARM
"""

from __future__ import annotations

import sys

import numpy as np

import robots
from drivers.simulated import draw_truth
from drivers.simulated.offline import simulate_offline
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.effects.vocabulary import form_of
from ident.parameters.present import Present

_SAMPLES = 40


def main(arm: str) -> None:
    """A closed loop, which is compiled for a number of axes, one with a cable, and drives with one axis."""
    robot = robots.load(arm)
    home = np.tile(robot.home, (_SAMPLES, 1))
    if robot.n == 1:
        simulate_offline(robot, draw_truth(robot, 0), home)
    time = np.arange(_SAMPLES, dtype=np.float64) * robot.controller.sample_time
    recording = Recording(arm, time, home, home, np.zeros_like(home))
    model, form = RegressorModel.of(robot), form_of(robot, "cable_spring", ())
    simulate(model, model.prior(), recording)
    place = form.places(robot)[0]
    shape = tuple(shape.grid[0] for shape in form.shapes(robot, place))
    cable = form.effect(robot, place, shape, Present(model, model.prior()))
    whole = RegressorModel(robot, (*model.effects, cable))
    simulate(whole, np.append(model.prior(), np.zeros(len(cable.parameters))), recording)


if __name__ == "__main__":
    main(sys.argv[1])
