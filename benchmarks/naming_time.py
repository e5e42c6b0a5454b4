"""How long the whole vocabulary takes on a capture of a minute: ``armhil diagnose`` as a user runs it.

Six axes, five periods of 12 s to fit and two of another motion to validate, from the simulated arm without a
bus, with the model of an accepted run as prior. Processor seconds are of the process and its children, so
they mean the same on a busy machine; wall seconds only mean something on an idle one.

    python -m benchmarks.naming_time --effects none backlash payload

Another checkout of the program can be timed beside it, in turn on the same captures: on a busy machine the
ratio of the two is all that a time says.

    python -m benchmarks.naming_time --effects none --against ../before
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import robots
from daq.files.model_file import SUFFIX
from daq.identification.identify import IdentifyRequest, run_identify
from daq.recording.recorder import Recorder
from daq.recording.run_facts import run_facts
from daq.text.progress import Silent
from drivers import Samples
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from robots import Robot
from trajectories import Trajectory, plan

ARM = "tx40"
PERIOD = 12.0
NOTHING = "none"
ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    """Record, diagnose, and print one line of JSON per effect."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--effects", nargs="+", default=[NOTHING, "backlash", "payload"])
    parser.add_argument("--seed", type=int, default=60)
    parser.add_argument("--size", type=float, default=3.0, help="gap of what is hidden, in noise floors")
    parser.add_argument("--profile", type=Path, help="write a profile of the command there (cProfile)")
    parser.add_argument("--against", type=Path, help="another checkout, timed in turn")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for effect in given.effects:
            place = Path(folder) / effect
            place.mkdir()
            captures(place, effect, given.seed, given.size)
            for root in (ROOT, *([given.against.resolve()] if given.against else [])):
                told = {"hidden": effect, "checkout": root.name}
                print(json.dumps(timed(place, given.profile, root) | told), flush=True)


def captures(folder: Path, effect: str, seed: int, size: float) -> None:
    """An accepted run and its model, a minute to fit, another motion to validate."""
    robot = robots.load(ARM)
    truth, motions = draw_truth(robot, seed), {}
    for name, number, periods in (("accepted", 0, 2), ("fit", 0, 5), ("validation", 1, 2)):
        motions[name] = plan(
            robot,
            cycle_time=robot.bus.cycle_time,
            duration=PERIOD,
            seed=number,
            evaluations=100,
            periods=periods,
        )
    hidden = Scenario()
    if effect != NOTHING:
        reference = motions["accepted"].position[: round(PERIOD / robot.bus.cycle_time)]
        hidden = draw_scenario(robot, effect, seed, size, truth=truth, reference=reference).scenario
    for offset, (name, motion) in enumerate(motions.items()):
        scenario = Scenario() if name == "accepted" else hidden
        run = simulate_offline(robot, truth, motion.position, scenario=scenario, seed=seed + offset)
        write(folder / f"{name}.mcap", robot, motion, run.samples())
    run_identify(IdentifyRequest((folder / "accepted.mcap",), robot=ARM, out=folder / "model"), Silent())


def write(path: Path, robot: Robot, motion: Trajectory, samples: Samples) -> None:
    """The capture that a master would have written."""
    facts = run_facts(robot, {"channel": "offline", "kind": "timing"}, motion, ())
    with Recorder(path, robot, facts) as recorder:
        recorder.write(samples)
        recorder.finish({"outcome": "completed", "reason": "", "cycles": str(len(samples.cycle))})


_MEASURED = "import resource, subprocess, sys; code = subprocess.run(sys.argv[1:]).returncode\n" + (
    "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr); sys.exit(code)"
)
"""A process of its own for each command: the peak of memory is that of the largest child so far."""


def timed(folder: Path, profile: Path | None, root: Path) -> dict[str, Any]:
    """Run the command of a checkout in a process of its own."""
    command = [
        sys.executable,
        "-c",
        _MEASURED,
        sys.executable,
        *(["-m", "cProfile", "-o", str(profile)] if profile else []),
        "-m",
        "daq",
    ]
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(
        [
            *command,
            "diagnose",
            str(folder / "fit.mcap"),
            "--validate",
            str(folder / "validation.mcap"),
            "--prior",
            str(folder / "model" / f"{ARM}{SUFFIX}"),
            "--no-catalogue",
            "--json",
        ],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        check=False,
        text=True,
    )
    wall, after = time.monotonic() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    if not done.stdout:
        raise SystemExit(done.stderr)
    found = json.loads(done.stdout)
    return {
        "processor_seconds": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
        "wall_seconds": round(wall, 1),
        "peak_megabytes": int(done.stderr.split()[-1]) // 1024,
        "verdict": found["verdict"],
        "findings": [[one["effect"], one["joints"]] for one in found["findings"]],
    }


if __name__ == "__main__":
    main()
