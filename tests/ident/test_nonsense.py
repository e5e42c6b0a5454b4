"""Fits that are none, and torques that no arm makes, are refused; a rotor below zero is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import IdentificationError, Recording
from ident.effects.family import Place, StandardParameter
from ident.identification.summary import not_of_a_rotor, refuse_nothing_explained
from ident.preparation.checks import check_recordings
from ident.results import Estimate, Parameter, Rank

ZZ1 = StandardParameter("ZZ", Place("joint", (0,)), "rigid_body", "kg·m²")
IA3 = StandardParameter("Ia", Place("joint", (2,)), "rotor_inertia", "kg·m²")
PARAMETERS = (
    Parameter("ZZ1R", 3.0, 0.1, "kg·m²", "ZZ1 + Ia1", ZZ1),
    Parameter("Ia3", -0.2, 0.03, "kg·m²", "Ia3", IA3),
)
ESTIMATE = Estimate(
    "iv", PARAMETERS, np.eye(2), "ar", 10.0, 12.0, np.array([12.0]), np.array([1.0]), np.array([0.5]), 3
)
RANK = Rank(structural=4, data=4, smallest=0.1, noise_level=1e-3)


def test_a_fit_that_is_one_is_let_through() -> None:
    refuse_nothing_explained(ESTIMATE, RANK)


@pytest.mark.parametrize(
    ("estimate", "rank", "message"),
    [
        (replace(ESTIMATE, relative_error_percent=175.0), RANK, "leaves 175 % of the torque"),
        (ESTIMATE, replace(RANK, data=0), "shows none of 4 parameters"),
        (
            replace(ESTIMATE, parameters=(replace(PARAMETERS[0], sigma=0.0),)),
            RANK,
            r"ZZ1R comes out without any error \(σ 0\)",
        ),
    ],
    ids=["error above all", "rank 0", "sigma 0"],
)
def test_a_fit_that_is_none_is_refused(estimate: Estimate, rank: Rank, message: str) -> None:
    with pytest.raises(IdentificationError, match=message):
        refuse_nothing_explained(estimate, rank)


def test_a_rotor_below_zero_is_said_beyond_three_deviations() -> None:
    said = "rotor inertia below zero (Ia3 by 6.67 σ): no rotor has it, so the model lacks something"
    said += ", or the torque is of sensors at the links (--torque-sensors)"
    assert not_of_a_rotor(ESTIMATE) == ((said,), True)
    odd = replace(ESTIMATE, parameters=(replace(PARAMETERS[1], sigma=0.05),))
    assert not_of_a_rotor(odd) == ((said.replace("6.67", "4"),), False)
    by_chance = replace(ESTIMATE, parameters=(replace(PARAMETERS[1], sigma=0.1),))
    assert not_of_a_rotor(by_chance) == ((), False)


def test_a_signal_a_thousand_times_too_large_is_refused() -> None:
    emps = robots.load("emps")
    time = np.arange(2000) * 1e-3
    position = 0.1 * np.sin(2 * np.pi * time)[:, np.newaxis]
    signal = 2.0 * np.cos(2 * np.pi * time)[:, np.newaxis] + 0.3 * np.random.default_rng(0).standard_normal(
        (2000, 1)
    )
    check_recordings(emps, (Recording("log", time, None, position, signal),))
    with pytest.raises(IdentificationError, match=r"joint 1's torque reaches .* times its limit 351\.5"):
        check_recordings(emps, (Recording("log", time, None, position, 1000 * signal),))
