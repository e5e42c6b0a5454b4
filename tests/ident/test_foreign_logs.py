"""What a plant that is not ours shows: its clean logs are accepted, and its drives are read as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.evidence.recorded import foreign_log, foreign_robot
from ident import Fitted, identify
from ident.closed_loop.integral_rule import integrates_first
from robots import Robot

CLEAN = ("log_03", "log_06", "clean_prior")


@pytest.fixture(scope="module")
def foreign(shared_data: Path) -> Path:
    data = shared_data / "foreign"
    if not data.is_dir():
        pytest.skip(f"the foreign plant's logs are not here: {data}")
    return data


@pytest.fixture(scope="module")
def robot(foreign: Path, tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return foreign_robot(foreign, tmp_path_factory.mktemp("foreign"))


@pytest.fixture(scope="module", params=CLEAN)
def fitted(request: pytest.FixtureRequest, foreign: Path, robot: Robot) -> Fitted:
    return identify(robot, (foreign_log(foreign, request.param, "fit", seconds=15.0),))


# What stands on whole identifications of the logs is slow together: each takes seconds, and they share them.


@pytest.mark.slow
def test_gate_one_accepts_a_clean_log(fitted: Fitted) -> None:
    gate = fitted.result.test.gates[0]
    failed = [f"{c.column}: {100 * c.size:.2g} %" for c in gate.columns if not c.passed]
    assert gate.passed, failed
    following = [c.size for c in gate.columns if c.column.startswith("following error")]
    assert np.mean(following) < 0.003  # 0.005 to 0.006 as long as the integral was simulated wrong


@pytest.mark.slow
def test_the_lag_is_that_of_the_plant(fitted: Fitted) -> None:
    """Half a hold less half a step of the plant's 20 kHz."""
    signals = fitted.result.signals
    assert signals is not None and signals.estimated_lag is not None and signals.lag_sigma is not None
    assert abs(signals.estimated_lag - 0.000475) < max(4.0 * signals.lag_sigma, 5e-6)


@pytest.mark.slow
def test_most_parameters_lie_within_their_intervals(fitted: Fitted) -> None:
    base = fitted.base
    truth = base.relation @ base.model.prior()
    for fit in (fitted.least_squares, fitted.instrumental):
        assert fit is not None
        away = np.abs(fit.beta - truth) / np.sqrt(np.diag(fit.covariance))
        assert np.mean(away < 1.96) > 0.75
        assert away.max() < 6.0


@pytest.mark.parametrize("name", [*CLEAN, "log_04", "log_08", "log_10"])
def test_the_drives_take_in_the_present_error_first(foreign: Path, robot: Robot, name: str) -> None:
    """u = Kv e + I with I increased by this sample's error already, as the README has it."""
    assert integrates_first(robot, foreign_log(foreign, name, "fit", seconds=30.0))
