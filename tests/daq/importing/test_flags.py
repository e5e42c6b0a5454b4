"""Samples that a flag of the log says to be none are neither fitted nor looked at, and that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.importing.guess_log import guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from daq.importing.loaded import LoadedRecordings
from daq.recording.errors import CaptureError
from ident import identify
from robots import Robot
from robots.arrays import BoolArray
from tests.daq.importing.published_logs import EMPS_URDF

ROWS, PERIOD = 6000, 0.002
BAD = np.zeros(ROWS, dtype=bool)
BAD[1500:1505] = BAD[3000:3100] = BAD[4500] = True
STANDS_THERE = {"held": None, "0": 0.0, "far off": 99.0, "no number": np.nan, "huge": 1e300}


def loaded(
    folder: Path, stands_there: float | None, bad: BoolArray, flag: str
) -> tuple[Robot, LoadedRecordings]:
    """A sliding axis with friction, 12 s at 500 Hz; what stands in bad rows is flagged or not."""
    noise = np.random.default_rng(11)
    t = PERIOD * np.arange(ROWS)
    q = 0.1 + 0.05 * np.sin(2.0 * t) + 0.02 * np.sin(7.0 * t + 1.0)
    v = 0.1 * np.cos(2.0 * t) + 0.14 * np.cos(7.0 * t + 1.0)
    a = -0.2 * np.sin(2.0 * t) - 0.98 * np.sin(7.0 * t + 1.0)
    force = 95.0 * a + 200.0 * v + 20.0 * np.sign(v) + 0.2 * noise.standard_normal(ROWS)
    table = np.column_stack([t, q + 1e-7 * noise.standard_normal(ROWS), force, ~bad])
    before = np.maximum.accumulate(np.where(bad, 0, np.arange(ROWS)))
    table[:, 1:3] = table[before, 1:3] if stands_there is None else table[:, 1:3]
    table[bad, 1:3] = table[bad, 1:3] if stands_there is None else stands_there
    folder.mkdir()
    log = folder / "log.csv"
    np.savetxt(log, table, delimiter=",", header=f"t,q1,tau1,{flag}", comments="")
    guess = guess_log(log, EMPS_URDF, folder, LogHints())
    assert guess.columns.get("complete") == ({"columns": [flag]} if flag == "complete" else None)
    return guess.robot, load_recording(log, guess.robot)


def fitted(robot: Robot, log: LoadedRecordings) -> dict[str, float]:
    return {p.name: p.value for p in identify(robot, log.recordings).result.least_squares.parameters}


@pytest.mark.parametrize("case", STANDS_THERE)
def test_what_stands_in_flagged_rows_changes_nothing(tmp_path: Path, case: str) -> None:
    """Neither in the guesses of units and limits, nor in the fit; the answer is that of the other rows."""
    robot, log = loaded(tmp_path / "log", STANDS_THERE[case], BAD, "complete")
    assert [len(piece.time) for piece in log.recordings] == [1500, 1495, 1400, 1499]
    (said,) = log.warnings
    assert (
        "106 of 6000 samples are flagged as not complete (first at 3 s): not used, and the log is cut" in said
    )
    values = fitted(robot, log)
    assert values["M1R"] == pytest.approx(95.0, rel=0.01)
    assert values["Fv1"] == pytest.approx(200.0, rel=0.02)
    assert values["Fc1"] == pytest.approx(20.0, rel=0.03)
    other_robot, other = loaded(tmp_path / "other", 0.05, BAD, "complete")
    assert values == fitted(other_robot, other)


def test_without_the_flag_the_same_rows_would_count(tmp_path: Path) -> None:
    """So that the tests above can fail."""
    robot, log = loaded(tmp_path / "log", 0.05, BAD, "number")
    assert abs(fitted(robot, log)["M1R"] / 95.0 - 1.0) > 0.05


def test_a_log_without_a_flagged_row_is_not_cut(tmp_path: Path) -> None:
    _, log = loaded(tmp_path / "log", 0.0, np.zeros(ROWS, dtype=bool), "complete")
    assert [len(piece.time) for piece in log.recordings] == [ROWS]
    assert log.warnings == ()


def test_flags_everywhere_are_refused_with_a_remedy(tmp_path: Path) -> None:
    every = np.arange(ROWS) % 500 == 250
    with pytest.raises(CaptureError, match="pieces of at least 2 s; rows that are taken out of"):
        loaded(tmp_path / "log", 0.0, every, "complete")
