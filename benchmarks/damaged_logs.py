"""Recorded logs, damaged by seeds, read with their URDFs alone: refused, warned, right, or wrong.

A run is *right* where its model leaves at most a tenth more of the undamaged log's torque, in each joint,
than the model of the undamaged log does; *wrong* where it is not right and no word of warning came with it:
none that the undamaged log does not have too and, of a wrong scale, none that names the worse joints.

    python -m benchmarks.damaged_logs --seeds 100 --first 0
"""

from __future__ import annotations

import argparse
import json
import re
import time
import tomllib
import traceback
from collections import Counter
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy.io

from benchmarks.log_damages import DAMAGES, Log, one_torque_unit, torque_unit
from daq.identification.identify import IdentifyRequest, IdentifyResult, run_identify
from daq.importing.guess_log import GuessRequest
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_log
from daq.text.progress import Silent
from ident import Recording
from ident.estimators import stack
from ident.preparation.observation import observe
from robots.arrays import BoolArray, FloatArray
from robots.errors import UserError

ROOT = Path(__file__).parents[1]
WORSE = 1.1
"""Times the error of the undamaged log's model, from which on a model is not right."""
TOLD = ("look it over", "turned round", "known no better")
"""Guesses that ask to be looked at."""
OF_SCALE = (torque_unit, one_torque_unit)
"""Of what guesses say of the scale of a joint's torque, they warn of these alone."""


@dataclass(frozen=True)
class Case:
    """An arm's log as a table, its URDF, and what its owner would say of it."""

    log: Log
    urdf: Path
    hints: LogHints


@cache
def cases(data: Path) -> dict[str, Case]:
    """The three recorded logs, short."""
    rec = scipy.io.loadmat(data / "kr300/A/data.mat", struct_as_record=False, squeeze_me=True)["rec"]
    kuka = _log(rec.time_cont, np.deg2rad(rec.act_pos_mot_deg.T), rec.act_torque_abs_nm.T)
    axis = scipy.io.loadmat(data / "emps/DATA_EMPS.mat", squeeze_me=True)
    rows = slice(0, 10000)
    force = axis["vir"][rows, np.newaxis] * axis["gtau"]
    emps = _log(axis["t"][rows], axis["qm"][rows, np.newaxis], force)
    q, torque = (
        np.loadtxt(data / "tx40" / name, delimiter=",", skiprows=1)[::10]
        for name in ("pos_read_data.csv", "curr_data.csv")
    )
    staubli = _log(np.arange(len(q)) * 2e-3, q, torque)
    gears = (1798 / 7, 1872 / 7, 757 / 3, 221, 5032 / 21, 206793 / 1340)
    return {
        "kr300": Case(kuka, data / "kr300/kr300.urdf", LogHints(ratio=gears)),
        "emps": Case(emps, ROOT / "robots/emps/emps.urdf", LogHints()),
        "tx40": Case(
            staubli, data / "tx40/tx40_mdh_modified.urdf", LogHints(ratio=(32, 32, 45, -48, 45, 32))
        ),
    }


def _log(stamps: FloatArray, position: FloatArray, torque: FloatArray) -> Log:
    positions = {f"q_{k + 1}": column for k, column in enumerate(position.T)}
    torques = {f"tau_{k + 1}": column for k, column in enumerate(torque.T)}
    return Log({"time": stamps, **positions, **torques}, "time", tuple(positions), tuple(torques))


@dataclass(frozen=True)
class Run:
    """What came of one log."""

    result: IdentifyResult
    offset: FloatArray
    recording: Recording

    @property
    def warnings(self) -> set[str]:
        """Without their numbers, but for those of joints."""
        said = (*self.result.fitted.result.warnings, *self.told)
        return {re.sub(r"(?<![a-z][_ ])[-−+]?\d[\d.·⁻eE]*", "#", w)[:60] for w in said}

    @property
    def told(self) -> list[str]:
        """Guesses that ask to be looked at."""
        return [w for w in self.result.guessed if any(mark in w for mark in TOLD)]

    def names(self, joints: BoolArray) -> bool:
        """Whether each of these joints is named in a guess that asks to be looked at."""
        names = [joint.name for joint in self.result.fitted.base.model.robot.joint]
        chosen = [name for name, wanted in zip(names, joints, strict=True) if wanted]
        return all(any(re.search(rf"\b{name}\b", w) for w in self.told) for name in chosen)


