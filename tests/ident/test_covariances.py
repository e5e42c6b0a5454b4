"""Covariances by name: as statsmodels and linearmodels have them, and honest under correlation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import statsmodels.api as sm
from linearmodels.iv import IV2SLS
from linearmodels.iv.covariance import kernel_optimal_bandwidth
from scipy.io import loadmat
from scipy.signal import lfilter

import robots
from ident import Recording, identify
from ident.covariances import (
    Autoregressive,
    BartlettHac,
    BlockBootstrap,
    Cluster,
    Covariance,
    EstimatedRows,
    Independent,
    White,
    covariance_kinds,
    covariance_named,
    covariance_of,
    estimated_stack,
)
from ident.covariances.hac import newey_west_bandwidth
from ident.errors import IdentificationError
from ident.estimators import Stacked, two_stage_least_squares, weighted_least_squares
from robots.arrays import FloatArray

SAMPLES = 300
NAMES = ("a", "b", "c")
ONE = np.ones(1)


def problem(joints: int = 1) -> tuple[Stacked, FloatArray]:
    """Heteroskedastic and correlated errors; five instruments for three columns."""
    generator = np.random.default_rng(4)
    count = joints * SAMPLES
    z = generator.normal(size=(count, 5))
    errors = lfilter([1.0], [1.0, -0.6], generator.normal(size=count)) * (1 + np.abs(z[:, 0]))
    x = z[:, :3] + 0.5 * z[:, 2:] + 0.3 * generator.normal(size=(count, 3))
    return Stacked(x @ [1.0, -2.0, 0.5] + errors, x, np.repeat(np.arange(joints), SAMPLES)), z


def least_squares_rows(period: FloatArray | None = None) -> tuple[EstimatedRows, Stacked]:
    stacked, _ = problem()
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    labels = None if period is None else period.astype(np.int64)
    return estimated_stack(stacked, beta, ONE, period=labels), stacked


PERIOD = np.repeat(np.arange(12), SAMPLES // 12)


@pytest.mark.parametrize(
    ("kind", "reference"),
    [
        (Independent(), {"cov_type": "nonrobust"}),
        (White(small_sample=False), {"cov_type": "HC0"}),
        (White(), {"cov_type": "HC1"}),
        (
            BartlettHac(bandwidth=7, small_sample=False),
            {"cov_type": "HAC", "cov_kwds": {"maxlags": 7, "use_correction": False}},
        ),
        (BartlettHac(bandwidth=7), {"cov_type": "HAC", "cov_kwds": {"maxlags": 7, "use_correction": True}}),
        (Cluster(), {"cov_type": "cluster", "cov_kwds": {"groups": PERIOD}}),
    ],
)
def test_least_squares_covariance_is_that_of_statsmodels(
    kind: Covariance, reference: dict[str, object]
) -> None:
    rows, stacked = least_squares_rows(PERIOD)
    expected = sm.OLS(stacked.y, stacked.x).fit(**reference).cov_params()
    assert covariance_of(rows, kind) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (Independent(), {"cov_type": "unadjusted", "debiased": True}),
        (White(small_sample=False), {"cov_type": "robust"}),
        (White(), {"cov_type": "robust", "debiased": True}),
        (BartlettHac(7, small_sample=False), {"cov_type": "kernel", "kernel": "bartlett", "bandwidth": 7}),
        (Cluster(small_sample=False), {"cov_type": "clustered", "clusters": PERIOD}),
        (Cluster(), {"cov_type": "clustered", "clusters": PERIOD, "debiased": True}),
    ],
)
def test_two_stage_covariance_is_that_of_linearmodels(kind: Covariance, options: dict[str, object]) -> None:
    stacked, z = problem()
    fit = two_stage_least_squares(stacked, z, ONE)
    expected = IV2SLS(stacked.y, None, stacked.x, z).fit(**options)
    rows = estimated_stack(stacked, fit.beta, ONE, fit.projected, period=PERIOD)
    assert fit.beta == pytest.approx(expected.params.to_numpy(), rel=1e-10)
    assert covariance_of(rows, kind) == pytest.approx(expected.cov.to_numpy(), rel=1e-8)


def test_weights_are_those_of_wls() -> None:
    stacked, _ = problem(joints=2)
    fit = weighted_least_squares(stacked, NAMES)
    rows = estimated_stack(stacked, fit.beta, fit.sigma)
    reference = sm.WLS(stacked.y, stacked.x, weights=np.repeat(fit.sigma**-2.0, SAMPLES)).fit(cov_type="HC1")
    assert covariance_of(rows, White()) == pytest.approx(reference.cov_params(), rel=1e-8)


def test_the_automatic_bandwidth_is_newey_and_wests() -> None:
    for rho in (0.0, 0.5, 0.9):
        series = lfilter([1.0], [1.0, -rho], np.random.default_rng(3).normal(size=700))
        assert newey_west_bandwidth(series) == kernel_optimal_bandwidth(series, "bartlett")


def test_hac_mixes_neither_joints_nor_recordings() -> None:
    stacked, _ = problem(joints=2)
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    segment = np.repeat([0, 1], SAMPLES // 2)
    rows = estimated_stack(stacked, beta, np.ones(2), segment=segment)
    expected = np.zeros((3, 3))
    scores = stacked.x * (stacked.y - stacked.x @ beta)[:, np.newaxis]
    for piece in np.split(scores, 4):
        for s in range(len(piece)):
            for t in range(len(piece)):
                expected += max(0.0, 1 - abs(s - t) / 6) * np.outer(piece[s], piece[t])
    kind = BartlettHac(bandwidth=5, small_sample=False)
    assert kind.score_covariance(rows) == pytest.approx(expected, rel=1e-10)


def test_clusters_are_recordings_where_nothing_repeats_and_one_is_refused() -> None:
    stacked, _ = problem()
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    segment = np.repeat([0, 1, 2, 3, 4], SAMPLES // 5)
    expected = sm.OLS(stacked.y, stacked.x).fit(cov_type="cluster", cov_kwds={"groups": segment}).cov_params()
    found = covariance_of(estimated_stack(stacked, beta, ONE, segment=segment), Cluster())
    assert found == pytest.approx(expected, rel=1e-8)
    with pytest.raises(IdentificationError, match="at least two recordings or repetitions"):
        covariance_of(estimated_stack(stacked, beta, ONE), Cluster())


def test_the_bootstrap_repeats_bit_for_bit_and_other_seeds_differ() -> None:
    rows, _ = least_squares_rows()
    first, again, other = (covariance_of(rows, BlockBootstrap(seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_bootstrap_agrees_with_independence_where_errors_are() -> None:
    generator = np.random.default_rng(8)
    x = generator.normal(size=(2000, 2))
    stacked = Stacked(x @ [1.0, 2.0] + generator.normal(size=2000), x, np.zeros(2000, dtype=np.int64))
    beta = np.linalg.lstsq(x, stacked.y, rcond=None)[0]
    rows = estimated_stack(stacked, beta, ONE)
    ratio = np.diag(covariance_of(rows, BlockBootstrap(replicates=2000))) / np.diag(
        covariance_of(rows, Independent())
    )
    assert ratio == pytest.approx([1.0, 1.0], abs=0.12)


@pytest.mark.parametrize("kind", [Autoregressive(), BartlettHac(), BlockBootstrap()])
def test_sigma_is_honest_where_errors_are_correlated(kind: Covariance) -> None:
    samples = 500
    time = np.linspace(0, 20, samples)
    x = np.column_stack([np.sin(time), np.cos(2.2 * time)])
    estimates, claimed, naive = [], [], []
    for seed in range(200):
        noise = lfilter([1.0], [1.0, -0.7], np.random.default_rng(seed).normal(size=samples + 100))[100:]
        stacked = Stacked(x @ [1.0, 2.0] + noise, x, np.zeros(samples, dtype=np.int64))
        beta = np.linalg.lstsq(x, stacked.y, rcond=None)[0]
        rows = estimated_stack(stacked, beta, ONE)
        estimates.append(beta)
        claimed.append(np.diag(covariance_of(rows, kind)))
        naive.append(np.diag(covariance_of(rows, Independent())))
    spread = np.var(estimates, axis=0)
    assert np.all(np.mean(claimed, axis=0) / spread > 0.6)
    assert np.all(np.mean(claimed, axis=0) / spread < 1.4)
    assert np.all(np.mean(naive, axis=0) / spread < 0.35)


def test_names_are_known_and_others_refused() -> None:
    assert covariance_kinds() == ("iid", "block", "ar", "hc", "hac", "cluster", "bootstrap")
    assert all(covariance_named(name).name == name for name in covariance_kinds())
    with pytest.raises(IdentificationError, match='covariance "hc9"; allowed: iid, block, ar'):
        covariance_named("hc9")


@pytest.fixture(scope="module")
def emps_log(shared_data: Path) -> Recording:
    log = loadmat(shared_data / "emps" / "DATA_EMPS.mat")
    time, reference, position, signal = (log[key].astype(np.float64) for key in ("t", "qg", "qm", "vir"))
    return Recording("DATA_EMPS.mat", time.ravel(), reference, position, signal)


@pytest.mark.parametrize("name", covariance_kinds())
def test_every_kind_works_by_its_name_in_the_arms_settings(emps_log: Recording, name: str) -> None:
    robot = robots.load("emps")
    settings = type(robot.identification).model_validate(
        robot.identification.model_dump() | {"covariance": name}
    )
    recordings = (emps_log, emps_log) if name == "cluster" else (emps_log,)
    result = identify(robot.model_copy(update={"identification": settings}), recordings).result
    assert result.instrumental is not None
    for estimate in (result.least_squares, result.instrumental):
        assert np.all(np.linalg.eigvalsh(estimate.covariance) > -1e-9 * np.trace(estimate.covariance))
        # Published σ of the mass with independent errors: 0.11 kg; nothing makes it ten times that.
        assert 0.0 < estimate.parameters[0].sigma < 1.1 or name == "cluster"
    if name in {"ar", "hac", "bootstrap"}:
        # Lag-1 autocorrelation is 0.67, so independence understates σ.
        assert result.least_squares.parameters[3].sigma > 1.3 * 0.0444
