"""How far a simulator goes with an identified arm: rollouts in MuJoCo beside the nominal model's.

    python -m benchmarks.elsewhere [SEED …]

A simulated arm is drawn and moved; the model identified on one motion is exported as MJCF and driven with the
recorded torque of another, from 40 states of it, without any controller. The nominal model is the arm's
description. Printed is the median over the states of the largest joint's error after 0.1, 0.5 and 2 s.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

import robots
from daq.exporting.elsewhere.arm import IdentifiedArm, identified_arm
from daq.exporting.elsewhere.mjcf import TIMESTEP, mjcf
from daq.files.model_file import write_model
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import SimulatedRun, simulate_offline
from ident import Fitted, Recording, base_parameters, identify
from ident.parameters.regressor import RegressorModel
from robots import Robot

HORIZONS = (0.1, 0.5, 2.0)
STATES = 40


@dataclass(frozen=True)
class Rollouts:
    """Median of the largest joint error, rad or m, per horizon."""

    identified: tuple[float, ...]
    nominal: tuple[float, ...]


def rollouts(seed: int, name: str = "tx40", duration: float = 10.0) -> Rollouts:
    """One arm: identified on one motion, rolled out on another."""
    robot = robots.load(name)
    truth = draw_truth(robot, seed)
    runs = [
        simulate_offline(
            robot, truth, exercise(robot, duration=duration, seed=2 * seed + k), seed=k, periods=2
        )
        for k in range(2)
    ]
    fitted = identify(robot, (recording_of(runs[0]),))
    arm = _exported(fitted, robot)
    return Rollouts(_errors(arm, runs[1]), _errors(nominal(arm), runs[1]))


def recording_of(run: SimulatedRun) -> Recording:
    return Recording("first.mcap", run.time, run.reference, run.position, run.control_signal)


def _exported(fitted: Fitted, robot: Robot) -> IdentifiedArm:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "first.mcap"
        source.write_bytes(b"")  # a model file names what it was made from by checksum
        model = write_model(Path(folder) / f"{robot.name}.model.toml", fitted, [source], robot)
    return identified_arm(robot, model)


def nominal(arm: IdentifiedArm) -> IdentifiedArm:
    """The same arm as its description has it, without offsets."""
    base = base_parameters(RegressorModel.of(arm.robot))
    prior = dict(zip(base.model.names, base.model.prior().tolist(), strict=True))

    def of(symbol: str) -> np.ndarray:
        return np.array([prior[f"{symbol}{joint + 1}"] for joint in range(arm.robot.n)])

    couplings = tuple(
        replace(
            one,
            **{
                field: prior[f"{symbol}{one.name.removeprefix('drive_')}"]
                for field, symbol in (("inertia", "Iam"), ("viscous", "Fvm"), ("coulomb", "Fcm"))
            },
        )
        for one in arm.couplings
    )
    links = base.model.prior()[: 10 * arm.robot.n].reshape(-1, 10)
    return replace(
        arm,
        links=links,
        armature=of("Ia"),
        damping=of("Fv"),
        friction=of("Fc"),
        offset=np.zeros(arm.robot.n),
        couplings=couplings,
    )


def _errors(arm: IdentifiedArm, run: SimulatedRun) -> tuple[float, ...]:
    model = mujoco.MjModel.from_xml_string(mjcf(arm)[0].decode())
    model.jnt_limited[:] = 0  # what runs away shall run away
    data = mujoco.MjData(model)
    torque = arm.robot.joint_torque(run.control_signal)
    period = float(run.time[1] - run.time[0])
    per_row, ahead = round(period / TIMESTEP), [round(h / period) for h in HORIZONS]
    starts = np.linspace(len(run.time) // 10, len(run.time) - ahead[-1] - 1, STATES).astype(int)
    found = np.zeros((STATES, len(HORIZONS)))
    for number, start in enumerate(starts):
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = run.true_position[start], run.true_velocity[start]
        for row in range(start, start + ahead[-1]):
            # Between samples the control signal goes on in a straight line, as nearly as a record tells.
            for step in range(per_row):
                share = step / per_row
                data.ctrl[:] = (1 - share) * torque[row] + share * torque[row + 1]
                mujoco.mj_step(model, data)
            if row + 1 - start in ahead:
                error = np.abs(data.qpos - run.true_position[row + 1]).max()
                found[number, ahead.index(row + 1 - start)] = error
    return tuple(np.median(found, axis=0).tolist())


def main() -> None:
    for seed in map(int, sys.argv[1:] or ["1"]):
        result = rollouts(seed)
        for what, errors in (("identified", result.identified), ("nominal", result.nominal)):
            shown = ", ".join(f"{h:g} s: {1e3 * e:.2f} mrad" for h, e in zip(HORIZONS, errors, strict=True))
            print(f"arm {seed}, {what}: {shown}")


if __name__ == "__main__":
    main()
