"""How fast the closed loop is simulated: 20 s, six axes, 1 kHz controller, integration step 0.25 ms.

Prints times and ratios to real time and to the same model in plain Python; with --effects also of the model
with each effect of the vocabulary at its first place. Run it on a quiet machine:

    PYTHONPATH=. python benchmarks/closed_loop.py [--replicates 64] [--seconds 20] [--effects]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from unittest.mock import patch

import numpy as np

import robots
from ident import Recording, RegressorModel
from ident.closed_loop import compiled, simulate, simulate_many
from ident.closed_loop.leading import leading_of
from ident.closed_loop.simulate import run_in_python
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.effects.vocabulary import VOCABULARY
from ident.parameters.present import Present

_PLAIN_SECONDS = 0.5


def sweep(robot: robots.Robot, duration: float) -> Recording:
    """Targets of three sines per joint about home, faded in and out, at the robot's SYNC period."""
    generator = np.random.default_rng(1)
    instants = np.arange(0.0, duration, robot.bus.cycle_time)
    fade = np.clip(np.minimum(instants, duration - instants) / min(1.5, duration / 4), 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
    reference = np.tile(np.array(robot.home), (instants.size, 1))
    for frequency in (0.2, 0.5, 0.8):
        hz = frequency * generator.uniform(0.8, 1.2, robot.n)
        size = generator.uniform(0.15, 0.35, robot.n)
        reference += fade[:, np.newaxis] * size * np.sin(2 * np.pi * instants[:, np.newaxis] * hz)
    return Recording("sweep", instants, reference, reference.copy(), np.zeros(reference.shape))


def shortest(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Elapsed and processor seconds of the fastest; on a busy machine the latter says more."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter(), time.process_time()
        work()
        times.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    return min(times)


def each_effect(model: RegressorModel, recording: Recording) -> None:
    """Print how fast the model with one effect of each family is; its size is small, as if just found."""
    robot, prior = model.robot, model.prior()
    print(f"\n{'with':38}{'s per run':>12}{'processor s':>14}{'× real time':>14}")
    for family in VOCABULARY:
        place = family.places(robot)[0]
        shape = tuple(shape.grid[len(shape.grid) // 2] for shape in family.shapes(robot, place))
        effect = family.effect(robot, place, shape, Present(model, prior))
        whole = replace(model, effects=(*model.effects, effect))
        values = np.append(prior, np.full(len(effect.parameters), 1e-3))
        simulate(whole, values, recording)  # compiles or loads
        elapsed, processor = shortest(partial(simulate, whole, values, recording), 3)
        ratio = float(recording.time[-1]) / elapsed
        print(f"{family.name:38}{elapsed:12.4f}{processor:14.4f}{ratio:14.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--replicates", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--effects", action="store_true")
    arguments = parser.parse_args()
    robot = robots.load("tx40")
    model = RegressorModel.of(robot)
    prior = model.prior()
    short, whole = sweep(robot, _PLAIN_SECONDS), sweep(robot, arguments.seconds)
    first = shortest(lambda: simulate(model, prior, short), 1)
    one = shortest(lambda: simulate(model, prior, whole), 7)
    with (
        patch.object(compiled, "only_plain_friction", lambda extra: False),
        patch.object(TorqueParts, "usual", False),
    ):
        general = shortest(lambda: simulate(model, prior, whole), 7)
    vectors = prior * np.random.default_rng(2).uniform(0.99, 1.01, (arguments.replicates, prior.size))
    many = shortest(lambda: simulate_many(model, vectors, whole), 3)
    structure, leading = ModelStructure(model), leading_of(robot, short, None)
    plain = shortest(lambda: run_in_python(structure, structure.parts(prior), leading), 1)
    longer = arguments.seconds / _PLAIN_SECONDS
    reference = plain[0] * longer
    print(f"{arguments.seconds:g} s of {robot.name}, {leading.substeps} steps per controller sample")
    print(f"first call (compiles or loads): {first[0]:.2f} s, processor {first[1]:.2f} s")
    print(f"{'':38}{'s per run':>12}{'processor s':>14}{'× real time':>14}{'× plain Python':>16}")
    for label, (elapsed, processor), runs in (
        ("plain Python", (reference, plain[1] * longer), 1),
        ("compiled, one run", one, 1),
        ("the kernel with room for effects", general, 1),
        (f"compiled, {arguments.replicates} runs, {os.cpu_count()} threads", many, arguments.replicates),
    ):
        each = elapsed / runs
        ratios = f"{arguments.seconds / each:14.1f}{reference / each:16.1f}"
        print(f"{label:38}{each:12.4f}{processor / runs:14.4f}{ratios}")
    if arguments.effects:
        each_effect(model, whole)


if __name__ == "__main__":
    main()
