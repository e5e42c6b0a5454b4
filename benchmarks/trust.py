"""Can the verdict be trusted? Closed-loop Monte Carlo of the revised test on independent simulated arms.

``power``: verdicts against encoder noise and filter cut-off, with the bias of least squares and instrumental
variables beside them, in units of the IV estimate's σ. The noise is in the loop: the drives read it.

``gate1``: how often the instruments are found invalid with the right controller and model, with a gain that
is off, with one sample of delay more, and with a friction term left out of the model.

The recorded control signal has the noise of a current sensor (AR(1), 5 ms, 3 % of its rms), which does not
act. Each replicate has its own seed, counted from the one that is printed. Results go to a JSON file, which
is completed where it exists; ``draw`` makes the pictures of the documentation from it.

    python -m benchmarks.trust power --arm one_axis --replicates 40
    python -m benchmarks.trust gate1 --arm one_axis --replicates 50
    python -m benchmarks.trust draw
"""

from __future__ import annotations

import argparse
import json
import os
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
from scipy.signal import lfilter

import robots
from benchmarks.closed_loop_runs import motion, noisy_truth, record
from benchmarks.trust_pictures import draw
from daq.cli.demonstration import true_base_parameters
from ident import IdentificationError, Recording, RegressorModel, SimulationError, base_parameters, identify
from ident.closed_loop import simulate
from ident.effects import CoulombFriction, Effect, ViscousFriction
from ident.estimators import instrumental_variables, stack, weighted_least_squares
from ident.estimators.fit import stack_columns
from ident.exogeneity import GateSettings, TestedRows, revised_test, simulation_agreement
from ident.preparation.observation import observe, observed_columns
from ident.verdicts import Gate
from robots import Identification, Robot
from robots.arrays import FloatArray

SEED = 40_000
ARM_SEED, MOTION_SEED = 1, 3
SENSOR_SHARE, SENSOR_TIME = 0.03, 0.005
RESULTS = Path(__file__).with_name("trust.json")


@dataclass(frozen=True)
class Case:
    """An arm, the motion it makes, and how its samples become rows.

    Attributes:
        robot: shipped arm.
        duration: s.
        noise: factors on the encoder noise, along the power curve.
        cutoffs: Hz, each with the decimation that keeps what it lets through.
        changes: of the ``identification`` settings.
    """

    robot: str
    duration: float
    noise: tuple[float, ...]
    cutoffs: tuple[tuple[float, int], ...]
    changes: dict[str, Any]

    def prepared(self, cutoff: float, decimation: int) -> Robot:
        robot = robots.load(self.robot)
        fresh = {"cutoff_hz": cutoff, "decimation": decimation, "covariance": "ar", **self.changes}
        settings: Identification = robot.identification.model_copy(update=fresh)
        return robot.model_copy(update={"identification": settings})


ONE_AXIS = {
    "trim_samples": (100, 100),
    "minimum_speed": 0.01,
    "standstill_margin": 0.04,
    "friction_sign": "tanh",
    "friction_width": 1e-4,
    "control_signal_lag": 0.0005,
}
CASES = {
    "one_axis": Case(
        "emps",
        6.0,
        (1.0, 10.0, 30.0, 100.0, 300.0),
        ((20.0, 20), (40.0, 10), (80.0, 5), (160.0, 2)),
        ONE_AXIS,
    ),
    "tx40": Case("tx40", 10.0, (1.0, 10.0, 30.0, 100.0), ((15.0, 5), (30.0, 5), (60.0, 2)), {}),
}


def replicate(case: Case, encoder: float, number: int) -> Recording:
    """One recording; its noise comes from SEED + number."""
    robot = robots.load(case.robot)
    reference = motion(robot, case.duration, MOTION_SEED)
    recording = record(robot, noisy_truth(robot, ARM_SEED, encoder, SEED + number), reference)
    signal = recording.control_signal
    memory = np.exp(-recording.sample_time / SENSOR_TIME)
    shocks = np.random.default_rng([SEED, number]).normal(size=(signal.shape[0] + 200, signal.shape[1]))
    sensor = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], shocks, axis=0)[200:]
    return replace(recording, control_signal=signal + SENSOR_SHARE * signal.std(axis=0) * sensor)


