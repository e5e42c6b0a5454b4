"""Scenarios of the own simulated arm drawn from seeds, of half a noise floor to five, for the calibration.

What is hidden is drawn here and simulated by :mod:`drivers.simulated`, as in :mod:`benchmarks.naming`: a
tenth of the arms is clean, a tenth has something that the vocabulary lacks, a fifth two effects, which may
share a joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import robots
from benchmarks.evidence.case import UNKNOWN, Case, Truth
from benchmarks.naming import ARM, motion, record
from benchmarks.naming_report import NAMES
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.scenario import OUTSIDE_VOCABULARY, Scenario

_KINDS = (0.1, 0.6, 0.2, 0.1)
"""Chances: nothing, one effect, two, one that the vocabulary does not have."""

_SIZES = (0.5, 5.0)
"""Noise floors, equally likely per octave."""


@dataclass(frozen=True)
class Drawn:
    """What a seed hides: effects, and the size of each in noise floors."""

    effects: tuple[str, ...]
    size: float


def drawn_of(seed: int) -> Drawn:
    """What a seed rules but places and exact sizes."""
    random = np.random.default_rng([seed, 77])
    kind = int(random.choice(4, p=_KINDS))
    size = float(np.exp(random.uniform(*np.log(_SIZES))))
    names = OUTSIDE_VOCABULARY if kind == 3 else NAMES
    count = 1 if kind == 3 else kind
    return Drawn(tuple(str(one) for one in random.choice(names, size=count, replace=False)), size)


def own(seed: int) -> Case:
    """The case of a seed: an accepted run, one to fit, and one of another motion to validate.

    Raises:
        DriveError: the arm cannot move with what is hidden.
    """
    drawn = drawn_of(seed)
    robot = robots.load(ARM)
    plant, motions = draw_truth(robot, seed), (motion(0), motion(1))
    parts = [
        draw_scenario(robot, effect, seed, drawn.size, truth=plant, reference=motions[0])
        for effect in drawn.effects
    ]
    scenario = Scenario()
    for part in parts:
        scenario = scenario.merged(part.scenario)
    logs = [
        record(robot, plant, hidden, path, seed + 1 + number)
        for number, (hidden, path) in enumerate(
            ((Scenario(), motions[0]), (scenario, motions[0]), (scenario, motions[1]))
        )
    ]
    truth = truth_of(drawn.effects, [part.axes for part in parts])
    return Case(f"own {seed}", "own", robot, logs[1], logs[2], truth, logs[0])


def truth_of(effects: Sequence[str], axes: Sequence[Any]) -> Truth:
    """As armhil says it: joints from 1, none for the whole arm."""
    return tuple(
        (UNKNOWN if effect in OUTSIDE_VOCABULARY else effect, tuple(int(one) for one in np.ravel(joints)))
        for effect, joints in zip(effects, axes, strict=True)
    )
