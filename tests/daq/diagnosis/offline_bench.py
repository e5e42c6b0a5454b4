"""A bench without a bus: the simulated drives and plant of a scenario, recorded as a master would have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.identification.run_facts import run_facts
from daq.recording.recorder import Recorder
from drivers import Samples
from drivers.simulated import PlantTruth
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import EMPTY, Scenario
from robots import Robot
from trajectories import Trajectory

_OPERATION_ENABLED = 0x1237


@dataclass
class OfflineBench:
    """Streams to an arm whose scenario nobody but the plant sees; each run has noise of its own."""

    robot: Robot
    truth: PlantTruth
    scenario: Scenario = EMPTY
    runs: int = 0

    def stream(self, trajectory: Trajectory, path: Path) -> Path:
        """What ``daq.diagnosis.bench`` does over a bus."""
        self.runs += 1
        run = simulate_offline(
            self.robot, self.truth, trajectory.position, scenario=self.scenario, seed=100 + self.runs
        )
        rows, joints = run.position.shape
        samples = Samples(
            cycle=run.cycle,
            time=run.time,
            reference=run.reference,
            position=run.position,
            control_signal=run.control_signal,
            statusword=np.full((rows, joints), _OPERATION_ENABLED, dtype=np.uint16),
            complete=np.ones((rows, joints), dtype=np.bool_),
            lateness=np.zeros(rows),
        )
        facts = run_facts(self.robot, {"channel": "offline", "kind": "diagnosis"}, trajectory, ())
        with Recorder(path, self.robot, facts) as recorder:
            recorder.write(samples)
            recorder.finish({"outcome": "completed", "reason": "", "cycles": str(rows)})
        return path
