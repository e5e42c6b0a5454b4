"""How often an effect of the size that was predicted to be named in 80 % of recordings is named rightly.

An arm is drawn, and recorded clean: that run is what is accepted. From the planned motion and that run alone
the smallest size of each effect at each place is predicted and written down. Then an effect is drawn at a
place (``benchmarks/naming.py`` does the same) and given the size whose torque is the predicted one; the plant
gets it, and a diagnosis is asked. Shapes are drawn: the prediction is that of the shape in the middle.

    python -m benchmarks.power --arm emps --period 6 --rounds 2 --seed 31000 --out power.jsonl
    python -m benchmarks.power --report power.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks import naming, naming_detection
from benchmarks.evidence.asked import is_named
from benchmarks.naming_report import NAMES, lines_of, share
from drivers.errors import DriveError
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import DrawnScenario, draw_scenario, gap
from drivers.simulated.offline import SimulatedRun, simulate_offline
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.discrepancy.by_evidence.evidence.prepared import ROW_RATE, prepare, settings_for
from ident.discrepancy.by_evidence.power.planned import known_from_run, planned_sizes
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.loop import SETTLING
from ident.effects.vocabulary import VOCABULARY, family_named
from robots import Robot
from robots.arrays import BoolArray, FloatArray

ROUNDS, CLOSE = 16, 0.1
"""Trials to make the torque as large as predicted, and how near it has to be (of its logarithm)."""

FIRST = 2.0
"""Noise floors at which an effect is drawn, to learn its place and shape."""

IN_OWN_UNIT: dict[str, Callable[[Scenario], float]] = {
    "joint_elasticity": lambda scenario: 1.0 / scenario.joint_elasticity[0].stiffness,
    "stiffening_elasticity": lambda scenario: 1.0 / scenario.stiffening_elasticity[0].stiffness,
    "backlash": lambda scenario: scenario.backlash[0].width,
    "base_compliance": lambda scenario: 1.0 / softest(scenario),
}
"""Effects that are made as large as predicted in their own unit: their torque is less than the gap of two
runs in which friction turns a sample earlier (0.002 N·m)."""

AT_REVERSALS = ("static_friction",)
"""Whose smallest size is one of the simulated loop, reversals included: its torque is that of the drive."""

MORE = {"gear_ripple": 16.0}
"""Times as large as predicted, at which others of this kind are measured: they are linear in their size."""

SOFT, STIFFEST = ("joint_elasticity", "stiffening_elasticity", "base_compliance"), -0.8
"""Whose magnitudes are logarithms of a stiffness, and the least of them, stiffer than where it is 0."""

LEAST = float(np.log(1e-5))
"""Logarithm of the least magnitude of all others."""

FINER = 64
"""Times as many encoder counts where an effect is sized: rounding makes a gap of 0.2 floors."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arm", default="emps", help="a shipped arm")
    parser.add_argument("--period", type=float, default=6.0, help="of the motions, s")
    parser.add_argument("--rounds", type=int, default=1, help="scenarios of each effect")
    parser.add_argument("--effects", nargs="*", default=list(NAMES))
    parser.add_argument("--factor", type=float, default=1.0, help="of the predicted size")
    parser.add_argument("--seed", type=int, default=31000, help="of the first scenario")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no scenario after so long")
    parser.add_argument("--out", type=Path, default=Path("power.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    if given.report is None:
        naming.ARM, naming.PERIOD = given.arm, given.period
        campaign(given)
    print(report(lines_of(given.report or given.out)))


def campaign(given: argparse.Namespace) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {(line["effect"], line["seed"], line["factor"]) for line in lines_of(given.out)}
    motions = naming_detection.planned(given.out.with_suffix(f".{given.arm}.npz"))
    until = time.monotonic() + given.seconds
    for number in range(given.rounds * len(given.effects)):
        effect, seed = given.effects[number % len(given.effects)], given.seed + number
        if (effect, seed, given.factor) in done:
            continue
        if time.monotonic() > until:
            break
        line = one_run(effect, seed, given.factor, motions)
        with given.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"arm": given.arm, **line}) + "\n")


