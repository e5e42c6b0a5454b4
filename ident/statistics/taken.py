"""What weighted least squares take from the errors of each joint: the columns of the weighted basis U.

The rows of a joint know of half the parameters, and U_j, b columns that mix all of them, is of no more. So it
is kept as Q_j·V_jᵀ with orthogonal Q_j and V_j of as many columns as there are directions; what is
computed of U_jU_jᵀ is the same of Q_j.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ident.statistics.symmetric import eigen_of
from ident.statistics.toeplitz import ComplexArray, spectrum, times
from ident.statistics.whitening import Whitening
from robots.arrays import BoolArray, FloatArray, IntArray

DEPENDENT = 1e-12
"""Eigenvalues of the scaled XᵀΩ⁻¹X below this share of the largest are no information."""

_NOTHING = 1e-14
"""Of the squared length of a direction that a joint's rows have no share in: rounding."""


def fit_of(
    omega: Whitening, target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> tuple[FloatArray, Taken]:
    """Weighted least squares: β̂ (b,), and what they take from the errors.

    Args:
        omega: one deviation per joint.
        target, regressor, segment, used: as of :func:`ident.statistics.restricted.regression_whitening`.
    """
    weight = (used / omega.sigma).T
    x = regressor.transpose(2, 1, 0) * weight
    flat = x.reshape(len(x), -1)
    scale = np.sqrt(np.einsum("kr,kr->k", flat, flat))
    scale[scale == 0.0] = 1.0
    flat /= scale[:, np.newaxis]
    values, directions = eigen_of(flat @ flat.T)
    held = values > DEPENDENT * values[-1]
    root = directions[:, held] / np.sqrt(values[held])
    basis = root.T @ flat
    shares = basis @ (target.T * weight).ravel()
    return (root @ shares) / scale, Taken.of(basis.reshape(-1, *weight.shape), segment)


@dataclass(frozen=True)
class Taken:
    """U joint by joint, with its Fourier transforms per recording.

    Attributes:
        columns: Q_j, samples × r_j, time last in memory.
        turns: V_j, b' × r_j.
        pieces: the samples of each recording.
        spectra: of Q_j, frequencies × r_j for each recording.
    """

    columns: tuple[FloatArray, ...]
    turns: tuple[FloatArray, ...]
    pieces: tuple[slice, ...]
    spectra: tuple[tuple[ComplexArray, ...], ...]

    @classmethod
    def of(cls, basis: FloatArray, segment: IntArray) -> Taken:
        """
        Args:
            basis: b' × joints × samples, orthonormal over joints and samples.
            segment: (samples,) recordings.
        """
        ends = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist(), segment.size]
        pieces = tuple(slice(begin, end) for begin, end in pairwise(ends))
        turns = tuple(_directions(basis[:, joint]) for joint in range(basis.shape[1]))
        columns = tuple((turn.T @ basis[:, joint]).T for joint, turn in enumerate(turns))
        spectra = tuple(tuple(spectrum(own[piece]) for piece in pieces) for own in columns)
        return cls(columns, turns, pieces, spectra)

    def from_errors(self, covariance: Callable[[int, int], FloatArray]) -> Iterator[FloatArray]:
        """ΓU_j − ½U_j(UᵀΓU) joint by joint, turned as Q_j is; samples × r_j.

        Its product with Q_jᵀ and the mirror image of that are what Γ has more than the residuals.

        Args:
            covariance: of the weighted errors of a joint (from 0) at so many lags from 0 on.
        """
        moved = [self._moved(joint, covariance) for joint in range(len(self.columns))]
        between = sum(
            turn @ (own.T @ one) @ turn.T
            for turn, own, one in zip(self.turns, self.columns, moved, strict=True)
        )
        for turn, own, one in zip(self.turns, self.columns, moved, strict=True):
            yield one - (own @ (0.5 * turn.T @ between @ turn))

    def _moved(self, joint: int, covariance: Callable[[int, int], FloatArray]) -> FloatArray:
        """ΓQ_j, recording by recording."""
        moved = np.empty_like(self.columns[joint])
        for piece, own in zip(self.pieces, self.spectra[joint], strict=True):
            moved[piece] = times(covariance(joint, piece.stop - piece.start), own)
        return moved


def _directions(basis: FloatArray) -> FloatArray:
    """V, b' × r, of the directions in which the columns b' × samples of a joint are not nothing."""
    values, directions = eigen_of(basis @ basis.T)
    return np.asarray(directions[:, values > _NOTHING])
