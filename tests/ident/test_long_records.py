"""Records of hours are decimated block by block: the rows are those of the whole."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident.effects import State
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation import row_columns


@pytest.mark.parametrize("decimation", [4, 26])
def test_rows_of_blocks_are_those_of_the_whole(monkeypatch: pytest.MonkeyPatch, decimation: int) -> None:
    robot = robots.load("emps")
    base = base_parameters(RegressorModel.of(robot))
    samples = 50_003
    noise = np.random.default_rng(0).standard_normal((3, samples, 1))
    state = State(noise[0], np.cumsum(noise[1], axis=0) / 100, noise[2])
    # White noise, so that each sample counts: of what no low-pass has made slow.
    settings = robot.identification.model_copy(update={"decimation": decimation, "cutoff_hz": 450.0})
    whole = row_columns._columns(base, state, settings, 0.001)
    monkeypatch.setattr(row_columns, "_LONG", 8_000)
    blocks = row_columns._columns(base, state, settings, 0.001)
    assert blocks == pytest.approx(whole, abs=1e-6)
