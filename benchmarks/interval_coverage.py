"""Do the intervals that are printed cover the truth? Closed-loop Monte Carlo on independent simulated arms.

One axis or six in closed loop, recorded again and again with other noise, identified each time; counted is
how many of the parameters lie in intervals of nominal 95 %: those of least squares, of instrumental
variables, of the textbook's two stages (an i.i.d. Durbin-Wu-Hausman test at 5 % chooses), and of the estimate
that the verdict recommends, by its σ and by the interval that ``armhil identify`` prints. Where gate 1 closes
nothing is recommended; such runs are counted apart. Shares come with the 95 % interval of the share,
replicates being independent and the parameters of one replicate not. What noise does not change is made once
a cell (``benchmarks/made_once.py``) unless ``--whole`` is given.

    python -m benchmarks.interval_coverage --cell reference --cell weak --replicates 500
    python -m benchmarks.interval_coverage --arm tx40 --kept coverage.jsonl --seconds 540
    python -m benchmarks.interval_coverage --table

Results go to benchmarks/coverage.json, cell by cell; with ``--kept`` each replicate goes to a file first, so
that a cell can be stopped and gone on with.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
from scipy.signal import lfilter

import robots
from benchmarks.closed_loop_runs import motion, noisy_truth, record
from benchmarks.made_once import made_once
from daq.cli.demonstration import true_base_parameters
from drivers.simulated.drawing.gap import silent
from ident import IdentificationError, Recording, identify
from ident.estimators import stack, weighted_least_squares
from ident.identification.intervals import QUANTILE
from robots import Robot
from robots.arrays import FloatArray

SEED, UNSEEN = 910_000, 86_500
"""Of the first replicate; the second of cells that came later."""
ARM_SEED, MOTION_SEED = 1, 3
DURATION = {"emps": 6.0, "tx40": 12.0}
"""Of the motion, s."""
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
"""Of the published rig; the six-axis arm has those that it is shipped with."""
Answer = tuple[str, dict[str, FloatArray]]
"""Verdict, and per way whether each parameter lies in its interval, (b,)."""
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
        arm: a shipped one.
        seed: of the first replicate.
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
    arm: str = "emps"
    seed: int = SEED

    def prepared(self) -> Robot:
        robot = robots.load(self.arm)
        changes = {
            **(SETTINGS if self.arm == "emps" else {}),
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
_LATER = {
    f"{name}, default filters": replace(cell, filters=DEFAULT, seed=UNSEEN)
    for name, cell in CELLS.items()
    if cell.filters != DEFAULT
}
CELLS = _LATER | CELLS
"""What was scored before keeps its seeds."""
SIX = Cell(1.0, 60.0, 5, margin=0.08, filters=DEFAULT, arm="tx40", seed=UNSEEN)
"""As shipped."""
CELLS |= {
    "six axes": SIX,
    "six axes, 30 × encoder noise": replace(SIX, encoder=30.0),
    "six axes, cut-off 25 Hz": replace(SIX, cutoff=25.0, decimation=10),
    "six axes, errors remember 50 ms": replace(SIX, sensor_time=0.05),
    "six axes, torque noise remembers 20 ms": replace(SIX, torque_time=0.02),
    "six axes, motion a third as large": replace(SIX, scale=1 / 3),
    "six axes, friction turns 20 × as slowly": replace(SIX, bristle=20.0),
}


def recorded(cell: Cell, number: int | None) -> Recording:
    """One recording; its noise comes from the cell's seed + number. Without a number there is none."""
    robot = robots.load(cell.arm)
    truth = noisy_truth(robot, ARM_SEED, cell.encoder, cell.seed + (number or 0))
    width = tuple(cell.bristle * one for one in truth.bristle_width)
    truth = replace(truth, bristle_width=width, torque_noise_time_constant=cell.torque_time)
    home = np.array(robot.home)
    path = home + cell.scale * (motion(robot, DURATION[cell.arm], MOTION_SEED) - home)
    if number is None:
        return record(robot, silent(truth), path)
    recording = record(robot, truth, path)
    signal = recording.control_signal
    memory = np.exp(-recording.sample_time / cell.sensor_time)
    warm_up = round(20.0 * cell.sensor_time / recording.sample_time)
    shocks = np.random.default_rng([cell.seed, number]).normal(
        size=(signal.shape[0] + warm_up, signal.shape[1])
    )
    sensor = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], shocks, axis=0)[warm_up:]
    return replace(recording, control_signal=signal + SENSOR_SHARE * signal.std(axis=0) * sensor)


def replicate(cell: Cell, number: int) -> Answer:
    """Identified from one recording."""
    try:
        fitted = identify(cell.prepared(), (recorded(cell, number),))
    except IdentificationError:
        return "refused", {}
    result, base = fitted.result, fitted.base
    verdict = result.test.verdict
    if result.instrumental is None or fitted.instrumental is None:
        return verdict, {}
    named = true_base_parameters(base, noisy_truth(robots.load(cell.arm), ARM_SEED))
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
        "off": (advised.values - truth) / half * QUANTILE,
    }


def _sigma(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.diag(covariance)))


def _inside(value: FloatArray, sigma: FloatArray, truth: FloatArray) -> FloatArray:
    return np.asarray(np.abs(value - truth) < QUANTILE * sigma, dtype=np.float64)


def answers_of(name: str, replicates: int, seconds: float, kept: Path | None, whole: bool) -> list[Answer]:
    """One cell's replicates; those that are kept are not made again.

    Args:
        name: of the cell.
        replicates: at most.
        seconds: after which none is begun; how many there were is told.
        kept: file of what was made, one line of JSON a replicate, which is gone on with.
        whole: whether everything is made anew for each.
    """
    began, answers = time.monotonic(), _kept(name, kept)
    cell = CELLS[name]
    with nullcontext() if whole else made_once(cell.prepared(), (recorded(cell, None),)):
        while len(answers) < replicates and time.monotonic() - began < seconds:
            verdict, found = replicate(cell, len(answers))
            answers.append((verdict, found))
            if kept is not None:
                line = {"cell": name, "verdict": verdict, **{way: v.tolist() for way, v in found.items()}}
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(line, ensure_ascii=False) + "\n")
    return answers


def _kept(name: str, path: Path | None) -> list[Answer]:
    lines = [] if path is None or not path.exists() else path.read_text(encoding="utf-8").splitlines()
    own = [line for line in map(json.loads, lines) if line.pop("cell") == name]
    return [(line.pop("verdict"), {way: np.array(v) for way, v in line.items()}) for line in own]


def summary(name: str, answers: Sequence[Answer]) -> dict[str, Any]:
    """Of one cell: shares in %, with half of their 95 % interval, and how wide the interval is in σ."""
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
    parser.add_argument("--arm", choices=DURATION, help="in place of --cell: every cell of it")
    parser.add_argument("--replicates", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of each cell, at most")
    parser.add_argument("--kept", type=Path, help="file of replicates that is gone on with")
    parser.add_argument("--whole", action="store_true", help="make everything anew for each replicate")
    parser.add_argument("--table", action="store_true")
    asked = parser.parse_args()
    kept = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    if asked.table:
        print(table(kept))
        return
    for name in asked.cell or [n for n, cell in CELLS.items() if asked.arm in (None, cell.arm)]:
        cell = summary(name, answers_of(name, asked.replicates, asked.seconds, asked.kept, asked.whole))
        kept = [one for one in kept if one["cell"] != name] + [cell]
        RESULTS.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(json.dumps(cell, ensure_ascii=False), flush=True)


if __name__ == "__main__":
    main()
