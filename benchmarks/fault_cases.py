"""Every fault at any time: one stream with one fault each, and what must come of it.

A case is drawn from a seed: which fault, on which axis, in which cycle, on which arm. It passes when the
stream ended as this fault demands, with a reason in words that names the drive, and all axes are without
torque and on their brakes within the stated number of cycles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drivers.simulated.faults import (
    BusOff,
    DeadAt,
    EmergencyAt,
    Faults,
    FrozenEncoder,
    HotMotor,
    LostFrames,
)
from drivers.simulated.in_process import InProcessRun, stream_in_process
from drivers.simulated.state_machine import State
from drivers.simulated.truth import draw_truth
from robots import Robot
from robots.arrays import FloatArray

STREAM_SECONDS = 1.6
FIRST_CYCLE, CYCLES = 20, 340
"""Where faults come, in cycles since the first axis was enabled: from approach to the end of the motion."""
LARGEST_SWING = 0.9
"""rad or m."""

Draw = Callable[[np.random.Generator, int, int], tuple[Faults, int | None]]
"""Generator, node and cycle to the fault, and the cycle in which the master is killed."""


@dataclass(frozen=True)
class FaultKind:
    """One line of the matrix.

    Attributes:
        name: of the fault.
        draw: makes one.
        outcomes: what the stream may end with; None stands for a master that was killed.
        words: the reason; two where the place in the motion decides which comes first. ``{code}`` is that of
            the EMCY that was sent.
        bound: cycles from the fault until no axis has torque; None where the stream goes on.
    """

    name: str
    draw: Draw
    outcomes: tuple[str | None, ...]
    words: tuple[str, ...] = ()
    bound: int | None = None


def _lost(field_name: str, few: bool) -> Draw:
    def draw(rng: np.random.Generator, node: int, cycle: int) -> tuple[Faults, int | None]:
        cycles = int(rng.integers(1, 4)) if few else int(rng.integers(60, 120))
        frames: dict[str, tuple[LostFrames, ...]] = {field_name: (LostFrames(node, cycle, cycles),)}
        return Faults(**frames), None  # type: ignore[arg-type]

    return draw


_CODES = (0x2310, 0x3210, 0x4210, 0x5441, 0x7305, 0x8611, 0xFF01)

KINDS: tuple[FaultKind, ...] = (
    FaultKind("lost TPDOs, few", _lost("lost_tpdos", few=True), ("completed",)),
    FaultKind("lost TPDOs, many", _lost("lost_tpdos", few=False), ("aborted",), ("no TPDO from",), 60),
    FaultKind("lost RPDOs, few", _lost("lost_rpdos", few=True), ("completed",)),
    FaultKind(
        "lost RPDOs, many",
        _lost("lost_rpdos", few=False),
        ("fault", "aborted"),
        ("0x8250", "following error"),
        90,
    ),
    FaultKind("late TPDOs", _lost("late_tpdos", few=True), ("completed",)),
    FaultKind("late RPDOs", _lost("late_rpdos", few=True), ("completed",)),
    FaultKind(
        "dead node",
        lambda rng, node, cycle: (Faults(dead=(DeadAt(node, cycle),)), None),
        ("aborted",),
        ("no TPDO from",),
        60,
    ),
    FaultKind(
        "EMCY",
        lambda rng, node, cycle: (
            Faults(emergencies=(EmergencyAt(node, cycle, int(rng.choice(_CODES))),)),
            None,
        ),
        ("fault",),
        ("EMCY {code}",),
        50,
    ),
    FaultKind(
        "frozen encoder",
        lambda rng, node, cycle: (Faults(frozen_encoders=(FrozenEncoder(node, cycle),)), None),
        ("aborted",),
        ("reads the same",),
        120,
    ),
    FaultKind(
        "over-temperature",
        lambda rng, node, cycle: (Faults(hot_motors=(HotMotor(node, cycle, 2000.0),)), None),
        ("fault",),
        ("0x4310 (motor over-temperature)",),
        60,
    ),
    FaultKind(
        "bus-off",
        lambda rng, node, cycle: (Faults(bus_off=(BusOff(cycle),)), None),
        ("aborted",),
        ("bus-off",),
        100,
    ),
    FaultKind("master killed", lambda rng, node, cycle: (Faults(), cycle), (None,), (), 100),
)


@dataclass(frozen=True)
class FaultCase:
    """What came of one case.

    Attributes:
        kind, seed, node, cycle: what was drawn.
        run: the stream.
        problems: what was not as it must be; empty where the case passes.
    """

    kind: FaultKind
    seed: int
    node: int
    cycle: int
    run: InProcessRun
    problems: tuple[str, ...] = field(default=())


def random_motion(robot: Robot, rng: np.random.Generator, seconds: float = STREAM_SECONDS) -> FloatArray:
    """Out from home and back, each joint its own way, at up to 70 % of the acceleration limits, N × n."""
    period = robot.bus.cycle_time
    t = np.linspace(0.0, 1.0, round(seconds / period))
    bell = 64 * (t * (1 - t)) ** 3
    peak = np.abs(np.diff(bell, 2)).max() / period**2
    home = np.array(robot.home)
    size = np.minimum(0.7 * robot.acceleration_limits / peak, LARGEST_SWING)
    size = size * rng.uniform(0.5, 1.0, robot.n) * rng.choice([-1.0, 1.0], robot.n)
    end = np.clip(home + size, robot.lower, robot.upper)
    return np.asarray(home + bell[:, None] * (end - home))


def run_case(robot: Robot, kind: FaultKind, seed: int) -> FaultCase:
    """Stream once with a fault of this kind, and judge what came of it."""
    rng = np.random.default_rng(seed)
    node = int(rng.choice([drive.node_id for drive in robot.drive]))
    # A frozen encoder shows where the axis moves: at standstill nobody can know.
    low, high = (120, 240) if kind.name == "frozen encoder" else (FIRST_CYCLE, CYCLES)
    cycle = int(rng.integers(low, high))
    faults, kill_at = kind.draw(rng, node, cycle)
    reference = random_motion(robot, rng)
    if kind.name == "frozen encoder":
        # Coupled joints may cancel each other at a drive that then stands still.
        reference = np.array(robot.home) + np.abs(reference - np.array(robot.home))
    run = stream_in_process(
        robot, draw_truth(robot, seed), reference, faults, kill_at=kill_at, measure_from=cycle
    )
    return FaultCase(
        kind, seed, node, cycle, run, tuple(_problems(robot, kind, faults, node, run, reference))
    )


def _problems(
    robot: Robot, kind: FaultKind, faults: Faults, node: int, run: InProcessRun, reference: FloatArray
) -> list[str]:
    problems = []
    outcome = run.result.outcome if run.result is not None else None
    reason = run.result.reason if run.result is not None else ""
    if outcome not in kind.outcomes:
        problems.append(f"ended with {outcome}: {reason}")
    code = "".join(f"0x{emergency.code:04X}" for emergency in faults.emergencies)
    wanted = tuple(words.format(code=code) for words in kind.words)
    if wanted and not any(words in reason for words in wanted):
        problems.append(f"the reason says none of {wanted}: {reason}")
    joint = next(j.name for j, d in zip(robot.joint, robot.drive, strict=True) if d.node_id == node)
    if kind.words and kind.name != "bus-off" and joint not in reason:
        problems.append(f"the reason does not name {joint}: {reason}")
    if run.bus.powered:
        problems.append("an axis is left with torque or an open brake")
    if kind.bound is not None and (run.cycles_to_rest is None or run.cycles_to_rest > kind.bound):
        problems.append(f"torque was off after {run.cycles_to_rest} cycles; stated: {kind.bound}")
    if run.rows["cycle"].tolist() != list(range(len(run.rows))):
        problems.append("the record has gaps")
    if (worst := largest_acceleration(robot, run)) > 1.0:
        problems.append(f"set-points asked for {worst:.3f} times an acceleration limit")
    if outcome == "completed" and len(run.rows) != len(reference):
        problems.append(f"{len(run.rows)} rows of {len(reference)}")
    return problems


def largest_acceleration(robot: Robot, run: InProcessRun) -> float:
    """Of the recorded set-points, as a share of the joints' limits; the rounding to counts is taken off.

    Rows in a quick stop are left out: the drives follow no set-points then, and get their own positions.
    """
    quick_stop = ((run.rows["statusword"] & 0x6F) == State.QUICK_STOP_ACTIVE.value).any(axis=1)
    rows = run.rows[: int(np.argmax(quick_stop))] if quick_stop.any() else run.rows
    if len(rows) < 3:
        return 0.0
    period = robot.bus.cycle_time
    scale = robot.counts_per_output_unit
    joints = np.linalg.solve(robot.transmission_matrix, (rows["target"] / scale).T).T
    rounding = 4 / np.abs(scale).min() / period**2
    acceleration = np.maximum(np.abs(np.diff(joints, 2, axis=0)) / period**2 - rounding, 0.0)
    return float((acceleration / robot.acceleration_limits).max()) / 1.001