@dataclass(frozen=True)
class Answer:
    """A verdict, and the errors (b,) of both estimates in units of the IV estimate's σ."""

    verdict: str
    ls: FloatArray | None = None
    iv: FloatArray | None = None


def power(arm: str, replicates: int) -> list[dict[str, Any]]:
    """Verdicts and biases of every noise and cut-off."""
    case, cells = CASES[arm], []
    for encoder in case.noise:
        found: dict[float, list[Answer]] = {cutoff: [] for cutoff, _ in case.cutoffs}
        for number in range(replicates):
            recording = replicate(case, encoder, number)
            for cutoff, decimation in case.cutoffs:
                found[cutoff].append(answer(case.prepared(cutoff, decimation), recording))
        for cutoff, answers in found.items():
            cell = {"arm": arm, "noise": encoder, "cutoff": cutoff, **_summary(answers)}
            cells.append(cell)
            print(
                json.dumps(
                    {key: cell[key] for key in ("noise", "cutoff", "verdicts", "ls_worst", "iv_worst")}
                )
            )
    return cells


def answer(robot: Robot, recording: Recording) -> Answer:
    """What the identification says of a recording of the benchmark's arm."""
    try:
        fitted = identify(robot, (recording,))
    except IdentificationError:
        return Answer("refused")
    result = fitted.result
    if result.instrumental is None:
        return Answer(result.test.verdict)
    named = true_base_parameters(fitted.base, noisy_truth(robot, ARM_SEED))
    truth = np.array([named[parameter.name] for parameter in result.least_squares.parameters])
    sigma = np.array([parameter.sigma for parameter in result.instrumental.parameters])
    ls, iv = (estimate.values - truth for estimate in (result.least_squares, result.instrumental))
    return Answer(result.test.verdict, ls / sigma, iv / sigma)


def _summary(answers: list[Answer]) -> dict[str, Any]:
    """Counts of verdicts; mean error of the worst parameter and its standard error, in σ."""
    summary: dict[str, Any] = {
        "replicates": len(answers),
        "verdicts": dict(Counter(answer.verdict for answer in answers)),
    }
    for name in ("ls", "iv"):
        errors = np.array([value for answer in answers if (value := getattr(answer, name)) is not None])
        bias = errors.mean(axis=0)
        worst = int(np.argmax(np.abs(bias)))
        spread = errors[:, worst].std(ddof=1) / np.sqrt(errors.shape[0]) if errors.shape[0] > 1 else None
        summary[f"{name}_worst"] = round(float(abs(bias[worst])), 3)
        summary[f"{name}_error"] = None if spread is None else round(float(spread), 3)
        summary[f"{name}_rms"] = round(float(np.sqrt(np.mean(bias**2))), 3)
    return summary


@dataclass(frozen=True)
class Scenario:
    """What of the simulated robot is not as it is: factors on gains, samples of delay, effects left out."""

    position: float = 1.0
    velocity: float = 1.0
    integral: float = 1.0
    delay: int = 0
    without: tuple[type[Effect], ...] = ()

    def model(self, robot: Robot) -> RegressorModel:
        """The model that is identified and simulated."""
        law = robot.controller
        changed = law.model_copy(
            update={
                "position_gain": tuple(self.position * k for k in law.position_gain),
                "velocity_gain": tuple(self.velocity * k for k in law.velocity_gain),
                "integral_gain": tuple(self.integral * k for k in law.integral_gain),
                "delay_samples": law.delay_samples + self.delay,
            }
        )
        whole = RegressorModel.of(robot.model_copy(update={"controller": changed}))
        return RegressorModel(
            whole.robot, tuple(effect for effect in whole.effects if not isinstance(effect, self.without))
        )


