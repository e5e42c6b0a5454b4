"""Least squares within bounds.

Where the data show every column the answer is that of ``scipy.optimize.lsq_linear``. Where they do not tell
two columns apart, that function's values are huge and opposite; here each then has its share.
"""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

DEPENDENT = 1e-6
"""Of the products of unit columns: below it a direction of the parameters is not seen."""


def within_bounds(columns: FloatArray, residual: FloatArray, bounds: FloatArray) -> FloatArray:
    """Least squares (p,) with each parameter within what nature allows.

    One that would leave its bounds is held at the one it would leave by, and the others are fitted beside it:
    to cut it off afterwards would leave them where they made up for what it must not be.

    Args:
        columns: (N, p).
        residual: (N,).
        bounds: (p, 2), lowest and highest.
    """
    norm = np.linalg.norm(columns, axis=0)
    scale = np.where(norm > 0.0, norm, 1.0)
    values = np.zeros(scale.size)
    # What no row shows stays at nothing: a rounding error of its unit column would be of any size.
    unit, held = columns / scale, norm == 0.0
    while not held.all():
        rest = residual - columns[:, held] @ values[held]
        free = ~held
        values[free] = np.linalg.lstsq(unit[:, free], rest, rcond=np.sqrt(DEPENDENT))[0] / scale[free]
        beyond = np.maximum(bounds[:, 0] - values, values - bounds[:, 1]) * scale
        beyond[held] = 0.0
        worst = int(np.argmax(beyond))
        if beyond[worst] <= 0.0:
            break
        values[worst] = np.clip(values[worst], *bounds[worst])
        held[worst] = True
    return values
