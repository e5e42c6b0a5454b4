"""What warmth may make of the friction of an arm whose nights are not known yet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.drift.geometry import Geometry
from ident.drift.patterns import Pattern
from ident.drift.values import DriftSettings, Night
from robots.arrays import FloatArray

_WARMTH_MOVES = ("coulomb_friction", "viscous_friction")


def beyond_warmth(
    change: FloatArray,
    baseline: Night,
    tonight: Night,
    geometry: Geometry,
    patterns: Sequence[Pattern],
    settings: DriftSettings,
) -> FloatArray:
    """Change (b,) less what the temperatures may make of each friction parameter of an arm not known yet."""
    kelvin = np.full(geometry.joints, settings.unknown_warmth)
    if baseline.celsius is not None and tonight.celsius is not None:
        kelvin = np.abs(tonight.celsius - baseline.celsius)
    share = settings.friction_per_kelvin * (kelvin + settings.thermometer_sigma)
    left = change.copy()
    for pattern in patterns:
        if pattern.effect in _WARMTH_MOVES and pattern.joint is not None:
            place = int(np.argmax(np.abs(pattern.directions[:, 0])))
            allowed = share[pattern.joint - 1] * abs(geometry.beta[place])
            left[place] -= np.clip(change[place], -allowed, allowed)
    return left