SCENARIOS = {
    "right": Scenario(),
    "position gain + 20 %": Scenario(position=1.2),
    "position gain − 20 %": Scenario(position=0.8),
    "velocity gain + 20 %": Scenario(velocity=1.2),
    "velocity gain − 20 %": Scenario(velocity=0.8),
    "velocity gain + 10 %": Scenario(velocity=1.1),
    "integral gain + 20 %": Scenario(integral=1.2),
    "integral gain − 20 %": Scenario(integral=0.8),
    "one more sample of delay": Scenario(delay=1),
    "no viscous friction": Scenario(without=(ViscousFriction,)),
    "no Coulomb friction": Scenario(without=(CoulombFriction,)),
}


def gate1(arm: str, replicates: int) -> list[dict[str, Any]]:
    """How often gate 1 closes in every scenario, and by what."""
    case = CASES[arm]
    cutoff, decimation = case.cutoffs[-2]
    robot = case.prepared(cutoff, decimation)
    integral = any(robot.controller.integral_gain)
    chosen = {name: s for name, s in SCENARIOS.items() if integral or s.integral == 1.0}
    found: dict[str, list[Gate | None]] = {name: [] for name in chosen}
    for number in range(replicates):
        recording = replicate(case, 1.0, number)
        for name, scenario in chosen.items():
            found[name].append(first_gate(scenario.model(robot), recording))
    rows = []
    for name, gates in found.items():
        row = {"arm": arm, "scenario": name, "cutoff": cutoff, "replicates": len(gates), **_closed(gates)}
        rows.append(row)
        print(json.dumps(row, ensure_ascii=False))
    return rows


def first_gate(model: RegressorModel, recording: Recording) -> Gate | None:
    """Gate 1 after three iterations of IDIM-IV; None where it closes because the estimated arm cannot be
    simulated."""
    robot, base = model.robot, base_parameters(model)
    settings = robot.identification
    rows = observe(base, (recording,), settings)
    stacked = stack(rows)
    fit = weighted_least_squares(stacked, base.names)
    for _ in range(3):
        try:
            run = simulate(model, base.standard_from(fit.beta, model.prior()), recording)
        except SimulationError:
            return None
        columns = observed_columns(base, replace(recording, time=run.time, position=run.position), settings)
        fit = instrumental_variables(stacked, stack_columns(columns, rows.used), fit.sigma)
    tested = TestedRows(rows.torque, rows.regressor, columns, rows.segment, rows.used)
    agreement = simulation_agreement(robot, (recording,), (run,))
    return revised_test(tested, base.names, np.zeros(len(base.names)), GateSettings(), agreement).gates[0]


def _closed(gates: list[Gate | None]) -> dict[str, Any]:
    """Closed gates, those of them without any simulation, and the median of the worst size of each kind."""
    sizes: dict[str, list[float]] = {"torque": [], "following error": [], "regressors": []}
    for gate in gates:
        kinds: dict[str, float] = dict.fromkeys(sizes, 0.0)
        for check in gate.columns if gate is not None else ():
            kind = "regressors" if check.kind == "regressor" else check.kind
            kinds[kind] = max(kinds[kind], check.size)
        if gate is not None:
            for kind, size in kinds.items():
                sizes[kind].append(size)
    return {
        "closed": sum(gate is None or not gate.passed for gate in gates),
        "unstable": sum(gate is None for gate in gates),
        "percent": {k: round(100 * float(np.median(v)), 3) if v else None for k, v in sizes.items()},
    }


def keep(part: str, arm: str, rows: list[dict[str, Any]]) -> None:
    """Put results of one arm in place of the former ones."""
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    known[part] = [row for row in known.get(part, []) if row["arm"] != arm] + rows
    RESULTS.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def main() -> None:
    """Parse the command line, run or draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("part", choices=("power", "gate1", "draw"))
    parser.add_argument("--arm", choices=tuple(CASES), default="one_axis")
    parser.add_argument("--replicates", type=int, default=40)
    options = parser.parse_args()
    if options.part == "draw":
        draw(json.loads(RESULTS.read_text(encoding="utf-8")))
        return
    print(f"{options.arm}: {options.replicates} replicates, seeds from {SEED}")
    work = power if options.part == "power" else gate1
    keep(options.part, options.arm, work(options.arm, options.replicates))


if __name__ == "__main__":
    main()
