"""Zeros of axes are moved where one turn alone mends the torque, and said where several do as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from daq.importing.guess_frames import quarter_turns
from daq.importing.proof import TorqueProof
from robots.arrays import FloatArray
from tests.ident.pinocchio_arm import tx40

QUARTER = np.pi / 2


@dataclass
class Errors:
    """A proof whose error is a product: what each turn alone takes of it, 1 where it takes nothing."""

    position: FloatArray
    taken: dict[tuple[int, int], float]
    same: bool
    """Whether one turn alone takes all that there is to take."""

    def error(self, offset: FloatArray) -> float:
        turns = [(j, round(turn / QUARTER)) for j, turn in enumerate(offset) if turn]
        found = [self.taken.get(turn, 1.0) for turn in turns]
        return 0.2 * (min(found, default=1.0) if self.same else float(np.prod(found)))


@pytest.mark.parametrize(
    ("taken", "same", "moved", "said"),
    [
        ({(1, -1): 0.8}, True, {1: -1}, ["moved by -90°, by its torque"]),
        ({(1, -1): 0.8, (1, 1): 0.95}, True, {1: -1}, ["moved by -90°, by its torque"]),
        ({(1, -1): 0.8, (3, 1): 0.85}, False, {1: -1, 3: 1}, ["moved by -90°", "moved by 90°"]),
        (
            {(3, 1): 0.80, (3, -1): 0.85},
            True,
            {},
            ["off by 90°, or by -90°: the torque tells neither"],
        ),
        ({(3, 1): 0.80, (1, -1): 0.85}, True, {}, ["may be off by 90°, or that of joint_2 by -90°"]),
        ({(3, 1): 0.99}, True, {}, []),
    ],
)
def test_a_zero_is_moved_where_one_turn_alone_mends_it(
    taken: dict[tuple[int, int], float], same: bool, moved: dict[int, int], said: list[str]
) -> None:
    robot = tx40()
    proof = Errors(np.zeros((3, robot.n)), taken, same)
    offset, words = quarter_turns(robot, cast("TorqueProof", proof))
    assert {j: round(turn / QUARTER) for j, turn in enumerate(offset) if turn} == moved
    assert len(words) == len(said)
    assert all(part in sentence for part, sentence in zip(said, words, strict=True))
