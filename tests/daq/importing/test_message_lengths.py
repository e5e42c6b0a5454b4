"""Refusals and guesses of logs with names of any length and number are a few lines of a terminal at most."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest

from daq.identification.identify import IdentifyRequest, run_identify
from daq.importing.guess_log import GuessRequest
from daq.text.progress import Silent
from robots.arrays import FloatArray
from robots.errors import UserError
from tests.daq.importing.test_guess_log import URDF

LONGEST = 160
"""Characters: two lines of a terminal of 80 columns, beside the path that the user gave."""
NAME = "x" * 4000
T = 0.01 * np.arange(600)
Q = 0.3 * np.sin(np.outer(T, np.arange(1, 7)))
TAU = 3.0 * Q + 0.01 * np.random.default_rng(1).standard_normal(Q.shape)
Columns = dict[str, FloatArray]


def arm(position: FloatArray, torque: FloatArray) -> Columns:
    joints = range(6)
    columns = {"t": T, **{f"pos_{NAME}_{k}": position[:, k] for k in joints}}
    return {**columns, **{f"tau_{NAME}_{k}": torque[:, k] for k in joints}}


def drawn(seed: int) -> Columns:
    """Names of any length and words, values of any size: a log that nobody has."""
    lot = np.random.default_rng(seed)
    words = ["pos", "q", "tau", "t", "time", "vel", "ref", "temp", "é", "joint", NAME]
    names = ["_".join(lot.choice(words, lot.integers(1, 4))) + str(k) for k in range(lot.integers(2, 40))]
    return {name: lot.choice([T, Q[:, 0], TAU[:, 3], 0 * T, 1e9 * Q[:, 1]]) for name in names}


CASES = {
    "three clocks": {f"{NAME}{k}": T for k in range(3)},
    "many columns": {f"sensor_value_number_{k}": T * k for k in range(800)},
    "no torque": {"t": T, **{f"pos_{NAME}_{k}": Q[:, k] for k in range(6)}, f"other_{NAME}": Q[:, 1]},
    "far beyond": arm(1e5 * Q, TAU),
    "not numbers": arm(np.where(T[:, np.newaxis] > 3.0, np.nan, Q), TAU),
    "an arm": arm(Q, TAU),
    **{f"drawn {seed}": drawn(seed) for seed in range(12)},
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_no_message_is_as_long_as_its_log(tmp_path: Path, case: str, suffix: str) -> None:
    path, columns = tmp_path / f"log{suffix}", CASES[case]
    if suffix == ".csv":
        table = np.column_stack(list(columns.values()))
        np.savetxt(
            path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g", encoding="utf-8"
        )
    else:
        np.savez(path, **{f"{zlib.crc32(name.encode())}_{name}": v for name, v in columns.items()})
    try:
        result = run_identify(IdentifyRequest((path,), guess=GuessRequest(URDF)), Silent())
        said = [*result.guessed, *result.fitted.result.warnings]
    except UserError as error:
        said = [str(error).replace(str(tmp_path), "")]
    assert max(map(len, said)) <= LONGEST, max(said, key=len)[:600]
