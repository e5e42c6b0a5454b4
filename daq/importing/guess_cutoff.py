"""A cut-off that the motion alone proposes, tried on torque that is not fitted.

Five times the bandwidth of the motion leaves the positions as they are. Products of speeds, and bodies that
swing, make torque that is faster: an arm of four axes that moves at 1 Hz lost 3 % of its torque at 5 Hz and
0.3 % at 20 Hz. Each half of the log is foretold by the other, as of every proposed cut-off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import Sampled
from ident import Recording
from ident.errors import IdentificationError
from ident.identification.tried_cutoff import left_of_halves
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots import Robot
from robots.arrays import FloatArray

_BETTER = 0.9
"""Times what is left: a higher cut-off that leaves more than this is not worth its noise."""
_FORETOLD = 0.5
"""Share of the torque left beyond which halves do not foretell each other, so that nothing is told."""
_TIMES = (1.0, 2.0, 4.0)
_MOST = 100_000
"""Samples of the middle of a log that are tried."""
_LARGEST = 0.4
"""Of the sampling rate."""


def raised_cutoff(
    robot: Robot, log: Sampled, torque: Channels, means: dict[str, Any], offset: FloatArray
) -> tuple[float, list[str]]:
    """Times the proposed cut-off that leaves clearly less, 1 where none does; and a sentence where one does.

    Args:
        robot: with the proposed cut-off.
        log: positions of the joints.
        torque: what was measured.
        means: what the column map says of it.
        offset: (n,) of the positions.
    """
    factor = np.array(means.get("ratio") or means.get("gain") or np.ones(robot.n))
    begin = max(0, (len(log.grid) - _MOST) // 2)
    part = slice(begin, begin + _MOST)
    logged = log.even(torque.values[:, log.moving])[part] * factor
    if not np.isfinite(logged).all():
        return 1.0, []  # which loading the log refuses
    at_drives = means.get("side") in ("motor", "current")
    signal = logged / robot.gains if at_drives else robot.control_signal(logged)
    recording = Recording(log.name, log.grid[part], None, log.position[part] + offset, signal)
    base, proposed = base_parameters(RegressorModel.of(robot)), robot.identification.cutoff_hz
    left: list[float] = []
    for times in _TIMES:
        hz = times * proposed
        if hz * log.period > _LARGEST:
            break
        try:
            left.append(left_of_halves(base, (recording,), hz))
        except IdentificationError:  # too short for the filter or for the parameters
            break
        if left[-1] > (_BETTER * left[-2] if len(left) > 1 else _FORETOLD):
            left.pop()
            break
    if len(left) < 2:
        return 1.0, []
    times = _TIMES[len(left) - 1]
    return times, [
        f"cut-off: {times * proposed:.3g} Hz, leaving {100 * left[-1]:.2g} % of torque that was not fitted;"
        f" {proposed:.3g} Hz, five times the motion's bandwidth, left {100 * left[0]:.2g} %"
    ]
