"""The fault matrix: every kind of fault at random times, on random axes of random arms.

    PYTHONPATH=. python benchmarks/fault_matrix.py [RUNS_PER_KIND]

260 runs by default (20 of each kind, seeds 1000 to 1019), among them 20 with a drive of another identity,
which the set-up must refuse by name. Each other run must end as its fault demands, with a reason in words,
with all axes without torque on their brakes within the stated number of cycles, and with a
capture that is read back whole. Ends with 2 where one does not.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import robots
from benchmarks.fault_cases import KINDS, FaultCase, run_case
from daq.recording.capture import DESCRIPTION, RUN, TRAJECTORY
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.run_facts import outcome_facts
from drivers import ArmSession, Channel, DriveError, Samples, open_bus
from drivers.frames.units import Units
from drivers.simulated import Faults, draw_truth
from drivers.simulated.faults import WrongIdentity
from drivers.simulated.frame_sender import FrameSender
from drivers.simulated.group import DriveGroup
from drivers.simulated.process import serve
from drivers.simulated.set_points import AxisMode
from robots import Robot
from robots.description import Identity

FIRST_SEED = 1000
OWN_PRODUCT = 0x402
"""1018:02 of the simulated drives."""


def capture_problem(robot: Robot, case: FaultCase, folder: Path) -> str | None:
    """Record the run and read it back."""
    rows, units = case.run.rows, Units.of(robot)
    samples = Samples(
        cycle=rows["cycle"],
        time=rows["cycle"] * robot.bus.cycle_time,
        reference=units.position(rows["target"]) if len(rows) else np.zeros((0, robot.n)),
        position=units.position(rows["position"]) if len(rows) else np.zeros((0, robot.n)),
        control_signal=units.control_signal(rows["control_signal"]),
        statusword=rows["statusword"],
        complete=rows["complete"],
        lateness=rows["lateness"],
    )
    path = folder / f"{case.kind.name}-{case.seed}.mcap".replace(" ", "-")
    facts = {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: {"period": repr(robot.bus.cycle_time)},
        TRAJECTORY: {},
    }
    result = case.run.result
    with Recorder(path, robot, facts) as recorder:
        recorder.write(samples)
        if result is not None:
            recorder.finish(outcome_facts(result))
    if not len(rows):
        return None
    back = read_capture(path).samples
    path.unlink()
    same = len(back.cycle) == len(rows) and np.array_equal(back.position, samples.position)
    return None if same else f"{len(back.cycle)} of {len(rows)} rows were read back"


def identity_problem(robot: Robot, seed: int) -> str | None:
    """Open a session with one drive that is another than described; None where that is refused."""
    rng = np.random.default_rng(seed)
    node, product = int(rng.choice([d.node_id for d in robot.drive])), int(rng.integers(0x1000, 0xFFFF))
    identity = Identity(vendor=0, product=OWN_PRODUCT)
    described = tuple(drive.model_copy(update={"identity": identity}) for drive in robot.drive)
    robot = robot.model_copy(update={"drive": described})
    channel = Channel("virtual", f"identity-{seed}")
    done = threading.Event()
    with open_bus(channel) as bus:
        faults = Faults(identities=(WrongIdentity(node, product),))
        sender = FrameSender(bus)
        group = DriveGroup(robot, draw_truth(robot, seed), sender, faults)
        group.boot(time.monotonic())
        thread = threading.Thread(target=serve, args=(group, sender.port, lambda now: not done.is_set()))
        thread.start()
        try:
            ArmSession(robot, channel).open()
        except DriveError as error:
            wanted = f"(node {node}): another drive than described: its product (1018) is 0x{product:08X}"
            powered = any(drive.mode is not AxisMode.BRAKED for drive in group.drives)
            return None if wanted in str(error) and not powered else f"refused with: {error}"
        finally:
            done.set()
            thread.join()
    return "the session opened"


def identity_runs(robot: Robot, runs: int) -> int:
    """Print the line of this kind; how many were not refused as they must be."""
    bad = 0
    for seed in range(FIRST_SEED, FIRST_SEED + runs):
        if (problem := identity_problem(robot, seed)) is not None:
            print(f"  seed {seed}: {problem}", flush=True)
            bad += 1
    print(f"{'wrong identity':<18} {runs:>4} {bad:>6}  – (refused before anything is enabled)", flush=True)
    return bad


def main(runs: int) -> int:
    """Run the matrix and print one line per kind."""
    robot = robots.load("tx40")
    total = failed = 0
    print(f"{'fault':<18} {'runs':>4} {'failed':>6}  cycles to torque off: median, largest (stated)")
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            cycles, bad = [], 0
            for seed in range(FIRST_SEED, FIRST_SEED + runs):
                case = run_case(robot, kind, seed)
                problems = [*case.problems]
                if (problem := capture_problem(robot, case, Path(folder))) is not None:
                    problems.append(problem)
                bad += bool(problems)
                for text in problems:
                    print(f"  seed {seed}, node {case.node}, cycle {case.cycle}: {text}", flush=True)
                if case.run.cycles_to_rest is not None:
                    cycles.append(case.run.cycles_to_rest)
            total, failed = total + runs, failed + bad
            stated = "the stream goes on" if kind.bound is None else f"{kind.bound}"
            times = f"{np.median(cycles):.0f}, {max(cycles):.0f}" if cycles and kind.bound else "–"
            print(f"{kind.name:<18} {runs:>4} {bad:>6}  {times} ({stated})", flush=True)
    total, failed = total + runs, failed + identity_runs(robot, runs)
    print(f"{total} runs, {failed} failed")
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 20))
