"""Cheap draws of the own bench to learn from: one simulated recording each, no search of its size.

A *world* is an arm, its controller's gains, two motions and the model that was accepted on a clean recording
of it; it is shared by some draws. An effect's size comes of a table that was measured once per effect and
place (:mod:`benchmarks.learning.sizes`), so a draw costs one simulation of 6.4 s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.learning.labels import CLEAN, Hidden
from benchmarks.learning.rows import LENGTH, RATE, Accepted
from benchmarks.learning.sizes import Sizes, scenario_of
from drivers.errors import DriveError
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.drawing.gap import Ruler
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import Recording, RegressorModel, base_parameters
from ident.parameters.base import BaseParameters
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

SECONDS = LENGTH / RATE + 0.4
"""Of a draw: a window and what the filters take at both ends."""
CLEAN_SHARE, COLOURED_SHARE = 0.2, 1 / 3
LEAST, MOST = 0.5, 5.0
"""Noise floors of a drawn effect, as its table says."""
SLOW = ("drifting_friction", "temperature_viscous_friction", "dragging_brake")
"""Effects whose recording begins later in half of the draws."""
_EVALUATIONS = 150
_GAINS, _DRIVE_GAIN = 0.3, 0.02


@dataclass(frozen=True)
class Draw:
    """A window of rows with what is hidden in it; ``context`` is that of the accepted model."""

    window: FloatArray
    context: FloatArray
    hidden: Hidden
    world: int


@dataclass(frozen=True)
class World:
    """An arm with its accepted model and motions to draw on, (N, n) per SYNC each."""

    robot: Robot
    truth: PlantTruth
    accepted: Accepted
    motions: tuple[FloatArray, FloatArray]
    rulers: tuple[Ruler, Ruler]

    @classmethod
    def of(cls, described: Robot, base: BaseParameters, seed: int) -> World:
        """Everything of a seed: arm, gains of controller and drives, motions, accepted model."""
        rng = np.random.default_rng([seed, 0x1EA])
        truth = draw_truth(described, int(rng.integers(2**31)))
        known = 1.0 + _DRIVE_GAIN * rng.uniform(-1.0, 1.0, described.n)
        truth = replace(truth, gain=tuple(float(gain) for gain in known * truth.gain))
        robot = _with_other_gains(described, rng)
        long = _planned(robot, 2.0 * SECONDS, int(rng.integers(2**31)))
        first, second = long[: round(SECONDS / robot.bus.cycle_time)], _motion(robot, rng)
        clean = recorded(robot, truth, Scenario(), long, int(rng.integers(2**31)))
        rulers = tuple(Ruler.of(robot, truth, one) for one in (first, second))
        return cls(robot, truth, Accepted.on(robot, clean, base), (first, second), rulers)  # type: ignore[arg-type]


def draws_of(described: Robot, sizes: Sizes, seed: int, count: int) -> Iterator[Draw]:
    """Draws of one world."""
    base = base_parameters(RegressorModel.of(described))
    world = World.of(described, base, seed)
    rng = np.random.default_rng([seed, 0x1EB])
    context = np.asarray(world.accepted.context, dtype=np.float32)
    for _ in range(count):
        scenario, hidden, which = _hidden(world, sizes, rng)
        late = hidden.effect in SLOW and rng.random() < 0.5
        run_seed = int(rng.integers(2**31))
        try:
            log = recorded(world.robot, world.truth, scenario, world.motions[which], run_seed, int(late))
        except DriveError:
            continue
        yield Draw(world.accepted.windows(log)[0], context, hidden, seed)


def recorded(
    robot: Robot, truth: PlantTruth, scenario: Scenario, path: FloatArray, seed: int, warm_up: int = 0
) -> Recording:
    """One pass of a motion as a master would have recorded it."""
    run = simulate_offline(robot, truth, path, scenario=scenario, seed=seed, warm_up=warm_up)
    return Recording("draw", run.time, run.reference, run.position, run.control_signal)


def _hidden(world: World, sizes: Sizes, rng: np.random.Generator) -> tuple[Scenario, Hidden, int]:
    which = int(rng.integers(2))
    if rng.random() < CLEAN_SHARE:
        noise = {"noise": {"time_constant": 0.02}} if rng.random() < COLOURED_SHARE else {}
        return Scenario.from_dict({"format": 1, **noise}), CLEAN, which
    size = float(np.exp(rng.uniform(np.log(LEAST), np.log(MOST))))
    effect = str(rng.choice(sizes.effects))
    place = sizes.places(effect)[int(rng.integers(len(sizes.places(effect))))]
    magnitude = sizes.magnitude(effect, place, size)
    scenario = scenario_of(world.robot, world.rulers[which], effect, place, magnitude, rng)
    return scenario, Hidden(effect, place), which


def _with_other_gains(robot: Robot, rng: np.random.Generator) -> Robot:
    """The arm with controller gains of its own; the description says them."""
    law = robot.controller
    names = ("position_gain", "velocity_gain")
    factors = np.exp(rng.uniform(-_GAINS, _GAINS, (2, robot.n)))
    update = {
        name: tuple(float(g) for g in factor * getattr(law, name))
        for name, factor in zip(names, factors, strict=True)
    }
    return robot.model_copy(update={"controller": law.model_copy(update=update)})


def _motion(robot: Robot, rng: np.random.Generator) -> FloatArray:
    kind, seed = rng.choice(("planned", "exercise", "ways")), int(rng.integers(2**31))
    if kind == "planned":
        return _planned(robot, SECONDS, seed)
    return exercise(robot, SECONDS, seed) if kind == "exercise" else ways(robot, SECONDS, rng)


def _planned(robot: Robot, seconds: float, seed: int) -> FloatArray:
    cycle = robot.bus.cycle_time
    found = plan(
        robot, cycle_time=cycle, duration=seconds, seed=seed, evaluations=_EVALUATIONS, periods=1
    ).position
    return np.asarray(found[: round(seconds / cycle)])


def ways(robot: Robot, seconds: float, rng: np.random.Generator) -> FloatArray:
    """Quintic ways from ``robot.home`` between random postures, with a stop at some, (N, n) per SYNC."""
    count = int(rng.integers(4, 9))
    home, reach = np.array(robot.home), 0.35
    lengths = rng.uniform(0.7, 1.3, count)
    stops = np.where(rng.random(count) < 0.25, 0.2, 0.0)
    lengths *= (seconds - stops.sum()) / lengths.sum()
    room = np.minimum(robot.upper - home, home - robot.lower)
    posts = np.vstack([home, home + reach * room * rng.uniform(-1.0, 1.0, (count, robot.n))])
    step = np.abs(np.diff(posts, axis=0))
    fast = (1.875 * step / lengths[:, np.newaxis] / (0.7 * robot.velocity_limits)).max(axis=0)
    hard = (5.774 * step / lengths[:, np.newaxis] ** 2 / (0.8 * robot.acceleration_limits)).max(axis=0)
    posts = home + (posts - home) / np.maximum(1.0, np.maximum(fast, hard))
    ends = np.cumsum(lengths + stops)
    time = np.arange(round(seconds / robot.bus.cycle_time)) * robot.bus.cycle_time
    which = np.minimum(np.searchsorted(ends, time, side="right"), count - 1)
    share = np.clip((time - (ends - lengths - stops)[which]) / lengths[which], 0.0, 1.0)[:, np.newaxis]
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return np.asarray(posts[which] + way * (posts[which + 1] - posts[which]))
