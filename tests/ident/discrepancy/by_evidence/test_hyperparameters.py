"""Each figure that the evidence goes by does what the page says of it: a wrong one is noticed here."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import robots
from ident import Recording, RegressorModel
from ident.discrepancy.by_evidence.accepted import RUN_TO_RUN, accepted_prior, prior_by_evidence
from ident.discrepancy.by_evidence.confirm.held_out import Confirmation
from ident.discrepancy.by_evidence.decide.names import (
    NOTHING,
    Named,
    Slot,
    as_limit,
    probabilities,
    smallest,
)
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.decide.problem import misfit_basis, pose
from ident.discrepancy.by_evidence.decide.state import Found, Member
from ident.discrepancy.by_evidence.evidence.gram import Level, Posterior
from ident.discrepancy.by_evidence.evidence.kappa import Misfit
from ident.discrepancy.by_evidence.evidence.known import known_columns
from ident.discrepancy.by_evidence.evidence.noise import Noise, autoregressive
from ident.discrepancy.by_evidence.evidence.prepared import prepare, settings_for
from ident.discrepancy.by_evidence.library.candidates import candidates
from ident.discrepancy.by_evidence.report.answer import (
    TOO_POOR,
    WORSE,
    EvidenceFinding,
    JointMisfit,
    verdict_of,
)
from ident.discrepancy.by_evidence.taken import basis_of
from ident.discrepancy.confirmation import Shown
from ident.discrepancy.prior import described_prior
from ident.effects.vocabulary import VOCABULARY
from ident.parameters.base import base_parameters
from ident.parameters.present import Present
from ident.signals import low_pass
from robots.description import Robot

EMPS = robots.load("emps")
PLACED: Any = SimpleNamespace(name="a", place=SimpleNamespace(joints=(0,)))


def log(periods: int = 3, rate: float = 1000.0, seed: int = 0) -> Recording:
    """One axis over a motion with a kink where its period ends, and noise."""
    random = np.random.default_rng(seed)
    time = np.arange(round(4.0 * periods * rate)) / rate
    phase = time % 4.0
    reference = 0.1 * np.sin(np.pi * phase / 4.0)[:, np.newaxis]
    position = reference + 1e-6 * random.normal(size=reference.shape)
    signal = 0.3 * np.cos(np.pi * phase / 4.0)[:, np.newaxis] + 0.01 * random.normal(size=reference.shape)
    return Recording("log", time, reference, position, signal)


def arm(recording: Recording) -> Robot:
    return settings_for(EMPS, recording)


def test_rows_are_at_125_hz_below_a_cutoff_that_leaves_nothing_to_fold() -> None:
    robot = arm(log())
    assert robot.identification.decimation == 8
    assert robot.identification.cutoff_hz == pytest.approx(0.4 * 125.0)
    slow = EMPS.model_copy(
        update={"identification": EMPS.identification.model_copy(update={"cutoff_hz": 20.0})}
    )
    assert settings_for(slow, log()).identification.cutoff_hz == 20.0


def test_rows_near_a_standstill_are_left_out() -> None:
    recording = log()
    data = prepare(arm(recording), [recording])
    slow = np.abs(data.parts[0].own.velocity[:, 0]) <= 0.01 * EMPS.velocity_limits[0]
    time = data.parts[0].own.time
    assert time is not None
    for instant in time[slow]:
        near = np.abs(time - instant)
        assert not data.used[near < 0.072, 0].any()
    assert 0.6 < data.used.mean() < 0.97


@pytest.mark.parametrize("cutoff", [10.0, 15.0, 50.0])
def test_rows_are_left_out_until_the_filter_shows_what_a_reversal_does(cutoff: float) -> None:
    """Clean logs behind 15 Hz had a static friction of its ringing in seven of seven, not confirmed."""
    given = EMPS.identification.model_copy(update={"cutoff_hz": cutoff, "standstill_margin": 0.0})
    settings = settings_for(EMPS.model_copy(update={"identification": given}), log()).identification
    assert settings.standstill_margin >= 0.08
    time = 0.001 * np.arange(-2000, 2000)
    sign = np.where(time < 0.0, -1.0, 1.0)[:, np.newaxis]
    seen = low_pass(sign, settings.cutoff_hz, 0.001, settings.filter_order)[:, 0]
    behind = (time > settings.standstill_margin) & (time < 1.0)
    assert np.abs(seen[behind] - 1.0).max() < 0.012
    if settings.standstill_margin > 0.08:
        half = (time > 0.5 * settings.standstill_margin) & (time < 1.0)
        assert np.abs(seen[half] - 1.0).max() > 0.03


def test_the_other_periods_are_not_spoiled_by_the_ends_of_the_record() -> None:
    recording = log()
    part = prepare(arm(recording), [recording]).parts[0]
    assert part.period == 500
    apart = np.abs(part.own.acceleration - part.at_rows.acceleration)
    assert apart[part.used].max() < 8.0 * np.median(apart) + 0.02


def test_slow_changes_of_friction_are_no_noise_and_noise_of_speed_is() -> None:
    recording = log()
    data = prepare(arm(recording), [recording])
    own = data.parts[0].own
    assert own.time is not None
    drifting = np.sign(own.velocity) * np.exp(-own.time / 5.0)[:, np.newaxis]
    assert np.std(data.not_repeating(drifting)[data.used]) < 0.02 * np.std(drifting[data.used])
    noise = np.random.default_rng(1).normal(size=drifting.shape)
    assert np.std(data.not_repeating(noise)) == pytest.approx(1.0, rel=0.1)


def test_the_lag_and_the_gains_are_known_as_well_as_the_page_says() -> None:
    recording = log()
    robot = arm(recording)
    lag_known = robot.identification.model_copy(update={"control_signal_lag": 0.0005})
    robot = robot.model_copy(update={"identification": lag_known})
    base = base_parameters(RegressorModel.of(robot))
    prior, data = described_prior(base), prepare(robot, [recording])
    present = Present(base.model, base.model.prior())
    start = base.regroup(base.model.prior())
    known, beta = known_columns(data, base, prior, start, present)
    part = data.parts[0]
    rate = CubicSpline(part.other.time, present.torque(part.other)[:, 0])(part.other.time, 1)[:: part.finer]
    lags = known.columns[:, 0, beta.count :]
    assert lags[:, 0] == pytest.approx(5e-5 * rate)
    assert lags[:, 1] == pytest.approx(3e-5 * rate)
    assert part.finer == 2
    course = CubicSpline(part.other.time, present.torque(part.other)[:, 0])
    assert lags[:, 2] == pytest.approx(1e-7 * course(part.other.time, 2)[:: part.finer])
    uncertain = robot.drive[0].gain_relative_uncertainty
    torque = present.torque(part.other)[:: part.finer]
    assert lags[:, 3] == pytest.approx(uncertain * torque[:, 0])
    unknown = robot.model_copy(
        update={
            "identification": robot.identification.model_copy(
                update={"control_signal_lag": 0.0, "control_signal_reading": "averaged"}
            )
        }
    )
    free, _ = known_columns(replace(data, robot=unknown), base, prior, start, present)
    ratio = np.linalg.norm(free.columns[:, 0, beta.count]) / np.linalg.norm(lags[:, 0])
    assert ratio == pytest.approx(1e-3 / 5e-5)


def test_misfit_is_likeliest_as_accepted_and_half_as_likely_a_factor_of_e_away() -> None:
    misfit = Misfit(np.array([0.02]), np.array([5.0]))
    one = np.ones(1)
    assert misfit.log_prior(Level(0.02 * one, one)) == 0.0
    assert misfit.log_prior(Level(0.02 * np.e * one, one)) == pytest.approx(-np.log(2.0))
    assert misfit.log_prior(Level(0.02 * one, np.e * one)) == pytest.approx(-np.log(2.0))
    grid = misfit.grid(0)
    assert grid[0] == pytest.approx(0.002)
    assert grid[-1] == pytest.approx(5.0)
    assert grid[1] / grid[0] < 2.0


def test_no_course_of_the_misfit_is_likelier_than_another() -> None:
    """Splines over speed and over position both sum up to the direction of motion: once is enough."""
    recording = log()
    data = prepare(arm(recording), [recording])
    (basis,) = misfit_basis(data, Present(base := RegressorModel.of(EMPS), base.prior()))
    inside = basis[data.used[:, 0]]
    assert 15 < basis.shape[1] < 60
    assert inside.T @ inside / inside.shape[0] == pytest.approx(np.eye(basis.shape[1]), abs=1e-9)
    direction = np.sign(data.parts[0].at_rows.velocity[data.used[:, 0], 0])
    direction -= direction.mean()
    weights = np.linalg.lstsq(inside, direction, rcond=None)[0]
    assert np.linalg.norm(inside @ weights - direction) < 0.2 * np.linalg.norm(direction)


def test_an_autoregressive_noise_is_found_and_its_size() -> None:
    random = np.random.default_rng(2)
    series = np.zeros(4000)
    for k in range(2, series.size):
        series[k] = 0.6 * series[k - 1] - 0.3 * series[k - 2] + 0.1 * random.normal()
    noise = autoregressive(series, np.zeros(4000, dtype=np.int64), np.ones(4000, dtype=np.bool_))
    assert noise.coefficients[:2] == pytest.approx([0.6, -0.3], abs=0.06)
    assert noise.deviation == pytest.approx(0.1, rel=0.05)
    assert noise.marginal == pytest.approx(series.std(), rel=0.05)
    assert Noise(np.zeros(0), 0.3).marginal == pytest.approx(0.3)


def member(share: float, volume: float = 0.0) -> Member:
    candidate: Any = SimpleNamespace(share=share, key=("a", (0,)))
    return Member(SimpleNamespace(candidate=candidate), volume)  # type: ignore[arg-type]


def test_a_set_weighs_its_evidence_coarsened_and_its_prior() -> None:
    nothing = Posterior(0.0, np.zeros(0), np.zeros(0), np.zeros((0, 0)))
    one = Found((member(0.01, -2.0),), Level(np.ones(1), np.ones(1)), 30.0, nothing)
    assert one.log_evidence == 28.0
    assert one.log_posterior == pytest.approx(0.5 * 28.0 + np.log(0.2 * 0.01))


def test_the_prior_is_equal_per_name_and_divided_among_places_and_forms() -> None:
    robot = robots.load("tx40")
    found = candidates(robot, VOCABULARY)
    assert sum(one.share for one in found) == pytest.approx(1.0)
    shares = {one.key: 0.0 for one in found}
    for one in found:
        shares[one.key] += one.share
    for family in VOCABULARY:
        own = [share for (name, _), share in shares.items() if name == family.name]
        assert sum(own) == pytest.approx(1.0 / len(VOCABULARY))
        assert max(own) == pytest.approx(min(own))


def test_other_motion_shows_a_share_of_what_an_effect_changes() -> None:
    seen = Confirmation(100.0, 10.0, 80.0).shown
    assert (seen.share, seen.sigma) == (pytest.approx(0.9), pytest.approx(0.05))
    assert Confirmation(100.0, 10.0, -100.0).shown.share == 0.0
    assert Confirmation(0.0, 0.0, 0.0).shown == Shown(0.0, 0.0)


def test_the_reported_set_holds_95_percent() -> None:
    names = tuple(Named(str(k), (), p) for k, p in enumerate((0.6, 0.34, 0.02, 0.04)))
    assert len(smallest(names)) == 3
    assert len(smallest((Named("a", (), 0.951), Named("b", (), 0.049)))) == 1
    both = probabilities({("a", ()): 2.0, ("b", ()): 0.0})
    assert both[0].probability == pytest.approx(1.0 / (1.0 + np.exp(-2.0)))


def test_the_likeliest_name_stands_for_the_forms_that_contain_it_at_its_place() -> None:
    dry, falling, other = (
        Named("coulomb_friction", (1,), 0.5, log_odds=3.0),
        Named("stribeck_friction", (1,), 0.3, log_odds=2.0),
        Named("stribeck_friction", (2,), 0.15),
    )
    nothing, unknown = Named(*NOTHING, 0.05), Named(NO_NAME, (1,), 0.1)
    first, *rest = as_limit((dry, falling, other, nothing))
    assert first.key == dry.key and first.probability == pytest.approx(0.8)
    assert rest == [other, nothing] and first.forms == ()
    likelier = replace(falling, probability=0.6)
    assert as_limit((likelier, dry, nothing)) == (likelier, dry, nothing)
    assert as_limit((replace(nothing, probability=0.9), dry, falling))[0].probability == 0.9
    assert as_limit((unknown, dry, falling))[0].probability == pytest.approx(0.8)
    assert as_limit((dry, falling, other, nothing), apart=[falling.key]) == (dry, falling, other, nothing)


def test_a_limit_that_is_shown_says_the_probability_of_the_forms_that_it_stands_for() -> None:
    """And stays beside those that are likelier than itself: it is not named alone."""
    dry, falling = (
        Named("coulomb_friction", (1,), 0.3, PLACED, 2.0),
        Named("stribeck_friction", (1,), 0.65, PLACED, 3.0),
    )
    names = Slot(as_limit((falling, dry, Named(*NOTHING, 0.05)), dry.key))
    assert names.names[0].key == dry.key and names.probability(dry.key) == pytest.approx(0.95)
    assert names.names[0].forms == (falling,) and names.probability(falling.key) == 0.0
    basis = basis_of(dry.key, names)
    assert basis.probability == pytest.approx(0.3) and basis.p_value == pytest.approx(0.05)
    assert [(one.name, one.probability) for one in basis.held] == [
        ("stribeck_friction", 0.65),
        ("coulomb_friction", pytest.approx(0.3)),
    ]
    assert [one.effect for one in basis.indistinguishable_from] == ["stribeck_friction"]
    assert basis_of(dry.key, Slot((replace(dry, probability=0.95),))).indistinguishable_from == ()


@pytest.mark.parametrize("known", [False, True])
def test_what_is_fitted_has_columns_of_the_other_periods(known: bool) -> None:
    """Beside the sample's own motion an effect, which is made of the others', makes up for a fit's bias."""
    recording = log()
    robot = arm(recording)
    base, data = base_parameters(RegressorModel.of(robot)), prepare(arm(recording), [recording])
    start = base.regroup(base.model.prior())
    present = Present(base.model, base.model.prior())
    prior = accepted_prior(start, np.diag(1e-4 * start**2)) if known else None
    found, beta = known_columns(data, base, prior, start, present)
    own, others = base.columns(data.parts[0].own), base.columns(data.parts[0].at_rows)
    assert np.abs(own - others).max() > 0.0
    assert found.columns[:, :, : start.size] == pytest.approx(others @ beta.spread)
    assert found.target == pytest.approx(data.torque - own @ start)


