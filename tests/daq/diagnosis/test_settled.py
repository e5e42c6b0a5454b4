"""A set that the data cannot tell apart, and the planned motion that can: short form of naming_settled.py."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from benchmarks import naming, naming_settled
from daq.diagnosis.telling_apart import PlanSettings
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.scenario import Scenario
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan


def period(rig: Robot, seed: int, speed: float, duration: float) -> FloatArray:
    motion = plan(
        rig,
        cycle_time=rig.bus.cycle_time,
        duration=duration,
        seed=seed,
        evaluations=30,
        periods=2,
        speed=speed,
    )
    return np.asarray(motion.position[: len(motion.position) // 2])


@pytest.mark.xfail(
    reason="open: a contact that the validation hardly touches is `not_confirmed` before it is ambiguous",
    strict=True,
)
def test_the_planned_motion_settles_what_a_poor_one_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    seed = 304
    monkeypatch.setattr(naming_settled, "SETTINGS", PlanSettings(duration=5.0, evaluations=150))
    rig = robots.load("emps")
    truth, poor = draw_truth(rig, seed), period(rig, 0, 0.5, 2.5)
    drawn = draw_scenario(rig, "contact", seed, 1.0, truth=truth, reference=poor)
    accepted = naming.record(rig, truth, Scenario(), period(rig, 0, 1.0, 5.0), seed + 1)
    fit = naming.record(rig, truth, drawn.scenario, poor, seed + 2)
    validation = naming.record(rig, truth, drawn.scenario, period(rig, 1, 0.5, 2.5), seed + 3)
    arm = naming_settled.Arm(rig, truth, drawn.scenario)
    rounds = naming_settled.settle(arm, accepted, (fit,), validation, seed + 4)
    line = {"kind": "single", "arm": "emps", "effect": "contact", "axes": list(drawn.axes), "rounds": rounds}
    assert naming_settled.was_ambiguous(line) and naming_settled.truth_in_set(line)
    assert naming_settled.resolved(line)
    ((_, _, before, after),) = rounds[0]["planned"]["correlations"]
    assert after < 0.6 < 0.9 < before
    assert "| contact, emps | 1 | 1 |  |" in naming_settled.report([line])