def read(case: Case, log: Log, folder: Path) -> Run:
    """Identify a log as its owner would.

    Raises:
        UserError: it is refused.
    """
    path, robot = folder / "log.csv", folder / "robot"
    path.write_bytes(log.text())
    robot.mkdir()
    request = GuessRequest(case.urdf, case.hints, save_robot=robot)
    result = run_identify(IdentifyRequest((path,), guess=request), Silent())
    arm = result.fitted.base.model.robot
    recording = load_log(path, arm, robot / "import.toml").recordings[0]
    table = tomllib.loads((robot / "import.toml").read_text())["position"]
    return Run(result, np.array(table.get("offset", [0.0] * arm.n)), recording)


@cache
def undamaged(data: Path, name: str) -> tuple[Run, FloatArray]:
    """The run of a log as it is, and what its model leaves of it per joint, %."""
    case = cases(data)[name]
    with TemporaryDirectory() as folder:
        run = read(case, case.log, Path(folder))
    return run, left(run, run)


def left(run: Run, clean: Run) -> FloatArray:
    """(n,) what a run's model leaves of the undamaged log's torques, %; infinite where the joints differ."""
    base, robot = run.result.fitted.base, run.result.fitted.base.model.robot
    other = clean.result.fitted.base.model.robot
    if [joint.name for joint in robot.joint] != [joint.name for joint in other.joint]:
        return np.full(other.n, np.inf)
    torque = other.joint_torque(clean.recording.control_signal)
    moved = replace(
        clean.recording,
        position=clean.recording.position + run.offset - clean.offset,
        control_signal=robot.control_signal(torque),
    )
    stacked = stack(observe(base, (moved,), other.identification))
    residual = stacked.split(stacked.y - stacked.x @ run.result.fitted.result.recommended.values)
    parts = zip(residual, stacked.split(stacked.y), strict=True)
    return np.array([100 * np.linalg.norm(e) / np.linalg.norm(y) for e, y in parts])


def judged(data: Path, name: str, seed: int) -> dict[str, object]:
    """One damage of one log."""
    case, lot = cases(data)[name], np.random.default_rng([seed, len(name), ord(name[0])])
    damage = DAMAGES[seed % len(DAMAGES)]
    log = damage(case.log, lot)
    row: dict[str, object] = {"log": name, "seed": seed, "damage": damage.__name__, "said": log.said}
    clean, usual = undamaged(data, name)
    begin = time.monotonic()
    try:
        with TemporaryDirectory() as folder:
            run = read(case, log, Path(folder))
    except UserError as error:
        return row | {"outcome": "refused", "message": str(error)}
    except Exception:  # noqa: BLE001  # what the benchmark counts
        return row | {"outcome": "traceback", "message": traceback.format_exc(limit=-3)}
    found = left(run, clean)
    new = sorted(run.warnings - clean.warnings)
    right = bool((found <= WORSE * usual).all())
    named = not right and damage in OF_SCALE and run.names(found > WORSE * usual)
    warned = bool(new) or named or not run.result.fitted.result.trusted
    outcome = "right" if right and not warned else "warned" if warned else "wrong"
    own = run.result.fitted.result.recommended.relative_error_percent_per_joint
    return row | {
        "outcome": outcome,
        "right": right,
        "message": "; ".join(new) or ("its joints are named" if named else ""),
        "left": [round(float(x), 1) for x in found],
        "usual": [round(float(x), 1) for x in usual],
        "own": [round(float(x), 1) for x in own],
        "seconds": round(time.monotonic() - begin, 1),
    }


def table(rows: list[dict[str, object]]) -> str:
    """Outcomes by damage."""
    heads = ("refused", "warned", "right", "wrong", "traceback")
    counts = Counter((row["damage"], row["outcome"]) for row in rows)
    good = Counter(row["damage"] for row in rows if row["outcome"] == "warned" and row["right"])
    lines = [
        "| damage | refused | warned (of these right) | right | wrong | traceback |",
        "|---|---|---|---|---|---|",
    ]
    for damage in sorted({str(row["damage"]) for row in rows}):
        cells = [str(counts[damage, head]) for head in heads]
        cells[1] += f" ({good[damage]})"
        lines.append(f"| {damage.replace('_', ' ')} | {' | '.join(cells)} |")
    total = Counter(row["outcome"] for row in rows)
    cells = [str(total[head]) for head in heads]
    cells[1] += f" ({sum(good.values())})"
    return "\n".join([*lines, f"| all | {' | '.join(cells)} |"])


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with kr300, emps and tx40")
    parser.add_argument("--logs", nargs="+", default=["kr300", "emps", "tx40"])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, help="one JSON line per run")
    given = parser.parse_args()
    rows = []
    for seed in range(given.first, given.first + given.seeds):
        for name in given.logs:
            rows.append(judged(given.data, name, seed))
            if given.out is not None:
                with given.out.open("a") as file:
                    file.write(json.dumps(rows[-1], default=float) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
