"""The Monte Carlo of benchmarks/exogeneity.py in its short form."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import exogeneity
from ident import RegressorModel, base_parameters
from robots import load

REPLICATES = 100


@pytest.fixture(scope="module")
def counts() -> dict[tuple[str, str], int]:
    return exogeneity.run("one_axis", REPLICATES, ("iid", "hac", "bootstrap"), power=False)


@pytest.mark.slow
@pytest.mark.parametrize("errors", list(exogeneity.ERRORS))
def test_the_default_keeps_its_size_whatever_the_errors(
    counts: dict[tuple[str, str], int], errors: str
) -> None:
    # A true 5 % test rejects at most 12 of 100 with probability 0.998.
    assert counts[errors, "revised"] <= 12
    assert counts[errors, "Wald, bootstrap"] <= 12


@pytest.mark.slow
def test_the_textbook_test_fails_where_errors_are_correlated(counts: dict[tuple[str, str], int]) -> None:
    assert counts["white", "textbook, i.i.d."] <= 12
    assert counts["AR(1) 0.9", "textbook, i.i.d."] >= 40


@pytest.mark.slow
def test_the_wald_test_with_one_variance_is_the_textbook_test(counts: dict[tuple[str, str], int]) -> None:
    for errors in exogeneity.ERRORS:
        assert counts[errors, "Wald, iid"] == counts[errors, "textbook, i.i.d."]


def test_power_grows_with_encoder_noise() -> None:
    base = base_parameters(RegressorModel.of(load("emps")))
    beta = exogeneity.truth(base)
    shares = []
    for noise in (1e-8, 3e-7, 1e-6):
        designs = [exogeneity.design(base, noise, seed) for seed in range(2)]
        found = exogeneity.rejections(designs, beta, exogeneity.errors_in_variables, 0.6, 40, ())
        shares.append(found["revised"] / 40)
    assert shares == sorted(shares)
    assert shares[0] <= 0.15
    assert shares[-1] == 1.0


def test_the_interval_is_wilsons() -> None:
    low, high = exogeneity.wilson(5, 100)
    assert (low, high) == pytest.approx((0.0215, 0.1118), abs=5e-4)
    assert np.isclose(exogeneity.wilson(0, 50)[0], 0.0)
