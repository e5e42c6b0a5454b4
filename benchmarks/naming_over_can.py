"""The blind test over CAN frames: a sealed scenario in the drives' process, captures over the bus, one name.

Each step is a process of its own. *hide* draws an effect from a seed and writes the scenario file. *record*
starts the simulated drives, whose process alone reads that file and seals what it simulates, and records over
the bus: one run to fit, one to validate, and, unless ``--refit``, one with nothing hidden, whose model is
the prior. *diagnose* reads captures, nothing else. The seal is opened last.

With vcan-run the bus is SocketCAN in a user-mode kernel, and its time is virtual: every run is the same bit
for bit, however busy the machine is.

    python -m benchmarks.naming_over_can --effects payload base_tilt --seeds 2 --vcan-run .../vcan-run
    python -m benchmarks.naming_over_can --live --effects hysteresis --vcan-run .../vcan-run
    python -m benchmarks.naming_over_can --effects payload --interface socketcan --channel vcan0
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import robots
from daq.diagnosis.bench import LiveArm
from daq.diagnosis.diagnose import run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.diagnosis.live import LiveRequest, run_live
from daq.files.toml_text import toml_text
from daq.identification.identify import IdentifyRequest, run_identify
from daq.recording.trajectory_file import read_motion, write_trajectory
from daq.session.bench import ArmOrder, opened
from daq.session.cell import Cell
from daq.session.recorded_runs import unconducted
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import Channel
from drivers.simulated.drawing import draw_scenario, exercise
from drivers.simulated.seal import open_seal, truth_of, was_opened
from trajectories import Trajectory, plan

ARM = "tx40"
ROOT = Path(__file__).resolve().parents[1]
CAPTURES = ("accepted", "fit", "validation")


@dataclass(frozen=True)
class Bus:
    """Where the frames go: a channel, and the command in front of what uses it."""

    channel: Channel
    before: tuple[str, ...] = ()


def virtual_time(vcan_run: Path, patience: float = 400.0) -> Bus:
    """SocketCAN in a user-mode kernel in virtual time."""
    return Bus(Channel("socketcan", "vcan0"), (str(vcan_run), "-v", "-t", f"{patience:g}", "--"))


def main() -> None:
    """Run one step, or all of them for some effects and seeds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--step", choices=["hide", "record", "live"], help="one step, in --folder")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--effects", nargs="+", default=["payload"])
    parser.add_argument("--seed", type=int, default=900, help="of the first arm")
    parser.add_argument("--seeds", type=int, default=1, help="arms per effect")
    parser.add_argument("--size", type=float, default=6.0, help="gap of what is hidden, in noise floors")
    parser.add_argument("--duration", type=float, default=8.0, help="of one period of the motions, s")
    parser.add_argument("--refit", action="store_true", help="search after a refit, without a prior")
    parser.add_argument("--live", action="store_true", help="diagnose with the arm in the loop")
    parser.add_argument("--vcan-run", type=Path, help="runs a command in virtual time")
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="vcan0")
    given = parser.parse_args()
    channel = Channel(given.interface, given.channel)
    if given.step == "hide":
        hide(given.folder, given.effects[0], given.seed, given.size)
    elif given.step == "record":
        record(given.folder, channel, given.seed, given.refit)
    elif given.step == "live":
        live(given.folder, channel, given.seed, given.duration)
    else:
        bus = Bus(channel) if given.vcan_run is None else virtual_time(given.vcan_run)
        for effect in given.effects:
            for seed in range(given.seed, given.seed + given.seeds):
                with tempfile.TemporaryDirectory() as folder:
                    arguments = (Path(folder), effect, seed, given.size, given.duration, bus)
                    found = blind_live(*arguments) if given.live else blind(*arguments, given.refit)
                    print(json.dumps(found), flush=True)


def blind(
    folder: Path, effect: str, seed: int, size: float, duration: float, bus: Bus, refit: bool = False
) -> dict[str, Any]:
    """All steps for one effect and one arm; what was hidden beside what was found."""
    motions(folder, duration)
    _step("hide", folder, seed, ("--effects", effect, "--size", str(size)))
    where = ("--interface", bus.channel.interface, "--channel", bus.channel.name)
    _step("record", folder, seed, (*where, "--refit") if refit else where, bus)
    found = diagnose(folder, refit)
    seal = folder / "seal.json"
    early = was_opened(seal)
    _, scenario = truth_of(open_seal(seal, by="naming over CAN, after the diagnosis"))
    return {
        "hidden": [[name, list(axes)] for name, axes in scenario.effects()],
        "seed": seed,
        "verdict": found.diagnosis.verdict,
        "findings": [
            {
                "effect": finding.effect,
                "joints": list(finding.joints),
                "indistinguishable": [[[c.effect], [list(c.joints)]] for c in finding.indistinguishable_from],
            }
            for finding in found.diagnosis.findings
        ],
        "gap": found.content["gap"]["torque"],
        "opened_before_the_diagnosis": list(early),
    }


