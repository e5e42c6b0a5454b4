"""The truth: drawn from a seed within its spread, and kept without loss as JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

import robots
from drivers.simulated import PlantTruth, draw_truth, nominal_truth
from robots import Robot, drive_parameter_names, link_parameter_names


def test_names_are_the_standard_ones(truth: PlantTruth) -> None:
    assert set(truth.parameters) == {*link_parameter_names(6), *drive_parameter_names(6)}


def test_json_keeps_every_bit(truth: PlantTruth) -> None:
    assert PlantTruth.from_dict(json.loads(json.dumps(truth.as_dict()))) == truth


def test_a_seed_is_an_arm(tx40: Robot) -> None:
    assert draw_truth(tx40, 7) == draw_truth(tx40, 7)
    assert draw_truth(tx40, 7).parameters != draw_truth(tx40, 8).parameters


@pytest.mark.parametrize("seed", range(10))
def test_the_draw_stays_within_its_spread(tx40: Robot, seed: int) -> None:
    drawn, nominal = draw_truth(tx40, seed), nominal_truth(tx40)
    for prefix, spread in {"M": 0.1, "Ia": 0.1, "Fv": 0.2, "Fc": 0.2}.items():
        ratio = drawn.per_drive(prefix) / nominal.per_drive(prefix)
        assert (np.abs(ratio - 1) <= spread + 1e-12).all()
        assert (ratio != 1).all()
    assert (np.abs(drawn.per_drive("off")) < 0.03 * tx40.torque_limits).all()


def test_the_nominal_arm_is_the_description(tx40: Robot) -> None:
    nominal = nominal_truth(tx40)
    assert nominal.per_drive("Ia").tolist() == [drive.dynamics.inertia for drive in tx40.drive]
    model = robots.rigid_body_model(tx40)
    assert nominal.link(2) == pytest.approx(model.inertias[2].toDynamicParameters())


def test_encoder_noise_of_an_unknown_arm_is_half_a_count(emps: Robot) -> None:
    drawn = draw_truth(emps, 0)
    assert np.array(drawn.encoder_noise) * np.abs(emps.counts_per_output_unit) == pytest.approx([0.5])
