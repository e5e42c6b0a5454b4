"""A bench without a bus: the simulated drives and plant of a scenario, recorded as a master would have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from daq.recording.recorder import Recorder
from daq.recording.run_facts import run_facts
from drivers.simulated import PlantTruth
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import EMPTY, Scenario
from robots import Robot
from trajectories import Trajectory


@dataclass
class OfflineBench:
    """Streams to an arm whose scenario nobody but the plant sees; each run has noise of its own."""

    robot: Robot
    truth: PlantTruth
    scenario: Scenario = EMPTY
    runs: int = 0

    def stream(self, trajectory: Trajectory, path: Path, purpose: str = "") -> Path:
        """What ``daq.diagnosis.bench`` does over a bus."""
        self.runs += 1
        run = simulate_offline(
            self.robot, self.truth, trajectory.position, scenario=self.scenario, seed=100 + self.runs
        )
        facts = run_facts(self.robot, {"channel": "offline", "kind": "diagnosis"}, trajectory, ())
        with Recorder(path, self.robot, facts) as recorder:
            recorder.write(run.samples())
            recorder.finish({"outcome": "completed", "reason": "", "cycles": str(len(run.cycle))})
        return path