def blind_live(
    folder: Path, effect: str, seed: int, size: float, duration: float, bus: Bus
) -> dict[str, Any]:
    """The same with the arm in the loop: ``armhil diagnose --live --yes``, which makes its own motions."""
    _step("hide", folder, seed, ("--effects", effect, "--size", str(size)))
    where = ("--interface", bus.channel.interface, "--channel", bus.channel.name)
    _step("live", folder, seed, (*where, "--duration", str(duration)), bus)
    rounds = json.loads((folder / "live.json").read_text(encoding="utf-8"))
    early = was_opened(folder / "seal.json")
    _, scenario = truth_of(open_seal(folder / "seal.json", by="naming over CAN, live, after the diagnosis"))
    return {
        "hidden": [[name, list(axes)] for name, axes in scenario.effects()],
        "seed": seed,
        "rounds": rounds,
        "opened_before_the_diagnosis": list(early),
    }


def live(folder: Path, channel: Channel, seed: int, duration: float) -> None:
    """Record, diagnose, and move again for what is ambiguous, with leave for every motion."""
    robot = robots.load(ARM)
    first = DiagnoseRequest((), robot=ARM, evaluations=300)
    request = LiveRequest(first, robot, folder / "live", duration=duration, evaluations=100)
    request.folder.mkdir()
    with _opened(ArmOrder(robot, ARM, channel, simulated=True, seed=seed, **_hidden(folder))) as arm:
        found = run_live(request, arm.drive, Silent())
    rounds = [
        {
            "verdict": result.diagnosis.verdict,
            "findings": [
                [finding.effect, list(finding.joints), [c.words() for c in finding.indistinguishable_from]]
                for finding in result.diagnosis.findings
            ],
        }
        for result in found.results
    ]
    (folder / "live.json").write_text(json.dumps(rounds), encoding="utf-8")


def motions(folder: Path, duration: float) -> None:
    """Two exciting motions: one for the accepted model and to fit, one to validate."""
    robot = robots.load(ARM)
    for name, seed in (("fit", 0), ("validation", 1)):
        planned = plan(
            robot,
            cycle_time=robot.bus.cycle_time,
            duration=duration,
            seed=seed,
            evaluations=100,
            periods=2,
        )
        write_trajectory(folder / f"{name}.trajectory.json", planned, robot)


def hide(folder: Path, effect: str, seed: int, size: float) -> None:
    """Draw an effect for the arm of a seed; the file is for the drives alone."""
    robot = robots.load(ARM)
    drawn = draw_scenario(robot, effect, seed, size, reference=exercise(robot, duration=4.0))
    (folder / "scenario.toml").write_text(toml_text({"format": 1, **drawn.scenario.as_dict()}))


def record(folder: Path, channel: Channel, seed: int, refit: bool = False) -> None:
    """Captures over the bus: with nothing hidden unless ``refit``, then twice with what the scenario says."""
    robot = robots.load(ARM)
    for names, hidden in ((CAPTURES[:1], {}), (CAPTURES[1:], _hidden(folder)))[1 if refit else 0 :]:
        with _opened(ArmOrder(robot, ARM, channel, simulated=True, seed=seed, **hidden)) as arm:
            for name in names:
                arm.drive(_motion(folder, name), folder / f"{name}.mcap", name)


@contextmanager
def _opened(order: ArmOrder) -> Iterator[LiveArm]:
    with opened(order, None, Silent(), "drive") as arm:
        yield LiveArm(arm, order, None, Cell(), lambda question: True, Nobody(), unconducted)


def _hidden(folder: Path) -> dict[str, Any]:
    return {"scenario": folder / "scenario.toml", "seal": folder / "seal.json"}


def _motion(folder: Path, name: str) -> Trajectory:
    robot = robots.load(ARM)
    file = "validation" if name == "validation" else "fit"
    found = read_motion(folder / f"{file}.trajectory.json", robot)
    return Trajectory.sampled(
        found.motion,
        found.cycle_time,
        family="ruckig",
        seed=found.seed,
        score=found.score,
        repeat=found.repeat,
    )


def diagnose(folder: Path, refit: bool = False) -> DiagnoseResult:
    """As a user does: the accepted run's model is the prior of the search, or there is none."""
    accepted = folder / "identified"
    if not refit:
        run_identify(IdentifyRequest((folder / "accepted.mcap",), out=accepted), Silent())
    request = DiagnoseRequest(
        (folder / "fit.mcap",),
        (folder / "validation.mcap",),
        prior=None if refit else str(accepted / f"{ARM}.model.toml"),
        out=folder / "diagnosis",
        evaluations=0,
    )
    return run_diagnose(request, Silent())


def _step(name: str, folder: Path, seed: int, more: Sequence[str], bus: Bus | None = None) -> None:
    """A step in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.naming_over_can", "--step", name]
    subprocess.run(
        [*(bus.before if bus else ()), *command, "--folder", str(folder), "--seed", str(seed), *more],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        check=True,
        timeout=900,
    )


if __name__ == "__main__":
    main()
