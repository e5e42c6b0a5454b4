"""Drive gains from a known payload: on the simulated bench, and on rows whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from drivers.simulated import PlantTruth, draw_truth, simulate_offline
from ident import (
    BaseParameters,
    IdentificationError,
    Recording,
    RegressorModel,
    base_parameters,
    drive_parameters,
)
from ident.identification.drive_gain import GainFit, drive_gains_of_rows, identify_drive_gains
from ident.parameters.base import random_states
from ident.preparation.observation import Rows
from robots import Robot
from robots.payload import Payload
from robots.standard import link_parameter_names

PAYLOAD = Payload(2.0, (0.03, -0.02, 0.10), (0.004, 0.0, 0.005, 0.0, 0.0, 0.003))
CHANGES = np.array([0.03, -0.04, 0.05, -0.03, 0.06, -0.05])


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def base(tx40: Robot) -> BaseParameters:
    robot = tx40.model_copy(
        update={"identification": tx40.identification.model_copy(update={"covariance": "block"})}
    )
    return base_parameters(RegressorModel.of(robot))


# The bench


def motion(robot: Robot, seed: int, duration: float) -> np.ndarray:
    """A sum of sines about home, within the limits, from rest to rest."""
    generator = np.random.default_rng(seed)
    t = np.arange(0.0, duration, robot.bus.cycle_time)
    share = np.clip(np.minimum(t, t[-1] - t), 0.0, 1.0)
    window = share**3 * (10 - 15 * share + 6 * share**2)
    frequency = np.array([0.2, 0.4, 0.7, 1.0])
    reference = np.empty((t.size, robot.n))
    for joint, home in enumerate(robot.home):
        size = generator.uniform(0.3, 1.0, 4) / frequency**0.7
        phase = 2 * np.pi * (np.outer(t, frequency * (1 + 0.1 * joint)) + generator.uniform(0, 1, 4))
        way = np.sin(phase) @ size
        way *= 0.55 * min(home - robot.lower[joint], robot.upper[joint] - home) / np.abs(way).max()
        speed = np.gradient(way, t)
        fast = np.abs(speed).max() / robot.velocity_limits[joint]
        hard = np.abs(np.gradient(speed, t)).max() / robot.acceleration_limits[joint]
        reference[:, joint] = home + window * way * min(1.0, 0.8 / fast, 0.7 / hard)
    return reference


def record(robot: Robot, truth: PlantTruth, seed: int) -> Recording:
    run = simulate_offline(robot, truth, motion(robot, seed, 9.0))
    return Recording(f"seed {seed}", run.time, run.reference, run.position, run.control_signal)


def carrying(truth: PlantTruth, robot: Robot, payload: Payload) -> PlantTruth:
    names = link_parameter_names(robot.n)
    added = dict(zip(names, payload.parameters(robot), strict=True))
    return replace(
        truth, parameters={n: v + float(added.get(n, 0.0)) for n, v in truth.parameters.items()}, seed=77
    )


@pytest.fixture(scope="module")
def bench(tx40: Robot) -> GainFit:
    truth = replace(draw_truth(tx40, 5), gain=tuple((tx40.gains * (1 + CHANGES)).tolist()))
    loaded = carrying(truth, tx40, PAYLOAD)
    captures = record(tx40, truth, 1), record(tx40, loaded, 2)
    base = base_parameters(RegressorModel.of(tx40))  # with the arm's own covariance, that of AR errors
    return identify_drive_gains(base, captures[:1], captures[1:], PAYLOAD)


def test_the_benchs_gains_are_found_within_three_sigma(bench: GainFit, tx40: Robot) -> None:
    truth = tx40.gains * (1 + CHANGES)
    off = np.array([(g.value - t) / g.sigma for g, t in zip(bench.gains, truth, strict=True)])
    assert np.abs(off).max() < 3.0
    assert max(g.relative_sigma for g in bench.gains) < 0.01
    # What the description says is farther off than that.
    assert all(abs(g.change) > 5 * g.relative_sigma for g in bench.gains)
    assert all(g.seen for g in bench.gains)
    assert bench.relative_error_percent < 1.0


def test_the_share_of_the_payload_is_told_per_drive(bench: GainFit) -> None:
    share = [g.payload_share for g in bench.gains]
    assert min(share) > 0 and max(share) < 1
    assert share[1] > share[0]  # joint 1 carries no weight: its axis is vertical


# Rows with known errors


@pytest.fixture(scope="module")
def truth(tx40: Robot, base: BaseParameters) -> np.ndarray:
    plant = draw_truth(tx40, 6)
    drives = drive_parameters(tx40, plant.per_drive("Ia"), plant.per_drive("Fv"), plant.per_drive("Fc"))
    return base.regroup({**plant.parameters, **drives})


def rows_of(
    base: BaseParameters, truth: np.ndarray, payload: Payload, seed: int, share: float = 0.02
) -> tuple[Rows, np.ndarray]:
    """Half of the rows loaded; errors of a share of the torque in v_τ. Gains off by CHANGES."""
    robot = base.model.robot
    samples = 300
    columns = base.columns(random_states(robot, 50 + seed, samples))
    loaded = np.arange(samples) >= samples // 2
    shift = np.zeros(base.relation.shape[1])
    shift[:60] = payload.parameters(robot)
    torque = columns @ truth + loaded[:, np.newaxis] * (columns @ (base.relation @ shift))
    drive = np.linalg.solve(robot.transmission_matrix.T, torque.T).T / (1 + CHANGES)
    size = share * np.sqrt(np.mean(drive**2, axis=0))
    drive = drive + size * np.random.default_rng(seed).normal(size=drive.shape)
    none = np.arange(samples, dtype=np.float64)
    used = np.ones(drive.shape, dtype=np.bool_)
    rows = Rows(none, loaded.astype(np.int64), drive @ robot.transmission_matrix, columns, used)
    return rows, loaded


def by_ordinary_least_squares(
    base: BaseParameters, rows: Rows, loaded: np.ndarray, payload: Payload
) -> np.ndarray:
    """g/g⁰ of each drive with the payload's torque on the left and w among the regressors."""
    robot = base.model.robot
    samples, n = rows.torque.shape
    shift = np.zeros(base.relation.shape[1])
    shift[:60] = payload.parameters(robot)
    known = loaded[:, np.newaxis] * (rows.regressor @ (base.relation @ shift))
    drive = np.linalg.solve(robot.transmission_matrix.T, rows.torque.T).T
    signal = np.einsum("sk,kj->sjk", drive, robot.transmission_matrix)
    x = np.concatenate([signal, -rows.regressor], axis=2)
    weight = 1.0 / np.sqrt(np.mean(rows.torque**2, axis=0))
    stacked = (x * weight[:, np.newaxis]).reshape(samples * n, -1)
    return np.linalg.lstsq(stacked, (known * weight).ravel(), rcond=None)[0][:n]


