"""Priors and predictions: calibrated where the prior is true, least squares where it says nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats

from ident.drift import DriftSettings, Geometry, Night, Pattern, compare, patterns_of
from ident.drift.history import Series, expected_of, label_of
from ident.drift.patterns import WARMTH, with_warmth
from ident.drift.predictive import _FACTOR, ChartPrior, predict
from ident.drift.prior import NIGHTS, posterior_covariance, prior_of
from ident.drift.words import _warmth_words
from robots.arrays import FloatArray
from tests.ident.drift.arms_of_nights import covariance_within, draw_nights, geometry

SETTINGS = DriftSettings()


@pytest.fixture(scope="module")
def made() -> Geometry:
    """Friction is a quarter to a half of the torque, as on a real arm."""
    return geometry(friction=12.0)


def friction(made: Geometry, joint: int, effect: str = "coulomb_friction") -> Pattern:
    return next(p for p in patterns_of(made) if (p.effect, p.joint) == (effect, joint))


def with_friction(made: Geometry, night: Night, joint: int, share: float) -> Night:
    pattern = friction(made, joint)
    assert pattern.scale is not None
    return replace(night, values=night.values + share * pattern.scale * pattern.directions[:, 0])


def blind(nights: list[Night]) -> list[Night]:
    return [replace(night, celsius=None) for night in nights]


@pytest.mark.parametrize("measured", [False, True])
def test_scores_are_standard_normal_where_the_prior_is_true(measured: bool) -> None:
    """From the second night on: deviations, means and slopes drawn as the prior has them."""
    rng = np.random.default_rng(1)
    charts, nights = 6000, 14
    more = rng.uniform(size=charts) < 0.45 / (0.45 + 1.5)
    size = np.abs(rng.normal(size=charts))
    sigma = 3.0 * np.exp(np.where(more, 0.45 * size, -1.5 * size))
    slope = rng.normal(-1.0, 0.5, charts)
    warm = rng.normal(0.0, 2.0, (nights, 1)) + np.zeros(charts)
    series = 7.0 + sigma * rng.normal(size=(nights, charts)) + (slope * warm if measured else 0.0)
    prior = ChartPrior(np.full(charts, 3.0), np.zeros(charts), np.full(charts, -1.0), np.full(charts, 0.5))
    if not measured:
        prior = replace(prior, slope=np.zeros(charts), slope_sigma=np.zeros(charts))
    found = predict(series, warm if measured else None, np.ones(nights, dtype=bool), prior)
    assert np.isnan(found.scores[0]).all()
    for night in (1, 3, 8, 13):
        assert stats.kstest(found.scores[night], "norm").pvalue > 0.01
        assert np.mean(np.abs(found.scores[night]) > 2.576) == pytest.approx(0.01, abs=0.005)


def test_without_a_prior_the_predictions_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    celsius = rng.normal(20.0, 3.0, 12)
    series = rng.normal(size=12) - 0.8 * celsius
    clean = np.ones(12, dtype=bool)
    clean[5] = False
    one = np.ones(1)
    found = predict(
        series[:, np.newaxis], celsius[:, np.newaxis], clean, ChartPrior(one, 0 * one, 0 * one, 1e6 * one)
    )
    before = np.flatnonzero(clean[:11])
    fit = sm.OLS(series[before], sm.add_constant(celsius[before])).fit()
    last = np.array([1.0, celsius[11]])
    assert found.error[11, 0] == pytest.approx(float(series[11] - last @ fit.params), rel=1e-6)
    leverage = float(last @ fit.normalized_cov_params @ last)
    heaviest = int(np.argmax(found.last.weights))
    widening = found.last.sigma[0, heaviest] / np.exp(_FACTOR[heaviest])
    assert widening == pytest.approx(np.sqrt(1.0 + leverage), rel=1e-6)
    assert found.slope[0] == pytest.approx(float(fit.params[1]), rel=1e-6)


def test_what_is_allowed_has_the_score_of_the_limit() -> None:
    rng = np.random.default_rng(3)
    prior = ChartPrior(np.array([2.0]), np.zeros(1), np.zeros(1), np.zeros(1))
    series = rng.normal(0.0, 2.0, (20, 1))
    clean = np.ones(20, dtype=bool)
    found = predict(series, None, clean, prior)
    series[-1] += found.allowed(4.0)[0] - found.error[-1, 0]
    assert predict(series, None, clean, prior).scores[-1, 0] == pytest.approx(4.0, abs=1e-6)


def test_a_prior_is_forgotten_and_never_below_its_least() -> None:
    rng = np.random.default_rng(4)
    series = rng.normal(0.0, 0.2, (61, 2))
    prior = ChartPrior(np.array([3.0, 3.0]), np.array([0.0, 1.0]), np.zeros(2), np.zeros(2))
    found = predict(series, None, np.ones(61, dtype=bool), prior)
    assert found.sigma[0] == pytest.approx(0.2, rel=0.25)
    assert found.interval[0, 0] < series[:-1, 0].std(ddof=1) < found.interval[1, 0]
    assert found.sigma[1] == pytest.approx(3.0)


def test_the_prior_of_an_arm_is_that_of_its_friction(made: Geometry) -> None:
    patterns = with_warmth(patterns_of(made), SETTINGS)
    assert patterns[-1].effect == WARMTH and patterns[-1].units == ("K",)
    prior = prior_of(patterns, made, False, SETTINGS)
    assert np.linalg.eigvalsh(prior.covariance).min() > 0.0
    np.testing.assert_allclose(prior.warmth, patterns[-1].directions[:, 0])
    np.testing.assert_allclose(prior.slope, -prior.warmth)
    assert (prior.unmeasured, prior_of(patterns, made, True, SETTINGS).unmeasured) == (5.0, 3.0)
    place = made.base.names.index("Fc2")
    share = np.sqrt(prior.covariance[place, place]) / abs(made.beta[place])
    # 5 K of the hall at 0.5 ± 0.5 %/K, and 2 K of the gear's own.
    assert share == pytest.approx(0.01 * np.hypot(np.hypot(2.5, 2.5), 1.0), rel=0.02)
    found = np.diag(np.full(made.beta.size, 7.0))
    hall = prior.hall
    assert hall[place, place] == pytest.approx(25.0 * 2 * (0.005 * made.beta[place]) ** 2)
    prior = prior_of(patterns, made, True, SETTINGS)
    assert not prior.hall.any()
    assert posterior_covariance(prior, None, 0, 30) is prior.covariance
    half = (0.5 * NIGHTS * prior.covariance + 15 * found) / (0.5 * NIGHTS + 15)
    np.testing.assert_allclose(posterior_covariance(prior, found, 15, 30), half)
    np.testing.assert_array_equal(posterior_covariance(prior, found, 30, 30), found)
    without = replace(prior, hall=hall)  # a few weeks do not show a year
    np.testing.assert_allclose(posterior_covariance(without, found, 30, 30), found + hall)


def test_tonight_is_compared_at_its_temperature_with_the_leverage_of_that(made: Geometry) -> None:
    """Least squares of statsmodels with a row for what the prior says of the slope."""
    nights = draw_nights(made, 25, 5)
    assert nights[-1].celsius is not None
    nights[-1] = replace(nights[-1], celsius=nights[-1].celsius - 12.0)
    nights[7] = replace(nights[7], clean=False, values=nights[7].values + 1e6)
    series = Series.of(nights[0], nights[1:])
    usual = expected_of(series, made, SETTINGS)
    celsius = series.mean_celsius()
    assert celsius is not None
    taught = np.flatnonzero(series.clean)
    assert 7 not in taught and 24 not in taught
    weight = NIGHTS * SETTINGS.thermometer_sigma**2
    apart = celsius - celsius[taught].mean()
    design = np.column_stack([np.ones(taught.size), apart[taught]])
    design = np.vstack([design, [0.0, np.sqrt(weight)]])
    tonight = np.array([1.0, apart[-1]])
    place = made.base.names.index("Fv3")
    y = np.append(series.values[taught, place], np.sqrt(weight) * usual.prior.slope[place])
    fit = sm.OLS(y, design).fit()
    assert usual.slopes[place] == pytest.approx(float(fit.params[1]), rel=1e-9)
    assert usual.tonight[place] == pytest.approx(
        float(series.values[-1, place] - tonight @ fit.params), rel=1e-9
    )
    assert usual.leverage == pytest.approx(float(tonight @ fit.normalized_cov_params @ tonight), rel=1e-9)
    found = compare(nights[0], nights[1:], made)
    assert found.between_runs is not None
    assert found.between_runs.df == (made.beta.size, taught.size + NIGHTS - 1)
    d = usual.tonight
    statistic = d @ np.linalg.solve(usual.spread * (1.0 + usual.leverage), d) / d.size
    assert found.between_runs.statistic == pytest.approx(float(statistic), rel=1e-4)


def test_a_thermometer_may_be_wrong(made: Geometry) -> None:
    """What 3 K make of the parameters is in the covariance of a night, whatever the nights showed."""
    nights = draw_nights(made, 40, 6, between=1e-4)
    usual = expected_of(Series.of(nights[0], nights[1:]), made, SETTINGS)
    doubled = replace(SETTINGS, thermometer_sigma=6.0)
    other = expected_of(Series.of(nights[0], nights[1:]), made, doubled)
    assert usual.slopes[made.base.names.index("Fv2")] == pytest.approx(
        -0.01 * made.beta[made.base.names.index("Fv2")], rel=0.15
    )
    by_thermometer = 36.0 * np.outer(other.slopes, other.slopes) - 9.0 * np.outer(usual.slopes, usual.slopes)
    np.testing.assert_allclose(other.spread - usual.spread, by_thermometer, atol=1e-9)


@pytest.mark.parametrize("night", [1, 8, 20])
def test_friction_of_one_joint_is_no_warmth_while_the_arm_is_being_learned(
    made: Geometry, night: int
) -> None:
    """+ 30 % on drive 2: more than unmeasured warmth makes of one joint; doubtful, and no lesson."""
    nights = draw_nights(made, night + 1, 7, per_kelvin=-0.005)
    nights[-1] = with_friction(made, nights[-1], 2, 0.30)
    found = compare(blind(nights)[0], blind(nights)[1:], made)
    assert (found.state, found.stage, found.doubtful) == ("changed", "learning", True)
    assert found.sentence.startswith("Coulomb friction of joint 2 +")
    assert "would need 15 K colder at least; no thermometer" in found.sentence
    assert "warmth may be all of it" in found.sentence and found.changes[0].kelvin == pytest.approx(
        15, abs=1.5
    )
    measured = compare(nights[0], nights[1:], made)
    assert measured.state == "changed" and not measured.doubtful
    assert measured.colder is not None and "the thermometer says" in measured.sentence
    for colder, said in (
        (8.0, "at least, beyond the 8 K colder that the thermometer says)"),
        (-8.0, "at least; the thermometer says 8 K warmer)"),
        (0.3, "at least; the thermometer says 0 K colder)"),
    ):
        assert _warmth_words(measured.changes[0], replace(measured, colder=colder)).endswith(said)
    first = blind(nights)[0]
    without = compare(first, nights[1:], made)  # as after a baseline that nobody told the temperature of
    assert without.doubtful and f"the temperature of {label_of(first)} is not known" in without.sentence
    nights[-1] = with_friction(made, nights[-1], 2, 0.60)
    assert not compare(blind(nights)[0], blind(nights)[1:], made).doubtful  # no hall makes + 90 %


def test_a_cold_hall_that_nobody_measured_is_no_fault(made: Geometry) -> None:
    """All gears together, as far as halls differ; farther it is said of all gears, and never a failure."""
    joints = [name for name in made.base.names if name.startswith("F")]
    share = np.array([{"Fc": 0.005, "Fv": 0.015}.get(name[:2], 0.0) for name in made.base.names])
    assert len(joints) >= 12
    for kelvin, state in ((8.0, "unchanged"), (45.0, "changed")):
        nights = draw_nights(made, 6, 8, per_kelvin=0.0)
        nights[-1] = replace(nights[-1], values=nights[-1].values + kelvin * share * made.beta)
        found = compare(blind(nights)[0], blind(nights)[1:], made)
        assert found.state == state, found.sentence
        if state == "changed":
            assert found.doubtful and found.changes[0].effect == WARMTH
            assert (
                found.sentence.startswith("all gears as if colder +4")
                and "(no thermometer)" in found.sentence
            )


def test_what_is_forgiven_is_told_and_shrinks(made: Geometry) -> None:
    def usual(count: int, measured: bool) -> dict[str, tuple[float, ...]]:
        nights = draw_nights(made, count, 9, per_kelvin=-0.008)
        found = compare(nights[0], (nights if measured else blind(nights))[1:], made)
        return {
            one.chart: (one.prior_sigma, one.sigma, one.low, one.high, one.forgiven, one.per_kelvin or 0.0)
            for one in found.usual
        }

    chart = "Coulomb friction of joint 2"
    prior, sigma, low, high, forgiven, _ = usual(2, False)[chart]
    assert low < sigma < high and sigma == prior and forgiven > 4 * sigma
    later = usual(60, True)[chart]
    assert later[1] < 0.6 * sigma and later[4] < 0.5 * forgiven and later[3] / later[2] < 0.7 * high / low
    assert later[5] == pytest.approx(-0.8, abs=0.3)  # percent per kelvin
    gains: FloatArray = np.array([one[4] for name, one in usual(60, True).items() if "gain" in name])
    assert (gains < 1.0).all()


def test_covariance_within_is_that_of_a_run(made: Geometry) -> None:
    nights = draw_nights(made, 3, 10)
    usual = expected_of(Series.of(nights[0], nights[1:]), made, SETTINGS)
    np.testing.assert_allclose(usual.within, covariance_within(made))
    np.testing.assert_allclose(usual.spread, usual.within + usual.prior.covariance)


def test_what_a_gears_own_warmth_makes_is_not_worth_a_word(made: Geometry) -> None:
    """However sure it is: up to 1 % of Coulomb friction with a thermometer, to 5.1 % without."""
    for measured, share, state in (
        (True, 0.009, "unchanged"),
        (True, 0.015, "changed"),
        (False, 0.045, "unchanged"),
        (False, 0.06, "changed"),
    ):
        nights = draw_nights(made, 60, 11, between=3e-4, per_kelvin=0.0)
        if not measured:
            nights = blind(nights)
        else:
            nights = [
                replace(night, celsius=np.full(made.joints, 20.0 + k % 7)) for k, night in enumerate(nights)
            ]
        for k in range(50, 60):
            nights[k] = replace(with_friction(made, nights[k], 2, share), clean=False)
        found = compare(nights[0], nights[1:], made)
        assert found.state == state, found.sentence


def test_an_alarm_of_the_coupled_shaft_is_not_that_of_its_joint(made: Geometry) -> None:
    charts = {p.words for p in patterns_of(made)}
    assert {"viscous friction of joint 6", "viscous friction of joint 6 (coupled shaft)"} <= charts
    pattern = next(p for p in patterns_of(made) if p.words == "viscous friction of joint 6 (coupled shaft)")
    assert pattern.scale is not None
    nights = draw_nights(made, 40, 12)
    moved = nights[-1].values + 0.4 * pattern.scale * pattern.directions[:, 0]
    nights[-1] = replace(nights[-1], values=moved)
    found = compare(nights[0], nights[1:], made)
    assert found.course is not None and found.course.chart == pattern.words == found.changes[0].words


def test_what_is_forgiven_is_where_the_alarm_begins(made: Geometry) -> None:
    """A single joint's friction on the third night: by size while little is known."""
    nights = blind(draw_nights(made, 3, 13, per_kelvin=0.0))
    quiet = compare(nights[0], nights[1:], made)
    chart = "Coulomb friction of joint 2"
    (usual,) = (one for one in quiet.usual if one.chart == chart)
    pattern = friction(made, 2)
    assert pattern.scale is not None
    torque = made.torque_rms(pattern.directions[:, 0] * pattern.scale) / made.torque_rms(made.beta)
    for tolerance, by_size in ((0.05, False), (0.02, True)):
        settings = replace(SETTINGS, tolerance=tolerance)
        (usual,) = (o for o in compare(nights[0], nights[1:], made, settings).usual if o.chart == chart)
        for factor, state in ((0.9, "unchanged"), (1.1, "changed")):
            last = with_friction(made, nights[-1], 2, factor * usual.forgiven / 100.0)
            found = compare(nights[0], [*nights[1:-1], last], made, settings)
            assert found.state == state, (tolerance, factor, found.sentence)
        assert (usual.forgiven / 100.0 * torque.max() < 2.0 * tolerance) or not by_size
        assert any(alarm.detector == "size" for alarm in found.alarms) == by_size