def finding(
    probability: float, explains: float, left: float, unknown: float = 0.0, fails: str = ""
) -> EvidenceFinding:
    names = (
        Named("a", (0,), probability, PLACED),
        Named("b", (0,), 1.0 - probability - unknown, PLACED),
        Named(NO_NAME, (0,), unknown),
    )
    return EvidenceFinding(PLACED, names, (), "", Confirmation(50.0, 5.0, 49.0), explains, left, fails)


def joint(above: float) -> JointMisfit:
    return JointMisfit(1, 0.1, 0.1, 0.1, 0.1, above)


def test_the_verdict_follows_from_probability_confirmation_and_misfit() -> None:
    quiet, loud = (joint(0.05),), (joint(0.2),)
    assert verdict_of((finding(0.91, 1.0, 0.0),), 0.0, quiet) == "named"
    assert verdict_of((finding(0.89, 1.0, 0.0),), 0.0, quiet) == "unnamed"
    assert verdict_of((finding(0.91, 1.0, 1.1),), 0.0, quiet) == "unnamed"
    assert verdict_of((finding(0.91, 1.0, 0.0, fails="it fails"),), 0.0, quiet) == "not_confirmed"
    assert verdict_of((), 0.91, quiet) == "clean"
    assert verdict_of((), 0.89, quiet) == "unnamed"
    assert verdict_of((), 0.91, loud) == "unnamed"


