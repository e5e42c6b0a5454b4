"""The filters and the spline of this package are those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.linalg import toeplitz
from scipy.ndimage import binary_dilation
from scipy.optimize import nnls
from scipy.signal import butter, cheby1, filtfilt, firwin, lfilter, sosfiltfilt, welch
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from ident.even_spline import EvenSpline
from ident.filters import near, power_density, recursion, windowed_sinc
from ident.preparation.spectrum import two_shares
from ident.recursive_filter import RecursiveFilter, butterworth, chebyshev
from ident.statistics.tails import beyond_chi2, beyond_f, each_beyond_f
from ident.statistics.toeplitz import circle, spectrum, times

LOT = np.random.default_rng(7)


@pytest.mark.parametrize(("order", "cutoff"), [(1, 0.3), (2, 0.5), (4, 0.04), (3, 0.9)])
def test_butterworth_both_ways(order: int, cutoff: float) -> None:
    walk = LOT.standard_normal((3, 400)).cumsum(axis=1)
    expected = filtfilt(*butter(order, cutoff), walk, axis=1, padlen=3 * order)
    found = butterworth(order, cutoff).both_ways(walk, 3 * order)
    np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize("factor", [2, 10, 13])
def test_chebyshev_both_ways(factor: int) -> None:
    walk = LOT.standard_normal((3, 400)).cumsum(axis=1)
    expected = filtfilt(*cheby1(8, 0.05, 0.8 / factor), walk, axis=1, padlen=24)
    np.testing.assert_allclose(chebyshev(8, 0.05, 0.8 / factor).both_ways(walk, 24), expected, atol=1e-4)


@pytest.mark.parametrize("filtered", [butterworth(4, 0.002), chebyshev(8, 0.05, 0.8 / 13)])
def test_rounding_of_narrow_filters(filtered: RecursiveFilter) -> None:
    """Second-order sections, which round little; one polynomial of all poles is off by 1e-7 here."""
    walk = LOT.standard_normal((2, 5000)).cumsum(axis=1)
    pairs = filtered.poles[filtered.poles.imag > 0.0]
    denominators = np.stack([np.ones(pairs.size), -2.0 * pairs.real, np.abs(pairs) ** 2], axis=1)
    numerators = np.tile([1.0, 2.0, 1.0], (pairs.size, 1))
    numerators[0] *= filtered.gain
    expected = sosfiltfilt(np.concatenate([numerators, denominators], axis=1), walk, axis=1, padlen=24)
    np.testing.assert_allclose(filtered.both_ways(walk, 24), expected, atol=1e-9 * np.abs(walk).max())


@pytest.mark.parametrize("samples", [1, 63, 64, 65, 200])
def test_recursion(samples: int) -> None:
    values, slow = LOT.standard_normal((samples, 2)), np.poly([0.98, 0.5, -0.3])
    np.testing.assert_allclose(recursion(slow, values), lfilter([1.0], slow, values, axis=0), rtol=1e-10)
    np.testing.assert_array_equal(recursion(np.array([1.0]), values), values)


def test_recursion_and_taps() -> None:
    values = LOT.standard_normal((50, 2))
    np.testing.assert_allclose(
        recursion(np.array([1.0, -0.5, 0.1]), values), lfilter([1.0], [1.0, -0.5, 0.1], values, axis=0)
    )
    np.testing.assert_allclose(
        windowed_sinc(20, 0.16, 6.0), firwin(41, 0.16, window=("kaiser", 6.0)), atol=1e-15
    )


@pytest.mark.parametrize("piece", [64, 65, 300, 301])
def test_power_density(piece: int) -> None:
    values = LOT.standard_normal((301, 2))
    frequency, power = welch(values, 250.0, nperseg=piece, axis=0)
    found = power_density(values, 250.0, piece)
    np.testing.assert_allclose(found[0], frequency)
    np.testing.assert_allclose(found[1], power, atol=1e-14)


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 6, 34, 36, 37, 60, 1000])
def test_spline_through_even_samples(samples: int) -> None:
    values = LOT.standard_normal((samples, 2))
    expected, found = CubicSpline(np.arange(samples), values, axis=0), EvenSpline(values)
    place = np.concatenate([LOT.uniform(-0.3, samples - 0.7, 30), np.arange(samples)])
    np.testing.assert_allclose(found.at(place), expected(place), atol=1e-12)
    np.testing.assert_allclose(found.integral(place), expected.antiderivative()(place), atol=1e-12)
    np.testing.assert_allclose(found.slopes(), expected(np.arange(samples), 1), atol=1e-12)
    between = np.linspace(0, samples - 1, 4 * (samples - 1) + 1)
    np.testing.assert_allclose(found.with_between(4), expected(between), atol=1e-12)


@pytest.mark.parametrize("reach", [0, 3, 60])
def test_near(reach: int) -> None:
    mask = LOT.random((50, 3)) < 0.05
    np.testing.assert_array_equal(near(mask, reach), binary_dilation(mask, np.ones((2 * reach + 1, 1))))


def test_two_shares_are_none_below_nothing() -> None:
    for _ in range(40):
        columns, values = LOT.random((6, 2)), LOT.standard_normal(6)
        np.testing.assert_allclose(two_shares(columns, values), nnls(columns, values)[0], atol=1e-12)


def test_tails() -> None:
    for freedom in (1, 2, 3, 10, 29, 30, 4.5):
        for statistic in (1e-3, 0.7, 7.0, 60.0, 2000.0):
            assert beyond_chi2(statistic, freedom) == pytest.approx(chi2.sf(statistic, freedom), abs=1e-14)
    assert beyond_f(2.5, 3, 40.5) == pytest.approx(f_distribution.sf(2.5, 3, 40.5))
    assert beyond_f(-1.0, 3, 40.5) == beyond_chi2(-1.0, 3) == 1.0
    np.testing.assert_allclose(
        each_beyond_f(np.array([0.1, 9.0]), 1, 30), f_distribution.sf([0.1, 9.0], 1, 30)
    )


@pytest.mark.parametrize("samples", [1, 2, 5, 100, 1237])
def test_toeplitz_products(samples: int) -> None:
    gamma, series = LOT.standard_normal(samples), LOT.standard_normal((samples, 2))
    np.testing.assert_allclose(times(gamma, spectrum(series)), toeplitz(gamma) @ series, atol=1e-10)
    assert 2 * samples - 1 <= circle(samples) <= max(1.07 * (2 * samples - 1), 2 * samples)
