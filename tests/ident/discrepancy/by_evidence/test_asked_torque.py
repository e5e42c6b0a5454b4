"""A drive at its limit, of the simulated bench: rows hold what it lacks, corners and all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.effects.motor import Saturation
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import Recording, RegressorModel
from ident.discrepancy.by_evidence.evidence.noise import Noise
from ident.discrepancy.by_evidence.evidence.prepared import prepare, settings_for
from ident.discrepancy.by_evidence.evidence.rows import Known, Rows
from ident.effects.entry import EffectEntry
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import effect_from
from ident.parameters.base import base_parameters
from ident.parameters.present import Present
from robots import Robot

ROBOT = robots.load("emps")
LIMIT = 1.5
"""Of the control signal; the motion asks for more on a third of its way."""


def recorded() -> Recording:
    truth = replace(draw_truth(ROBOT, 3), torque_noise=(0.0,), encoder_noise=(0.0,))
    scenario = Scenario(saturation=(Saturation(drive=1, limit=LIMIT),))
    run = simulate_offline(ROBOT, truth, exercise(ROBOT, duration=8.0), scenario=scenario, periods=3, seed=1)
    return Recording("limited", run.time, run.reference, run.position, run.control_signal)


def saturation(robot: Robot) -> PlacedEffect:
    """The effect that is there, of an arm with the described parameters."""
    model = RegressorModel.of(robot)
    shape = {"torque_limit": LIMIT * abs(ROBOT.gains[0])}
    return effect_from(robot, EffectEntry("saturation", (1,), shape), Present(model, model.prior()))


def test_a_drive_at_its_limit_lacks_what_it_is_asked_for_beyond() -> None:
    """Of all that it lacks 0.4 %, with the parameters that least squares gives; of a filtered signal 1.4."""
    recording = recorded()
    robot = settings_for(ROBOT, recording)
    (part,) = prepare(robot, (recording,)).parts
    base = base_parameters(RegressorModel.of(robot))
    lacks = part.columns(saturation(robot))[:, 0]
    used, columns = part.used[:, 0], np.concatenate([base.columns(part.at_rows)[:, 0], lacks], axis=1)
    factors = np.linalg.lstsq(columns[used], part.torque[used, 0], rcond=None)[0]
    left = part.torque[used, 0] - columns[used] @ factors
    assert float(np.std(left)) < 0.008 * float(np.std(lacks[used]))


def test_rows_are_left_open_where_the_drive_lacks_more_than_noise() -> None:
    """What a filter leaves of a corner some rows on leaves none open."""
    recording, deviation = recorded(), 0.5
    robot = settings_for(ROBOT, recording)
    prepared = prepare(robot, (recording,))
    count = prepared.torque.shape[0]
    none = Known(np.zeros((count, 1, 1)), np.ones(1), prepared.torque)
    rows = Rows(prepared, none, (np.zeros((count, 1)),), (Noise(np.zeros(0), deviation),))
    lacks = prepared.parts[0].columns(saturation(robot))[:, 0, 0]
    open_rows = (np.abs(lacks) > deviation) & prepared.used[:, 0]
    largest = np.abs(prepared.torque[open_rows]).max()
    assert 1.5 * open_rows.sum() < (prepared.used[:, 0] & (lacks != 0.0)).sum()
    nats = float(open_rows.sum() * np.log(largest / deviation))
    assert rows.effect(saturation(robot)).unsaid == pytest.approx(nats, rel=0.02)
