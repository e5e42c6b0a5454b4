"""Is a departure of simulated from measured columns systematic? A randomisation test by blocks of time.

V = X − Z is noise through derivatives, filters and the model's own functions of the motion: its rows are
correlated along time, each column in its own way, larger where the motion is faster, and common to several
columns. Under the null it has no direction: the sign of all of it may be turned in any block of time (Canay,
Romano and Shaikh 2017). So nothing has to be modelled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.arrays import FloatArray, IntArray

_BLOCKS = 16
"""Blocks of a record; long beside the memory of its noise, and 2¹⁵ patterns of signs are enough."""

_FLIPS = 999
_SEED = 0


@dataclass(frozen=True)
class SignFlips:
    """p-values of the randomisation.

    Attributes:
        columns: (k,) of each column on its own.
        joint: of all columns together.
        statistic: mean over the columns of the share of V that the instruments explain.
        flips: patterns of signs that were drawn.
    """

    columns: FloatArray
    joint: float
    statistic: float
    flips: int


def sign_flip_test(v: FloatArray, z: FloatArray, segment: IntArray) -> SignFlips:
    """Do the instruments explain more of V than they do of V with signs turned at random?

    Args:
        v: samples × joints × k, X − Z weighted by Ω; zero where a row is left out.
        z: samples × joints × b, weighted in the same way.
        segment: (samples,) recordings; no block reaches across two.
    """
    size = np.sqrt(np.sum(v**2, axis=(0, 1)))
    unit = v / size
    joints, b = z.shape[1:]
    flat = z.reshape(-1, b)
    basis, _ = np.linalg.qr(flat / np.linalg.norm(flat, axis=0))
    basis = basis.reshape(-1, joints, b)
    sums = np.stack(
        [basis[block].reshape(-1, b).T @ unit[block].reshape(-1, v.shape[2]) for block in _blocks(segment)]
    )
    signs = np.random.default_rng(_SEED).choice([-1.0, 1.0], size=(_FLIPS, sums.shape[0]))
    turned = signs @ sums.reshape(sums.shape[0], -1)
    shares = np.sum(turned.reshape(_FLIPS, b, -1) ** 2, axis=1)
    found = np.sum(sums.sum(axis=0) ** 2, axis=0)
    columns = (1.0 + np.sum(shares >= found, axis=0)) / (_FLIPS + 1.0)
    joint = (1.0 + np.sum(shares.sum(axis=1) >= found.sum())) / (_FLIPS + 1.0)
    return SignFlips(columns, float(joint), float(found.mean()), _FLIPS)


def _blocks(segment: IntArray) -> list[IntArray]:
    """Indices of about as many equal blocks as are wanted, at least one for each recording."""
    names = np.unique(segment)
    blocks: list[IntArray] = []
    for name in names:
        index = np.flatnonzero(segment == name)
        count = max(1, round(_BLOCKS * index.size / segment.size))
        blocks += np.array_split(index, count)
    return blocks
