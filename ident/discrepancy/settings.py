"""Settings of the search that are not the arm's."""

from __future__ import annotations

from ident.recording import Recording
from robots.description import Robot

ROW_RATE = 125.0
"""Hz. Rows are kept close together: a decimation filter spreads each reversal over its neighbours."""

_ACCURACY = 8
"""Order of the derivatives: a lower one takes a part off the accelerations of a ripple."""

MINIMUM_SPEED = 0.01
STANDSTILL_MARGIN = 0.04
"""s on both sides of a standstill; enough where rows are not decimated."""


def searching(robot: Robot, recording: Recording) -> Robot:
    """The arm with the identification settings that the search wants for a recording."""
    rate = 1.0 / recording.sample_time
    changed = {
        "decimation": max(1, int(rate / ROW_RATE + 1e-6)),
        "derivative_accuracy": max(robot.identification.derivative_accuracy, _ACCURACY),
        "decimation_filter": "fir",  # a Chebyshev filter rings for long after a reversal
        "minimum_speed": max(robot.identification.minimum_speed, MINIMUM_SPEED),
        "standstill_margin": STANDSTILL_MARGIN,
    }
    return robot.model_copy(update={"identification": robot.identification.model_copy(update=changed)})
