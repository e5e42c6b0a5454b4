"""Covariances and whitening piece by piece: sums written out, orders and limits worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from statsmodels.stats.diagnostic import acorr_ljungbox

from ident.covariances import BartlettHac, Block, Cluster, Independent, White, covariance_of, estimated_rows
from ident.covariances.cluster import groups
from ident.covariances.hac import bartlett_sum, newey_west_bandwidth
from ident.covariances.problem import EstimatedRows
from ident.statistics.covariance import autocovariance, instrumental_covariance
from ident.statistics.whitening import (
    Whitening,
    autoregressive_whitening,
    block_whitening,
    is_stable,
    lag1_autocorrelation,
    largest_order,
    ljung_box,
    unbroken,
)
from robots.arrays import FloatArray

SAMPLES = 30


def rows(period: bool = False) -> EstimatedRows:
    """Two joints with deviations 0.5 and 4, two recordings, a fifth of the rows left out."""
    generator = np.random.default_rng(1)
    x = generator.normal(size=(SAMPLES, 2, 3))
    used = generator.random((SAMPLES, 2)) < 0.8
    residual = generator.normal(size=(SAMPLES, 2)) * [0.7, 5.0] * used
    segment = np.repeat([0, 1], SAMPLES // 2)
    labels = np.tile(np.repeat([0, 1, 2], 5), 2) if period else None
    return estimated_rows(x, x, residual, np.array([0.5, 4.0]), segment, used, labels)


def weighted(case: EstimatedRows) -> tuple[FloatArray, FloatArray]:
    """Columns and residuals of the rows that are used, (r, b) and (r,)."""
    return case.x[case.used], case.residual[case.used]


def sandwich(case: EstimatedRows, score: FloatArray) -> FloatArray:
    x, _ = weighted(case)
    inverse = np.linalg.inv(x.T @ x)
    return np.asarray(inverse @ score @ inverse)


def test_left_out_rows_are_nothing() -> None:
    case = rows()
    assert not case.x[~case.used].any() and not case.residual[~case.used].any()
    assert (case.count, case.parameters, case.joints) == (int(case.used.sum()), 3, 2)


def test_independent_covariances_written_out() -> None:
    case = rows()
    x, e = weighted(case)
    one = e @ e / (e.size - 3) * x.T @ x
    assert covariance_of(case, Independent()) == pytest.approx(sandwich(case, one), rel=1e-10)
    plain = (x * e[:, np.newaxis]).T @ (x * e[:, np.newaxis])
    assert covariance_of(case, White(False)) == pytest.approx(sandwich(case, plain), rel=1e-10)
    scaled = plain * e.size / (e.size - 3)
    assert covariance_of(case, White()) == pytest.approx(sandwich(case, scaled), rel=1e-10)
    per_joint = np.zeros((3, 3))
    for joint in (0, 1):
        own, left = case.x[case.used[:, joint], joint], case.residual[case.used[:, joint], joint]
        per_joint += left @ left / (left.size - 1.5) * own.T @ own
    assert covariance_of(case, Block()) == pytest.approx(sandwich(case, per_joint), rel=1e-10)
    assert White().describe(case).startswith("HC1 ") and White(False).describe(case).startswith("HC0 ")


def test_clusters_are_repetitions_of_each_recording() -> None:
    case = rows(period=True)
    assert groups(case).tolist() == np.repeat(np.arange(6), 5).tolist()
    scores = case.x * case.residual[:, :, np.newaxis]
    sums = scores.sum(axis=1).reshape(6, 5, 3).sum(axis=1)
    score, r = sums.T @ sums, case.count
    assert Cluster(False).score_covariance(case) == pytest.approx(score, rel=1e-10)
    assert Cluster().score_covariance(case) == pytest.approx(6 / 5 * (r - 1) / (r - 3) * score, rel=1e-10)
    assert Cluster().describe(case) == "clusters: 6 repetitions, any correlation inside each"
    assert Cluster().describe(rows()) == "clusters: 2 recordings, any correlation inside each"


def test_bartletts_sum_written_out() -> None:
    scores = np.random.default_rng(2).normal(size=(9, 2))
    expected = sum(
        max(0.0, 1 - abs(s - t) / 4) * np.outer(scores[s], scores[t]) for s in range(9) for t in range(9)
    )
    assert bartlett_sum(scores, 3) == pytest.approx(expected, rel=1e-12)


def test_hac_takes_each_piece_with_its_own_lags() -> None:
    case = rows()
    kind = BartlettHac()
    pieces = [
        (case.x * case.residual[:, :, np.newaxis])[part, joint]
        for joint in (0, 1)
        for part in (slice(0, 15), slice(15, 30))
    ]
    scale = np.sqrt(np.sum(weighted(case)[0] ** 2, axis=0))
    lags = [newey_west_bandwidth((piece / scale).sum(axis=1)) for piece in pieces]
    assert kind.bandwidths(case) == lags
    expected = sum(bartlett_sum(piece, lag) for piece, lag in zip(pieces, lags, strict=True))
    assert BartlettHac(small_sample=False).score_covariance(case) == pytest.approx(expected, rel=1e-10)
    scaled = expected * case.count / (case.count - 3)
    assert kind.score_covariance(case) == pytest.approx(scaled, rel=1e-10)
    told = f"HAC per joint and recording, Bartlett kernel, {min(lags)} to {max(lags)} lags (Newey-West)"
    assert kind.describe(case) == told
    # No more lags than a piece has.
    assert BartlettHac(99).bandwidths(case) == [14] * 4
    assert BartlettHac(3).describe(case).endswith("3 to 3 lags (given)")


def test_the_plug_in_bandwidth_by_hand() -> None:
    """Newey and West (1994): 4·(T/100)^(2/9) pilot lags, then 1.1447·((s₁/s₀)²·T)^(1/3)."""
    series = np.array([1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    moments = [series[k:] @ series[: 10 - k] / 10 for k in range(4)]  # ⌈4·0.1^(2/9)⌉ = 3
    level = moments[0] + 2 * sum(moments[1:])
    slope = 2 * sum(k * moments[k] for k in (1, 2, 3))
    exact = 1.1447 * ((slope / level) ** 2 * 10) ** (1 / 3)
    assert newey_west_bandwidth(series) == min(int(np.ceil(exact)), 9)
    assert newey_west_bandwidth(np.zeros(10)) == 0
    assert newey_west_bandwidth(np.array([1.0, 1.0])) == 1


# Whitening


def test_the_autocovariance_of_a_first_order_process_is_known() -> None:
    gamma = autocovariance(np.array([0.5]), 3.0, 40)
    assert gamma == pytest.approx(9.0 / 0.75 * 0.5 ** np.arange(40), rel=1e-5, abs=2e-5)
    assert autocovariance(np.empty(0), 2.0, 3).tolist() == [4.0, 0.0, 0.0]
    assert autocovariance(np.array([0.5]), 1.0, 1) == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("samples", "order"), [(39, 0), (40, 2), (59, 2), (60, 3), (399, 19), (400, 20), (900, 20)]
)
def test_an_order_needs_twenty_rows_each_and_forty_in_all(samples: int, order: int) -> None:
    assert largest_order(np.ones((samples, 2), dtype=np.bool_)) == order
    one_short = np.ones((samples + 50, 2), dtype=np.bool_)
    one_short[samples:] = False  # a gap at the end: what is left counts, and six at most
    assert largest_order(one_short) == min(order, 6)


def test_unbroken_samples_have_so_many_used_before_them() -> None:
    used = np.array([1, 1, 1, 0, 1, 1, 1, 1], dtype=np.bool_)
    assert unbroken(used, 0).tolist() == used.tolist()
    assert unbroken(used, 2).tolist() == [True, False, False, False, True, True]


def test_joints_of_filtered_rows() -> None:
    whitening = Whitening("ar", (np.array([0.5]), np.empty(0)), np.array([2.0, 3.0]))
    used = np.ones((8, 2), dtype=np.bool_)
    used[2, 1] = False
    segment = np.repeat([0, 1], 4)
    assert whitening.joint_of_rows(segment, used).tolist() == [0] * 6 + [1] * 4
    values = np.arange(16.0).reshape(8, 2, 1)
    filtered = whitening.apply(values, segment, used)[:, 0]
    assert filtered[:3] == pytest.approx((values[1:4, 0, 0] - 0.5 * values[0:3, 0, 0]) / 2.0)
    assert filtered[6:] == pytest.approx(values[[1, 5, 6, 7], 1, 0][[0, 1, 2, 3]] / 3.0)


def test_an_ar_model_counts_the_freedom_that_the_fit_has_taken() -> None:
    residual = np.random.default_rng(6).normal(size=(90, 2)) * [1.0, 3.0]
    found = autoregressive_whitening(residual, np.zeros(90, dtype=np.int64), np.ones((90, 2), dtype=bool), 6)
    largest = largest_order(np.ones((90, 2), dtype=np.bool_))
    assert [a.size for a in found.coefficients] == [0, 0] and found.order == 0
    expected = np.sqrt(np.sum(residual[largest:] ** 2, axis=0) / (90 - largest - 3))
    assert found.sigma == pytest.approx(expected, rel=1e-12)
    block = block_whitening(residual, np.ones((90, 2), dtype=np.bool_), 6)
    assert block.sigma == pytest.approx(np.sqrt(np.sum(residual**2, axis=0) / 87), rel=1e-12)


def test_the_order_is_that_of_the_smallest_bic_on_the_same_samples() -> None:
    generator = np.random.default_rng(7)
    series = np.zeros(300)
    for t in range(3, 300):
        series[t] = 0.6 * series[t - 1] + 0.3 * series[t - 3] + generator.normal()
    found = autoregressive_whitening(
        series[:, np.newaxis], np.zeros(300, dtype=np.int64), np.ones((300, 1), dtype=np.bool_), 0
    )
    y, lags = series[15:], np.column_stack([series[15 - k : 300 - k] for k in range(1, 16)])
    fits = [np.linalg.lstsq(lags[:, :p], y, rcond=None)[0] for p in range(16)]
    left = [float(np.sum((y - lags[:, :p] @ a) ** 2)) for p, a in enumerate(fits)]
    best = int(np.argmin([285 * np.log(e / 285) + p * np.log(285) for p, e in enumerate(left)]))
    assert best == 3
    assert found.coefficients[0] == pytest.approx(fits[best], rel=1e-9)
    assert found.sigma[0] == pytest.approx(np.sqrt(left[best] / 285), rel=1e-9)


def test_processes_near_the_unit_circle_are_none() -> None:
    assert is_stable(np.array([0.9949])) and not is_stable(np.array([0.9951]))
    assert is_stable(np.array([1.0, -0.9])) and not is_stable(np.array([1.0, -1.0]))
    lot, verdicts = np.random.default_rng(4), []
    for order in [2, 3, 8, 13] * 50:
        pairs = lot.uniform(0.8, 1.01, order // 2) * np.exp(1j * lot.uniform(0.0, np.pi, order // 2))
        poles = np.concatenate([pairs, pairs.conj(), lot.uniform(-1.0, 1.0, order % 2)])
        verdicts.append(bool(np.abs(poles).max() < 0.995))
        assert is_stable(-np.poly(poles).real[1:]) == verdicts[-1]
    assert 20 < sum(verdicts) < 180


def test_autocorrelation_of_a_short_series() -> None:
    # About their mean of 3: −2, 0, 2, 1, −1: products 0, 0, 2, −1 over squares of 10.
    assert lag1_autocorrelation(np.array([1.0, 3.0, 5.0, 4.0, 2.0])) == pytest.approx(0.1)


@pytest.mark.parametrize(("samples", "fitted"), [(80, 3), (12, 0), (12, 2)])
def test_ljung_box_of_a_models_residuals(samples: int, fitted: int) -> None:
    series = np.random.default_rng(samples).normal(size=samples) + 2.0
    lags = min(10, samples // 2)
    expected = acorr_ljungbox(series - series.mean(), lags=[lags], model_df=fitted)
    statistic, p = ljung_box(series, 10, fitted)
    assert statistic == pytest.approx(float(expected["lb_stat"].iloc[0]), rel=1e-10)
    assert p == pytest.approx(float(expected["lb_pvalue"].iloc[0]), rel=1e-8)


def test_whitening_in_words() -> None:
    block = Whitening("block", (np.empty(0),), np.ones(1))
    assert block.describe() == "Ω per joint, errors independent in time (the paper's)"
    coefficients = (np.array([0.5]), np.array([0.5, 0.1]))
    words = "AR prewhitening per joint (orders 1, 2 by BIC), Ω of the innovations"
    for p in (None, np.array([0.5, 0.001])):
        assert Whitening("ar", coefficients, np.ones(2), p).describe() == words
    told = Whitening("ar", coefficients, np.ones(2), np.array([0.5, 0.00099])).describe()
    assert told == f"{words}; not quite white are joints 2 (p 0.001), Ljung-Box"


def test_no_variance_is_below_zero_by_rounding() -> None:
    """Columns of very different size that nearly depend on each other, as of a poor motion."""
    generator = np.random.default_rng(3)
    base = generator.normal(size=(400, 2, 6)).cumsum(axis=0)
    for column in range(1, 6):
        base[:, :, column] = base[:, :, 0] + 10.0 ** (-1.7 * column) * base[:, :, column]
    base *= 10.0 ** np.arange(6, -6, -2)
    whitening = Whitening("ar", (np.array([0.95]), np.array([0.99])), np.array([1.0, 0.5]))
    covariance = instrumental_covariance(
        base, base, np.array([1.0, 0.5]), whitening, np.zeros(400, dtype=np.int64)
    )
    assert (np.diag(covariance) >= 0.0).all()
    np.testing.assert_allclose(covariance, covariance.T)
