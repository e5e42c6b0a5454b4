"""Do the intervals that are printed cover the truth? Closed-loop Monte Carlo on independent simulated arms.

One axis in closed loop, recorded again and again with other noise, identified each time; counted is how many
of its parameters lie in intervals of nominal 95 %: those of least squares, of instrumental variables, of the
textbook's two stages (an i.i.d. Durbin-Wu-Hausman test at 5 % chooses), and of the estimate that the verdict
recommends, by its σ and by the interval that ``armhil identify`` prints. Where gate 1 closes nothing is
recommended; such runs are counted apart. Shares come with the 95 % interval of the share,
replicates being independent and the parameters of one replicate not.

    python -m benchmarks.interval_coverage --cell reference --cell weak --replicates 500
    python -m benchmarks.interval_coverage --table

Results go to benchmarks/coverage.json, cell by cell.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
from scipy.signal import lfilter

import robots
from benchmarks.closed_loop_runs import motion, noisy_truth, record
from daq.cli.demonstration import true_base_parameters
from ident import IdentificationError, Recording, identify
from ident.estimators import stack, weighted_least_squares
from ident.identification.intervals import QUANTILE
from robots import Robot
from robots.arrays import FloatArray

SEED = 910_000
ARM_SEED, MOTION_SEED, DURATION = 1, 3, 6.0
RESULTS = Path(__file__).with_name("coverage.json")
SENSOR_SHARE = 0.03
"""Deviation of the recorded control signal's noise, of its rms."""

SETTINGS: dict[str, Any] = {
    "covariance": "ar",
    "trim_samples": (100, 100),
    "minimum_speed": 0.01,
    "standstill_margin": 0.04,
    "friction_sign": "tanh",
    "friction_width": 1e-4,
    "control_signal_lag": 0.0005,
}
WAYS = ("ls_iid", "ls", "iv", "textbook", "recommended_sigma", "interval")


@dataclass(frozen=True)
class Cell:
    """What a record is made with, and how it becomes rows.

    Attributes:
        encoder: factor on the encoder's noise.
        cutoff, decimation: Hz, and one row in so many.
        sensor_time: memory of the recorded control signal's noise, s.
        torque_time: memory of the torque noise that moves the arm, s; 0 for white.
        bristle: factor on the displacement over which dry friction turns round: the model has none.
        scale: of the motion.
        reversals: whether rows near reversals are fitted.
        margin: s to either side of one that are not.
        filters: ``torque_filter`` and ``decimation_filter``: those of the published rig, or the defaults.
    """

    encoder: float = 10.0
    cutoff: float = 40.0
    decimation: int = 10
    sensor_time: float = 0.005
    torque_time: float = 0.0
    bristle: float = 1.0
    scale: float = 1.0
    reversals: bool = False
    margin: float = 0.04
    filters: tuple[str, str] = ("none", "chebyshev")

    def prepared(self) -> Robot:
        robot = robots.load("emps")
        changes = {
            **SETTINGS,
            "cutoff_hz": self.cutoff,
            "decimation": self.decimation,
            "standstill_margin": self.margin,
            "torque_filter": self.filters[0],
            "decimation_filter": self.filters[1],
        }
        if self.reversals:
            changes |= {"minimum_speed": 0.0, "standstill_margin": 0.0}
        return robot.model_copy(update={"identification": robot.identification.model_copy(update=changes)})


DEFAULT = ("positions", "fir")
CELLS = {
    "reference": Cell(),
    "100 × encoder noise, 80 Hz": Cell(encoder=100.0, cutoff=80.0, decimation=5),
    "rows near reversals": Cell(reversals=True),
    "weak motion, 20 Hz": Cell(scale=0.2, cutoff=20.0, decimation=20),
    "weak motion, 20 Hz, margin of its filter": Cell(scale=0.2, cutoff=20.0, decimation=20, margin=0.12),
    "errors remember 50 ms": Cell(sensor_time=0.05),
    "weak motion": Cell(scale=0.2),
    "cut-off 20 Hz": Cell(cutoff=20.0, decimation=20),
    "weak motion, 20 Hz, default filters": Cell(scale=0.2, cutoff=20.0, decimation=20, filters=DEFAULT),
    "friction turns 20 × as slowly": Cell(bristle=20.0, reversals=True),
    "100 × encoder noise": Cell(encoder=100.0),
    "torque noise remembers 20 ms": Cell(torque_time=0.02),
}


