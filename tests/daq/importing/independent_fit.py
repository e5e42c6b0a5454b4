"""Least squares of an arm's torques that shares nothing with armhil but Pinocchio's regressor.

Known gear ratios, zeros and coupling; SciPy's filter, differences of NumPy, rows by plain slicing, one weight
per joint from a first fit. What it leaves per joint is what armhil's guesses have to come near.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio
from numpy.typing import NDArray
from scipy.signal import butter, decimate, filtfilt

Array = NDArray[np.float64]
_FACTOR = 12
"""By which SciPy's filter decimates at most; what is above is sliced, the torque is smooth there."""


def percent_left(
    urdf: Path,
    position: Array,
    torque: Array,
    period: float,
    cutoff: float,
    step: int,
    coupled: bool = False,
    filtered: bool = False,
) -> Array:
    """(n,) 100·‖τ − Xβ̂‖/‖τ‖ per joint.

    Args:
        urdf: of the arm.
        position, torque: samples × n at the joints, rad or m and N·m or N.
        period: s.
        cutoff: Hz, of positions and torques.
        step: one row in so many samples.
        coupled: motor 6 turns with joints 5 and 6, and has friction and inertia of its own.
        filtered: rows are decimated by SciPy's filter of both sides, which takes noise off torques.
    """
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data, n = model.createData(), model.nv
    top, bottom = butter(4, cutoff * 2 * period)
    q, tau = (filtfilt(top, bottom, values, axis=0) for values in (position, torque))
    v = np.gradient(q, period, axis=0)
    a = np.gradient(v, period, axis=0)
    fine = max(1, step // _FACTOR) if filtered else step
    rows = range(50, len(q) - 50, fine)
    blocks = []
    for k in rows:
        links = np.reshape(pinocchio.computeJointTorqueRegressor(model, data, q[k], v[k], a[k]), (n, -1))
        drives = [np.diag(x) for x in (a[k], v[k], np.sign(v[k]), np.ones(n))]
        if coupled:
            motor = np.zeros((n, 4))
            speed, acceleration = v[k, 4] + v[k, 5], a[k, 4] + a[k, 5]
            motor[4:] = [acceleration, speed, np.sign(speed), 0.0]
            drives.append(motor)
        blocks.append(np.hstack([links, *drives]))
    x, y = np.stack(blocks), tau[list(rows)]
    if filtered:
        x, y = (decimate(part, step // fine, ftype="fir", axis=0)[2:-2] for part in (x, y))
    weight = np.ones(n)
    for _ in range(2):
        flat = (x / weight[:, np.newaxis]).reshape(-1, x.shape[2])
        scale = np.linalg.norm(flat, axis=0) + 1e-300
        beta = np.linalg.lstsq(flat / scale, (y / weight).ravel(), rcond=1e-9)[0] / scale
        left = y - x @ beta
        weight = left.std(axis=0)
    return np.asarray(100 * np.linalg.norm(left, axis=0) / np.linalg.norm(y, axis=0))
