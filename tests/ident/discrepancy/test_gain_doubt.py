"""σ of a payload holds the drives' gains: torques by pin, all gains described 15 % too low."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio
import pytest

from ident import Options, Recording, identify
from ident.discrepancy import Diagnosis, Question
from ident.discrepancy.by_evidence import EvidenceAnswer, accepted_prior, diagnose_with_evidence
from ident.discrepancy.gain_doubt import by_each_drive
from ident.discrepancy.prior import Prior
from ident.effects.vocabulary import family_named
from ident.parameters.base import BaseParameters
from robots import Robot
from tests.ident.pinocchio_arm import record, tx40

MASS, OFF, KNOWN = 2.0, 0.15, 0.2
SECONDS = 16.0
BODY = pinocchio.Inertia(MASS, np.array([0.03, -0.02, 0.10]), 0.004 * np.eye(3))


def seen_by(recording: Recording) -> Recording:
    """What a description whose gains are too low by a share makes of it: N·m per unit are fewer."""
    return replace(recording, control_signal=recording.control_signal / (1.0 + OFF))


def known_to(share: float) -> Robot:
    drives = tuple(drive.model_copy(update={"gain_relative_uncertainty": share}) for drive in tx40().drive)
    return tx40().model_copy(update={"drive": drives})


def told(share: float) -> tuple[Diagnosis, EvidenceAnswer]:
    robot = known_to(share)
    before = identify(
        robot, (seen_by(record(1, seconds=SECONDS)),), options=Options(method="ls")
    ).result.least_squares

    def prior(base: BaseParameters) -> Prior:
        return accepted_prior(before.values, before.covariance)

    recordings = [seen_by(record(seed, body=BODY, seconds=SECONDS)) for seed in (2, 3)]
    families = (family_named("payload"),)
    question = Question(robot, (recordings[0],), (recordings[1],), families, prior)
    return diagnose_with_evidence(question)


def masses(share: float) -> list[tuple[float, float]]:
    """M_payload with its σ, as the evidence and as the diagnosis say it."""
    diagnosis, answer = told(share)
    found = [
        *(one.parameters for one in answer.findings if one.placed.name == "payload"),
        *(one.parameters for one in diagnosis.findings if one.effect == "payload"),
    ]
    return [(p.value, p.sigma) for parameters in found for p in parameters if p.name == "M_payload"]


def test_a_mass_is_known_no_better_than_the_gains() -> None:
    found = masses(KNOWN)
    assert len(found) == 2
    for value, sigma in found:
        assert value == pytest.approx(MASS / (1.0 + OFF), rel=0.02)
        # Shoulder and elbow weigh it; of the noise alone σ is 0.02 kg.
        assert KNOWN * value / np.sqrt(3.0) < sigma < 2.0 * KNOWN * value
        assert abs(value - MASS) < 2.0 * sigma


def test_sigma_grows_with_what_is_not_known_of_the_gains() -> None:
    exact, near = (masses(share) for share in (0.0, KNOWN / 4))
    assert len(exact) == len(near) == 2
    for (_, without), (value, sigma) in zip(exact, near, strict=True):
        assert KNOWN / 4 * value / np.sqrt(3.0) < np.sqrt(sigma**2 - without**2) < KNOWN / 2 * value


def test_each_drive_has_its_share_of_a_torque() -> None:
    robot = known_to(KNOWN)
    torque = np.random.default_rng(0).normal(size=(5, robot.n))
    np.testing.assert_allclose(sum(by_each_drive(robot, torque)), KNOWN * torque)
    assert not list(by_each_drive(known_to(0.0), torque))
