"""Do surplus instruments agree? Sargan, Basmann and Hansen's J on weighted rows."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from ident.errors import IdentificationError
from ident.exogeneity.hypothesis import HypothesisTest, annihilate, chi2_test, f_test
from ident.exogeneity.textbook import WhiteRows, informative
from robots.arrays import FloatArray

_NULL = "the instruments are uncorrelated with the errors"


def sargan(rows: WhiteRows) -> HypothesisTest:
    """Sargan's test: r·(1 − SSR/TSS) of the two-stage residuals on Z, errors independent of one variance.

    Raises:
        IdentificationError: as many instruments as parameters leave nothing to test.
    """
    surplus = _surplus(rows)
    residual = _two_stage_residual(rows)
    left = annihilate(residual[:, np.newaxis], rows.z)
    statistic = rows.y.size * (1.0 - float(np.sum(left**2)) / float(residual @ residual))
    return chi2_test("Sargan's test", _NULL, statistic, surplus)


def basmann(rows: WhiteRows) -> HypothesisTest:
    """Basmann's test: Sargan's with the degrees of freedom of the regression on Z.

    Raises:
        IdentificationError: as many instruments as parameters leave nothing to test.
    """
    found = sargan(rows)
    samples = rows.y.size
    statistic = found.statistic * (samples - rows.z.shape[1]) / (samples - found.statistic)
    return chi2_test("Basmann's test", _NULL, statistic, _surplus(rows))


def basmann_f(rows: WhiteRows) -> HypothesisTest:
    """Basmann's F: (κ − 1) times degrees of freedom, with κ of limited-information maximum likelihood.

    Raises:
        IdentificationError: as many instruments as parameters leave nothing to test.
    """
    surplus = _surplus(rows)
    endogenous = informative(rows.x, rows.first_stage()[1])
    exogenous = np.delete(rows.x, endogenous, axis=1)
    together = np.column_stack([rows.y, rows.x[:, endogenous]])
    without = annihilate(together, exogenous) if exogenous.shape[1] else together
    beyond = annihilate(together, rows.z)
    kappa = float(eigh(without.T @ without, beyond.T @ beyond, eigvals_only=True)[0])
    freedom = rows.y.size - rows.z.shape[1]
    return f_test("Basmann's F test", _NULL, (kappa - 1.0) * freedom / surplus, surplus, freedom)


def hansen_j(rows: WhiteRows) -> HypothesisTest:
    """Hansen's J of two-step GMM with White's weights: any variance in any row (Hansen 1982).

    Raises:
        IdentificationError: as many instruments as parameters leave nothing to test.
    """
    surplus = _surplus(rows)
    scores = rows.z * _two_stage_residual(rows)[:, np.newaxis]
    _, factor = np.linalg.qr(scores)
    x = np.linalg.solve(factor.T, rows.z.T @ rows.x)
    y = np.linalg.solve(factor.T, rows.z.T @ rows.y)
    left = annihilate(y[:, np.newaxis], x)
    return chi2_test("Hansen's J", _NULL, float(np.sum(left**2)), surplus)


def _surplus(rows: WhiteRows) -> int:
    surplus = int(rows.z.shape[1] - rows.x.shape[1])
    if surplus < 1:
        raise IdentificationError(
            f"{rows.z.shape[1]} instruments for {rows.x.shape[1]} parameters; a test of them needs more"
        )
    return surplus


def _two_stage_residual(rows: WhiteRows) -> FloatArray:
    """y − Xβ̂ of two-stage least squares, (r,)."""
    projected = rows.x - rows.first_stage()[1]
    beta = np.linalg.lstsq(projected, rows.y, rcond=None)[0]
    return np.asarray(rows.y - rows.x @ beta)
