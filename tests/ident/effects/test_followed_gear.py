"""Links on a gear that rings, brought to what its spring is seen to carry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.effects import State
from ident.effects.elastic_gear import link_inertia
from ident.effects.placed import Placed
from robots.arrays import FloatArray
from tests.ident.effects.test_before_the_record import PERIOD
from tests.ident.effects.test_giving_way import KNOWN, STATE
from tests.ident.effects.test_vocabulary import TX40, placed

DRIVE = 1
COMPLIANCE = 1.0 / (link_inertia(TX40, DRIVE) * (2.0 * np.pi * 9.0) ** 2)


def gear(wrong: float, damping: float, *followed: float) -> Placed:
    return placed("joint_elasticity", DRIVE, COMPLIANCE * wrong, damping, *followed)


def torque(effect: Placed, state: State) -> FloatArray:
    return effect.columns(state)[PERIOD:, :, 0]


def seen(damping: float) -> State:
    """The motion with the torque of an arm on such a gear, as other periods show both."""
    carried = KNOWN.torque(STATE) + gear(1.0, damping).columns(STATE)[:, :, 0]
    return replace(STATE, torque=carried, others=True)


@pytest.mark.parametrize("damping", [0.004, 0.02])
@pytest.mark.parametrize("wrong", [1.02, 1.05])
def test_a_resonance_that_is_a_little_wrong_stays_in_step(wrong: float, damping: float) -> None:
    state, there = seen(damping), torque(gear(1.0, damping), STATE)
    rings, follows = (
        np.linalg.norm(torque(gear(wrong, damping, *more), state) - there) / np.linalg.norm(there)
        for more in ((), (0.2,))
    )
    assert follows < 0.34 * rings
    assert follows < 0.15


def test_the_right_gear_stays_the_right_gear() -> None:
    there = torque(gear(1.0, 0.02), STATE)
    assert np.linalg.norm(torque(gear(1.0, 0.02, 0.2), seen(0.02)) - there) < 0.05 * np.linalg.norm(there)


def test_a_sample_is_not_explained_by_its_own_torque() -> None:
    """Where nothing repeats its noise would be in its column, and a gear of any joint would explain it."""
    own = replace(seen(0.02), others=False)
    assert np.array_equal(torque(gear(1.05, 0.02, 0.2), own), torque(gear(1.05, 0.02), own))


def test_other_periods_are_others_in_each_part_of_them() -> None:
    assert seen(0.02).part(slice(0, None, 2)).others
    assert seen(0.02).with_torque(STATE.position).others
    assert not seen(0.02).moved(STATE.position, STATE.velocity, STATE.acceleration).others