def test_what_may_have_no_name_is_not_confirmed() -> None:
    """However the names share out what is left."""
    assert finding(0.5, 1.0, 0.0, unknown=0.09).held_up
    doubted = finding(0.5, 1.0, 0.0, unknown=0.11)
    assert not doubted.held_up and doubted.no_name == 0.11
    assert doubted.doubt == (
        "recordings that were not fitted show 99 ± 5 % of it; something that has no name is there with"
        " probability 0.11"
    )


def test_another_name_in_its_place_does_no_worse_than_no_effect_for_what_its_own_does() -> None:
    """A power of the speed with 1.00 in the loop had stood for Coulomb friction that other motion refuted."""
    worse, poor = (finding(0.95, 1.0, 0.0, fails=how) for how in (WORSE, TOO_POOR))
    assert worse.doubt == WORSE and worse.doubt_of(("b", (0,))) == ""
    assert poor.doubt == poor.doubt_of(("b", (0,))) == TOO_POOR


def test_an_accepted_model_is_widened_by_what_differs_from_run_to_run() -> None:
    assert RUN_TO_RUN == 0.002
    recording = log()
    base = base_parameters(RegressorModel.of(arm(recording)))
    problem = pose(base, None, prepare(arm(recording), [recording]), None)
    prior = prior_by_evidence(base, [recording])
    noise = problem.rows.noise[0].marginal
    assert problem.misfit.accepted == pytest.approx(0.5 * noise, rel=0.2)
    assert prior.misfit == pytest.approx(np.maximum(problem.level.kappa, 0.3 * noise))
    spread = np.diag(prior.covariance) - np.diag(problem.beta.covariance(problem.posterior.covariance))
    # The prior counts by T with the rows; what runs differ by is to count in full.
    assert spread == pytest.approx(0.5 * (0.002 * prior.values) ** 2, rel=1e-3, abs=1e-12)
