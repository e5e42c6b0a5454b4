"""Eigenvalues of a symmetric matrix, also where the quick way to them fails."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray


def eigen_of(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (n,), rising, and eigenvectors (n × n, in columns) of a symmetric matrix.

    LAPACK's divide and conquer, which NumPy takes, now and then gives up on a matrix of low rank, where most
    eigenvalues are zero but for rounding (one log of some thousand). Plain QR steps do not, and are slower.
    """
    try:
        values, vectors = np.linalg.eigh(matrix)
    except np.linalg.LinAlgError:
        from scipy.linalg import eigh  # takes time to load, and is hardly ever needed

        values, vectors = eigh(matrix, driver="ev")
    return np.asarray(values), np.asarray(vectors)
