"""Real data: the Stäubli TX40 log and what was published of it.

The published parameters are in ``published_by_figaroh/TX40_bp_5.csv``: expression, OLS, its %σ, WLS, its %σ.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.importing.load import load_recording
from ident import Estimate, Identification, IdentificationError, Recording, identify
from robots import Robot

# TX40_config.yaml: fv and fs of joints 1 to 5.
PUBLISHED_VISCOUS = [8.05, 5.53, 1.97, 1.11, 1.86]
PUBLISHED_COULOMB = [7.14, 8.26, 6.34, 2.48, 3.03]


@pytest.fixture(scope="module")
def log(shared_data: Path) -> tuple[Robot, Recording]:
    robot = robots.load("tx40")
    loaded = load_recording(shared_data / "tx40", robot)
    return robot.model_copy(update={"identification": loaded.settings}), loaded.recordings[0]


def estimate(log: tuple[Robot, Recording], **changes: object) -> Estimate:
    robot, recording = log
    settings = robot.identification.model_copy(update=changes)
    return identify(robot.model_copy(update={"identification": settings}), (recording,)).result.least_squares


@pytest.fixture(scope="module")
def as_published(log: tuple[Robot, Recording]) -> Identification:
    """With the settings that come with the log."""
    robot, recording = log
    return identify(robot, (recording,)).result


def value(found: Estimate, name: str) -> float:
    return next(p.value for p in found.parameters if p.name == name)


def our_name(expression: str) -> str:
    """The published leading parameter (Izz1, my3, fs4 …) in the paper's notation (ZZ1, MY3, Fc4 …)."""
    leading = expression.split(" ")[0]
    symbol, joint = re.fullmatch(r"([A-Za-z]+)(\d)", leading).groups()  # type: ignore[union-attr]
    other = {"fv": "Fv", "fs": "Fc", "fvm": "Fvm", "fsm": "Fcm", "off": "off", "Ia": "Ia", "Iam": "Iam"}
    return other.get(symbol, symbol.removeprefix("I").upper()) + joint


def test_torque_error_is_far_below_that_of_the_published_fit(
    log: tuple[Robot, Recording], as_published: Identification
) -> None:
    # FIGAROH 1.0.2 reaches 15.4 % on the same log.
    at_500_hz = estimate(log, cutoff_hz=100.0, decimation=10)
    assert round(at_500_hz.relative_error_percent, 3) == 9.028
    at_100_hz = as_published.least_squares
    assert round(at_100_hz.relative_error_percent, 3) == 7.331
    assert at_100_hz.relative_error_percent_per_joint.max() < 16.0


def test_friction_of_joints_1_to_5_is_that_of_the_manufacturer(as_published: Identification) -> None:
    found = as_published.least_squares
    viscous = [value(found, f"Fv{j}") for j in range(1, 6)]
    coulomb = [value(found, f"Fc{j}") for j in range(1, 6)]
    assert viscous == pytest.approx(PUBLISHED_VISCOUS, rel=0.02)
    assert coulomb == pytest.approx(PUBLISHED_COULOMB, rel=0.02)


def test_the_published_base_parameters_are_recovered(log: tuple[Robot, Recording], shared_data: Path) -> None:
    found = estimate(
        log, cutoff_hz=100.0, decimation=100, friction_sign="sign", minimum_speed=0.01, covariance="block"
    )
    ours = {p.name.removesuffix("R"): p for p in found.parameters}
    with (shared_data / "tx40" / "published_by_figaroh" / "TX40_bp_5.csv").open() as file:
        published = {our_name(row[0]): float(row[3]) for row in csv.reader(file)}
    assert len(published) == 60
    assert set(published) <= set(ours)
    distance = [abs(ours[name].value - wls) / ours[name].sigma for name, wls in published.items()]
    assert np.median(distance) <= 0.5


def test_without_a_reference_nothing_is_tested_and_it_says_so(as_published: Identification) -> None:
    result = as_published
    assert result.test.verdict == "not_testable"
    assert "reference" in result.instrumental_reason
    assert result.instrumental is None


def test_a_still_joint_is_named(log: tuple[Robot, Recording]) -> None:
    robot, recording = log
    position = recording.position.copy()
    position[:, 3] = position[0, 3]
    still = Recording("still", recording.time, None, position, recording.control_signal)
    with pytest.raises(IdentificationError, match="4"):
        identify(robot, (still,))
