"""What least squares take from the errors, joint by joint, beside the same of whole matrices."""

from __future__ import annotations

import numpy as np

from ident.statistics.restricted import independent_whitening
from ident.statistics.taken import fit_of
from robots.arrays import FloatArray

_SAMPLES, _JOINTS, _COLUMNS = 60, 3, 7


def _covariance(joint: int, lags: int) -> FloatArray:
    return np.asarray((joint + 1.0) * (0.9 - 0.3 * joint) ** np.arange(lags))


def test_a_joint_is_kept_in_as_many_columns_as_it_knows_of_and_loses_what_the_whole_fit_takes() -> None:
    rng = np.random.default_rng(5)
    x = rng.normal(size=(_SAMPLES, _JOINTS, _COLUMNS))
    x[:, 1, :3], x[:, 2, 1:] = 0.0, 0.0
    x[:, 1, 3] *= 1e-4  # hardly seen by this joint, which is not the same as nothing
    target = rng.normal(size=(_SAMPLES, _JOINTS))
    segment = np.repeat([0, 1], [25, 35])
    used = rng.uniform(size=(_SAMPLES, _JOINTS)) > 0.1
    omega = independent_whitening(target, x, segment, used)
    beta, taken = fit_of(omega, target, x, segment, used)

    weight = (used / omega.sigma).T.ravel()
    flat = x.transpose(1, 0, 2).reshape(-1, _COLUMNS) * weight[:, np.newaxis]
    np.testing.assert_allclose(beta, np.linalg.lstsq(flat, target.T.ravel() * weight, rcond=None)[0])
    assert [columns.shape[1] for columns in taken.columns] == [_COLUMNS, _COLUMNS - 3, 1]

    u = np.linalg.qr(flat)[0]
    apart = np.abs(np.subtract.outer(np.arange(_SAMPLES), np.arange(_SAMPLES)))
    together = segment[:, np.newaxis] == segment
    gamma = np.zeros((_JOINTS, _SAMPLES, _JOINTS, _SAMPLES))
    for joint in range(_JOINTS):
        gamma[joint, :, joint] = np.where(together, _covariance(joint, _SAMPLES)[apart], 0.0)
    gamma = gamma.reshape(weight.size, -1)
    lost = u @ (u.T @ gamma) + (gamma @ u) @ u.T - u @ (u.T @ gamma @ u) @ u.T
    for joint, (own, other) in enumerate(zip(taken.columns, taken.from_errors(_covariance), strict=True)):
        part = slice(joint * _SAMPLES, (joint + 1) * _SAMPLES)
        np.testing.assert_allclose(own @ other.T + other @ own.T, lost[part, part], atol=1e-12)
