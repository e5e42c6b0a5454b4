"""Eigenvalues of symmetric matrices on which the quick way fails."""

from __future__ import annotations

import numpy as np
import pytest

from ident.statistics.restricted import independent_whitening
from ident.statistics.symmetric import eigen_of
from ident.statistics.taken import fit_of


def gives_up(*asked: object) -> None:
    raise np.linalg.LinAlgError("Eigenvalues did not converge")


def test_a_matrix_of_low_rank_has_its_values_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    root = np.random.default_rng(0).standard_normal((12, 4))
    whole = root @ root.T
    usual = eigen_of(whole)[0]
    monkeypatch.setattr(np.linalg, "eigh", gives_up)
    values, vectors = eigen_of(whole)
    assert values == pytest.approx(usual, abs=1e-12)
    assert (vectors * values) @ vectors.T == pytest.approx(whole, abs=1e-12)


def test_a_fit_goes_on_where_the_quick_way_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """A log of KR300 that was cut off ended in a traceback here."""
    lot = np.random.default_rng(1)
    regressor = lot.standard_normal((60, 2, 3))
    target = regressor @ np.array([1.0, -2.0, 3.0]) + 0.01 * lot.standard_normal((60, 2))
    segment, used = np.zeros(60, dtype=np.int64), np.ones((60, 2), dtype=np.bool_)
    omega = independent_whitening(target, regressor, segment, used)
    monkeypatch.setattr(np.linalg, "eigh", gives_up)
    values, _ = fit_of(omega, target, regressor, segment, used)
    assert values == pytest.approx([1.0, -2.0, 3.0], abs=0.02)
