"""A simulator goes further with the identified arm than with the nominal one; see benchmarks/elsewhere.py."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco", reason="MuJoCo has no wheel for this platform")

from benchmarks.elsewhere import HORIZONS, rollouts


@pytest.mark.slow
def test_rollouts_stay_nearer_to_the_arm_than_those_of_the_nominal_model() -> None:
    result = rollouts(1)  # a development seed: 0.8, 2.8, 16.8 mrad beside 61, 398, 1838
    assert len(result.identified) == len(HORIZONS) == 3
    for identified, nominal in zip(result.identified, result.nominal, strict=True):
        assert identified < 0.1 * nominal