def test_it_has_no_bias_where_ordinary_least_squares_has(base: BaseParameters, truth: np.ndarray) -> None:
    off, ordinary = [], []
    for seed in range(12):
        rows, loaded = rows_of(base, truth, PAYLOAD, seed)
        found = drive_gains_of_rows(base, rows, loaded, PAYLOAD)
        true = base.model.robot.gains * (1 + CHANGES)
        off.append([(g.value - t) / g.sigma for g, t in zip(found.gains, true, strict=True)])
        ordinary.append(by_ordinary_least_squares(base, rows, loaded, PAYLOAD) / (1 + CHANGES) - 1)
    runs = np.array(off)
    assert np.abs(runs.mean(axis=0)).max() < 3.5 / np.sqrt(12)
    assert 0.75 < np.sqrt(np.mean(runs**2)) < 1.25
    bias = np.mean(ordinary, axis=0)
    assert (bias < -4 * np.std(ordinary, axis=0) / np.sqrt(12)).all()
    assert bias.min() < -0.05


def test_a_payload_that_hardly_loads_a_drive_does_not_show_its_gain(
    base: BaseParameters, truth: np.ndarray
) -> None:
    # On the last axis it loads all drives but the last, and a hundredth of it loads none.
    on_axis = Payload(3.0, (0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    rows, loaded = rows_of(base, truth, on_axis, 1)
    found = drive_gains_of_rows(base, rows, loaded, on_axis).gains
    assert [g.seen for g in found] == [True] * 5 + [False]
    assert found[5].payload_share < 1e-9
    assert found[5].sentence().startswith("not seen: known to 2 % by the description")
    assert found[5].sentence().endswith("keep the described gain")
    assert abs(found[5].change) < 3 * found[5].relative_sigma
    light = replace(on_axis, mass=0.03)
    rows, loaded = rows_of(base, truth, light, 1)
    assert not any(g.seen for g in drive_gains_of_rows(base, rows, loaded, light).gains)


def test_a_heavier_payload_makes_every_gain_larger(base: BaseParameters, truth: np.ndarray) -> None:
    rows, loaded = rows_of(base, truth, PAYLOAD, 2)
    heavier = replace(
        PAYLOAD, mass=2.2, inertia=tuple(1.1 * i for i in PAYLOAD.inertia), relative_uncertainty=0.01
    )
    one, other = (drive_gains_of_rows(base, rows, loaded, p) for p in (PAYLOAD, heavier))
    for a, b in zip(one.gains, other.gains, strict=True):
        assert b.value == pytest.approx(1.1 * a.value, rel=1e-3)
        assert b.sigma == pytest.approx(np.hypot(1.1 * a.sigma, 0.01 * b.value), rel=1e-2)


def test_captures_in_the_wrong_place_are_noticed(base: BaseParameters, truth: np.ndarray) -> None:
    rows, loaded = rows_of(base, truth, PAYLOAD, 3)
    with pytest.raises(
        IdentificationError, match=r"would be .* times the described one; are the captures rightly told"
    ):
        drive_gains_of_rows(base, rows, ~loaded, PAYLOAD)


def test_one_kind_of_capture_is_not_enough(base: BaseParameters) -> None:
    with pytest.raises(IdentificationError, match="no capture without the payload"):
        identify_drive_gains(base, (), (None,), PAYLOAD)  # type: ignore[arg-type]


def test_of_the_mass_alone_the_gains_that_it_loads_are_found(
    base: BaseParameters, truth: np.ndarray, tx40: Robot
) -> None:
    rows, loaded = rows_of(base, truth, PAYLOAD, 1)
    fit = drive_gains_of_rows(base, rows, loaded, Payload(PAYLOAD.mass))
    known = drive_gains_of_rows(base, rows, loaded, PAYLOAD)
    true = tx40.gains * (1 + CHANGES)
    off = np.array([(g.value - t) / g.sigma for g, t in zip(fit.gains, true, strict=True)])
    assert np.abs(off).max() < 4.0
    # Mass alone loads shoulder and elbow; the wrist's gains are known by centre and inertia.
    assert all(fit.gains[k].relative_sigma < 0.03 for k in (1, 2))
    assert all(one.sigma >= 0.99 * other.sigma for one, other in zip(fit.gains, known.gains, strict=True))
    assert fit.gains[5].payload_share == 0.0
    assert not fit.gains[5].seen
    assert known.gains[5].seen