def recorded(cell: Cell, number: int) -> Recording:
    """One recording; its noise comes from SEED + number."""
    robot = robots.load("emps")
    truth = noisy_truth(robot, ARM_SEED, cell.encoder, SEED + number)
    width = tuple(cell.bristle * one for one in truth.bristle_width)
    truth = replace(truth, bristle_width=width, torque_noise_time_constant=cell.torque_time)
    home = np.array(robot.home)
    recording = record(robot, truth, home + cell.scale * (motion(robot, DURATION, MOTION_SEED) - home))
    signal = recording.control_signal
    memory = np.exp(-recording.sample_time / cell.sensor_time)
    warm_up = round(20.0 * cell.sensor_time / recording.sample_time)
    shocks = np.random.default_rng([SEED, number]).normal(size=(signal.shape[0] + warm_up, signal.shape[1]))
    sensor = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], shocks, axis=0)[warm_up:]
    return replace(recording, control_signal=signal + SENSOR_SHARE * signal.std(axis=0) * sensor)


def replicate(cell: Cell, number: int) -> tuple[str, dict[str, FloatArray]]:
    """Verdict, and per way whether each parameter lies in its interval, (b,)."""
    try:
        fitted = identify(cell.prepared(), (recorded(cell, number),))
    except IdentificationError:
        return "refused", {}
    result, base = fitted.result, fitted.base
    verdict = result.test.verdict
    if result.instrumental is None or fitted.instrumental is None:
        return verdict, {}
    named = true_base_parameters(base, noisy_truth(robots.load("emps"), ARM_SEED))
    truth = np.array([named[name] for name in base.names])
    plain = weighted_least_squares(stack(fitted.rows), base.names)
    textbook = result.textbook is not None and result.textbook.passed
    chosen = result.least_squares if textbook else result.instrumental
    advised = result.of_verdict
    half = np.array([parameter.half_width for parameter in advised.parameters], dtype=np.float64)
    return verdict, {
        "ls_iid": _inside(plain.beta, np.sqrt(np.diag(plain.covariance)), truth),
        "ls": _inside(fitted.least_squares.beta, _sigma(result.least_squares.covariance), truth),
        "iv": _inside(fitted.instrumental.beta, _sigma(result.instrumental.covariance), truth),
        "textbook": _inside(chosen.values, _sigma(chosen.covariance), truth),
        "recommended_sigma": _inside(advised.values, _sigma(advised.covariance), truth),
        "interval": _inside(advised.values, half / QUANTILE, truth),
        "wider": half / QUANTILE / _sigma(advised.covariance),
    }


def _sigma(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.diag(covariance)))


def _inside(value: FloatArray, sigma: FloatArray, truth: FloatArray) -> FloatArray:
    return np.asarray(np.abs(value - truth) < QUANTILE * sigma, dtype=np.float64)


def run(name: str, replicates: int, seconds: float) -> dict[str, Any]:
    """One cell: shares in %, with half of their 95 % interval, and how wide the interval is in σ.

    Args:
        name: of the cell.
        replicates: at most.
        seconds: after which none is begun; how many there were is told.
    """
    began, answers = time.monotonic(), []
    for number in range(replicates):
        if time.monotonic() - began > seconds:
            break
        answers.append(replicate(CELLS[name], number))
    accepted = [found for verdict, found in answers if found and verdict != "instruments_invalid"]
    cell: dict[str, Any] = {"cell": name, "replicates": len(answers), "accepted": len(accepted)}
    for way in WAYS if accepted else ():
        shares = np.array([found[way].mean() for found in accepted])
        spread = shares.std(ddof=1) / np.sqrt(shares.size)
        cell[way] = [round(100 * float(shares.mean()), 2), round(100 * QUANTILE * float(spread), 2)]
    if accepted:
        cell["parameters"] = [
            round(100 * float(v), 1) for v in np.mean([f["interval"] for f in accepted], axis=0)
        ]
        cell["wider"] = round(float(np.median([f["wider"] for f in accepted])), 3)
    return cell


def table(cells: list[dict[str, Any]]) -> str:
    """Markdown of what was kept."""
    lines = [
        "| cell | accepted | LS, i.i.d. σ | LS | IV | textbook's two stages | recommended, σ | **printed** |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for cell in cells:
        shares = [f"{cell[way][0]:.1f} ± {cell[way][1]:.1f}" if way in cell else "–" for way in WAYS]
        shares[-1] = f"**{shares[-1]}**"
        lines.append(
            f"| {cell['cell']} | {cell['accepted']} of {cell['replicates']} | {' | '.join(shares)} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run cells, keep them, or print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cell", action="append", choices=CELLS)
    parser.add_argument("--replicates", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of each cell, at most")
    parser.add_argument("--table", action="store_true")
    asked = parser.parse_args()
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    if asked.table:
        print(table(kept))
        return
    for name in asked.cell or CELLS:
        cell = run(name, asked.replicates, asked.seconds)
        kept = [one for one in kept if one["cell"] != name] + [cell]
        RESULTS.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(json.dumps(cell, ensure_ascii=False), flush=True)


if __name__ == "__main__":
    main()