def one_run(effect: str, seed: int, factor: float, motions: tuple[FloatArray, FloatArray]) -> dict[str, Any]:
    """Predict, draw, simulate, search, and only then compare."""
    robot = robots.load(naming.ARM)
    truth = draw_truth(robot, seed)
    line: dict[str, Any] = {"effect": effect, "seed": seed, "factor": factor}
    accepted = naming.record(robot, truth, Scenario(), motions[0], seed + 1)
    predicted = predictions(robot, accepted, motions[0])
    fine = finely_read(robot)
    try:
        drawn = draw_scenario(fine, effect, seed, FIRST, truth=truth, reference=motions[0])
        here = predicted.get((effect, place_of(effect, drawn.axes, robot)))
        if here is None or not here.seen:
            return line | {"axes": list(drawn.axes), "skipped": "no size is predicted"}
        line |= {"axes": list(drawn.axes), "size": here.size, "unit": here.unit, "torque": here.torque}
        line |= {"least": is_least(robot, here), "rival": here.rival[0]}
        scenario, line["reached"] = sized(fine, truth, drawn, here, factor, motions[0])
    except DriveError as error:
        return line | {"skipped": str(error)}
    fit = naming.record(robot, truth, scenario, motions[0], seed + 2)
    validation = naming.record(robot, truth, scenario, motions[1], seed + 3)
    question = Question(
        robot, (fit,), (validation,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
    )
    found, _ = diagnose_with_evidence(question, sizes=False)
    return line | {
        "verdict": found.verdict,
        "names": [[one.effect, list(one.joints), one.probability, is_named(one)] for one in found.findings],
    }


def is_least(robot: Robot, here: Smallest) -> bool:
    """Whether the size is the smallest that the search looks for: named more often than in 80 %."""
    places = [
        one
        for one in family_named(here.name).places(robot)
        if one.joints == tuple(j - 1 for j in here.joints)
    ]
    shapes = (one for place in places for one in family_named(here.name).shapes(robot, place))
    return any(one.name == here.parameter and here.size <= min(one.grid) * (1.0 + 1e-9) for one in shapes)


def place_of(effect: str, axes: Sequence[int], robot: Robot) -> tuple[int, ...]:
    """Joints as the search says them: a delay of every drive is one of the arm."""
    return () if effect == "time_delay" and len(axes) == robot.n > 1 else tuple(axes)


def finely_read(robot: Robot) -> Robot:
    """The same arm with encoders that hardly round."""
    drives = tuple(
        one.model_copy(update={"encoder_counts": FINER * one.encoder_counts}) for one in robot.drive
    )
    return robot.model_copy(update={"drive": drives})


def predictions(
    robot: Robot, accepted: Recording, path: FloatArray
) -> dict[tuple[str, tuple[int, ...]], Smallest]:
    """Of every effect at every place, before anything is hidden."""
    position = np.tile(path, (naming.PERIODS, 1))
    when = np.arange(position.shape[0]) * robot.bus.cycle_time
    motion = Recording("planned", when, position, position, np.zeros_like(position))
    sizes = planned_sizes(robot, motion, known_from_run(robot, (accepted,)))
    return {(one.name, one.joints): one for one in sizes}


def sized(
    robot: Robot,
    truth: PlantTruth,
    drawn: DrawnScenario,
    here: Smallest,
    factor: float,
    path: FloatArray,
) -> tuple[Scenario, float]:
    """The same effect as large as predicted where the search looks, and how large it is there, N·m.

    Raises:
        DriveError: its torque cannot be made as predicted.
    """
    if drawn.effect in IN_OWN_UNIT:
        found, _ = made(drawn, IN_OWN_UNIT[drawn.effect], factor * here.size)
        scenario = drawn.with_magnitude(found)
        return scenario, Measured.of(robot, truth, here, path).torque(scenario)
    more = MORE.get(drawn.effect, 1.0)
    found, reached = made(drawn, Measured.of(robot, truth, here, path).torque, more * factor * here.torque)
    return drawn.with_magnitude(found / more), reached / more


def made(drawn: DrawnScenario, measured: Callable[[Scenario], float], wanted: float) -> tuple[float, float]:
    """Magnitude at which a measure is within :data:`CLOSE` of what is wanted, and that measure.

    Raises:
        DriveError: no sensible magnitude has it.
    """
    stiff = drawn.effect in SOFT

    def at(place: float) -> tuple[float, float, float]:
        magnitude = place if stiff else float(np.exp(place))
        reached = measured(drawn.with_magnitude(magnitude))
        return magnitude, reached, float(np.log(max(reached, 1e-12) / wanted))

    low, high = (STIFFEST, 1.0) if stiff else (LEAST, 0.0)
    least, most = at(low)[2], at(high)[2]
    if least > 0.0 or most < 0.0:
        raise DriveError(f"{drawn.effect}: no sensible magnitude is as large as predicted there")
    for number in range(ROUNDS):
        share = least / (least - most) if number % 2 else 0.5
        place = low + min(max(share, 0.05), 0.95) * (high - low)
        magnitude, reached, more = at(place)
        if abs(more) < CLOSE:
            return magnitude, reached
        low, least, high, most = (place, more, high, most) if more < 0.0 else (low, least, place, more)
    raise DriveError(f"{drawn.effect}: it cannot be made as large as predicted where the search looks")


def softest(scenario: Scenario) -> float:
    """The least stiffness of a foot, N·m/rad."""
    foot = scenario.base_compliance
    assert foot is not None
    return min(one for one in (foot.roll, foot.pitch) if one is not None)


@dataclass(frozen=True)
class Measured:
    """How large effects are at a joint, where the search looks for them.

    Attributes:
        robot, truth, path: the arm without noise, and its motion.
        joint: from 0.
        at_reversals: whether all of the drive's torque counts.
        quiet: the arm without an effect.
        rows: which count (rows,), of :func:`gap.torque_residual`.
    """

    robot: Robot
    truth: PlantTruth
    path: FloatArray
    joint: int
    at_reversals: bool
    quiet: SimulatedRun
    rows: BoolArray

    @classmethod
    def of(cls, robot: Robot, truth: PlantTruth, here: Smallest, path: FloatArray) -> Measured:
        """For one effect at one place."""
        truth = gap.silent(truth)
        quiet = simulate_offline(robot, truth, path)
        motion = Recording("quiet", quiet.time, path, quiet.position, quiet.control_signal)
        (part,) = prepare(settings_for(robot, motion), (motion,)).parts
        assert part.own.time is not None
        cycle = robot.bus.cycle_time
        every = max(1, round(1.0 / (gap._ROW_RATE * cycle)))
        time = quiet.time[round(gap._EDGE / cycle) : len(path) - round(gap._EDGE / cycle) : every]
        nearest = np.clip(np.searchsorted(part.own.time, time), 0, part.rows - 1)
        inside = (time >= part.own.time[0]) & (time <= part.own.time[-1])
        rows = inside & part.used[nearest, here.joint - 1]
        return cls(robot, truth, path, here.joint - 1, here.name in AT_REVERSALS, quiet, rows)

    def torque(self, scenario: Scenario) -> float:
        """Root mean square of what a scenario changes there, N·m."""
        run = simulate_offline(self.robot, self.truth, self.path, scenario=scenario)
        if self.at_reversals:
            change = (run.control_signal - self.quiet.control_signal)[:, self.joint]
            each = round(1.0 / (ROW_RATE * self.robot.bus.cycle_time))
            kept = change[round(SETTLING / self.robot.bus.cycle_time) :]
            rows = kept[: len(kept) // each * each].reshape(-1, each).mean(axis=1)
            return float(np.sqrt(np.mean((rows * self.robot.gains[self.joint]) ** 2)))
        with_it, without = (gap.torque_residual(self.robot, self.truth, one) for one in (run, self.quiet))
        return float(np.sqrt(np.mean((with_it - without)[self.rows, self.joint] ** 2)))


def right(line: dict[str, Any], found: Sequence[Sequence[Any]]) -> bool:
    """The first name and its joints are those that were hidden."""
    if not found:
        return False
    wanted = [] if line["effect"] in ("payload", "base_tilt") else line["axes"]
    joints = list(found[0][1])
    whole_arm = line["effect"] == "time_delay" and joints == [] and len(line["axes"]) > 1
    return found[0][0] == line["effect"] and (sorted(joints) == sorted(wanted) or whole_arm)


def sure(line: dict[str, Any]) -> bool:
    """The likeliest name is the right one, and nothing at all was not likelier than a tenth."""
    return right(line, line["names"])


def wrong(line: dict[str, Any]) -> bool:
    """A name that is given is not the one that was hidden."""
    return any(one[3] and not right(line, [one]) for one in line["names"])


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Per arm and factor, then per effect."""
    text = [
        "| arm, share of the predicted size | scenarios | right name first | alone | wrong name given |",
        "|---|---|---|---|---|",
    ]
    ran = [line for line in lines if "skipped" not in line]
    groups: dict[tuple[str, float], list[dict[str, Any]]] = defaultdict(list)
    for line in ran:
        groups[line["arm"], line["factor"]].append(line)
    for (arm, factor), those in sorted(groups.items()):
        cells = [
            share(map(sure, those)),
            share(line["verdict"] == "named" and sure(line) and line["names"][0][3] for line in those),
            share(map(wrong, those)),
        ]
        text.append(f"| {arm}, {factor:g} | {len(those)} | {' | '.join(cells)} |")
    text += ["", "| effect | right first, of |", "|---|---|"]
    for effect in dict.fromkeys(line["effect"] for line in ran):
        own = [sure(line) for line in ran if line["effect"] == effect]
        text.append(f"| {effect.replace('_', ' ')} | {sum(own)} of {len(own)} |")
    left = [f"{line['effect']} ({line['skipped']})" for line in lines if "skipped" in line]
    return "\n".join([*text, "", f"left out: {len(left)}", *sorted(set(left))]) + "\n"


if __name__ == "__main__":
    main()
