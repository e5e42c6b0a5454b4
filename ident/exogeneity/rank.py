"""Gate 2 of the revised DWH-test: which columns of V̂ could matter at all?"""

from __future__ import annotations

import numpy as np

from ident.exogeneity.textbook import WhiteRows
from ident.exogeneity.untested import RANK_NULL
from ident.verdicts import ColumnCheck, Gate
from robots.arrays import FloatArray, IntArray

_BIAS_THAT_MATTERS = 0.1
"""The noise floor: a column of V̂ that cannot shift any parameter by this many σ is null."""


def rank_gate(rows: WhiteRows, names: tuple[str, ...]) -> tuple[Gate, IntArray]:
    """QR of [X V̂]; returns the columns of V̂ above the noise floor of the data.

    |R_kk| is what is new in V̂_k. With r rows of errors of unit deviation, whatever their correlation with it,
    it can shift parameter k by at most √r·|R_kk|/‖x_k⊥‖ of its σ (Cauchy-Schwarz), x_k⊥ being the part of x_k
    that the other columns do not hold. Below a tenth of a σ no test could matter: the column is null. The
    columns are pivoted by how far they are above their floors, so the answer does not depend on their order
    and no column hides behind one that is itself below its floor.
    """
    _, v = rows.first_stage()
    floor = _floors(rows.x)
    basis, _ = np.linalg.qr(rows.x)
    new = v - basis @ (basis.T @ v)
    new -= basis @ (basis.T @ new)
    ratios = _pivoted_diagonal(new / floor)
    shifts = ratios > 1.0
    kept = np.flatnonzero(shifts)
    scale = np.linalg.norm(rows.x, axis=0)
    checks = tuple(
        ColumnCheck(
            name,
            float(ratios[k] * floor[k] / scale[k]),
            float(floor[k] / scale[k]),
            None,
            not shifts[k],
        )
        for k, name in enumerate(names)
    )
    detail = (
        f"{kept.size} of {len(names)} columns of V̂ could shift a parameter by more than"
        f" {_BIAS_THAT_MATTERS:g} σ and go to the F-test"
    )
    statistic, passed = float(ratios.max()), kept.size == 0
    words = "largest |R_kk| over its floor"
    return Gate("rank", RANK_NULL, passed, statistic, words, None, None, detail, checks), kept


def _floors(x: FloatArray) -> FloatArray:
    """Norm of a new part of V̂_k that could shift parameter k by just what matters, (b,)."""
    scale = np.linalg.norm(x, axis=0)
    inverse = np.linalg.inv(np.linalg.qr(x / scale, mode="r"))
    own_part = scale / np.linalg.norm(inverse, axis=1)
    return np.asarray(_BIAS_THAT_MATTERS * own_part / np.sqrt(x.shape[0]))


def _pivoted_diagonal(columns: FloatArray) -> FloatArray:
    """|R_kk| of a pivoted QR, given back in the order of the columns, (b,)."""
    from scipy.linalg import qr  # takes time to load; a log without reference needs none

    r, pivots = qr(columns, mode="r", pivoting=True)
    diagonal = np.zeros(columns.shape[1])
    diagonal[pivots] = np.abs(np.diag(r))
    return diagonal
