"""The rate of a torque, of which the column of a lag is made: of a wrong one a delay stands in its place."""

from __future__ import annotations

import numpy as np
import pytest

from ident.effects import State
from ident.effects.placed import rate

STEP = 0.004
"""s, at which effects are evaluated by the search by evidence."""


@pytest.mark.parametrize(("hz", "error"), [(5.0, 1e-5), (28.0, 2e-3), (45.0, 2e-2)])
def test_a_rate_is_that_of_the_tone_up_to_the_cut_off(hz: float, error: float) -> None:
    """Central differences lack 8 % at 28 Hz and a fifth at 45 Hz."""
    time = np.arange(0.0, 2.0, STEP)
    still, omega = np.zeros((time.size, 1)), 2 * np.pi * hz
    found = rate(np.sin(omega * time)[:, np.newaxis], State(still, still, still, time))[20:-20, 0]
    assert found == pytest.approx(omega * np.cos(omega * time)[20:-20], abs=error * omega)


def test_without_time_there_is_no_rate() -> None:
    still = np.zeros((5, 1))
    assert not rate(np.ones((5, 1)), State(still, still, still)).any()
