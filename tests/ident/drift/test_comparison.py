"""What a comparison says of arms whose change is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident import IdentificationError
from ident.drift import DriftSettings, Geometry, Night, Pattern, compare, patterns_of
from ident.drift.charts import budget_per_night, cusum, normal_scores, one_night_threshold, trend_threshold
from ident.drift.run_to_run import recursive_residuals
from robots.arrays import FloatArray
from tests.ident.drift.arms_of_nights import draw_nights, geometry

NIGHTS = 50


@pytest.fixture(scope="module")
def made() -> Geometry:
    return geometry()


def pattern(made: Geometry, effect: str, joint: int | None) -> Pattern:
    return next(p for p in patterns_of(made) if (p.effect, p.joint) == (effect, joint))


def change_of(made: Geometry, effect: str, joint: int | None, amount: float) -> FloatArray:
    return np.asarray(pattern(made, effect, joint).directions[:, 0] * amount)


@pytest.mark.parametrize(
    ("effect", "joint", "amount"),
    [
        ("coulomb_friction", 2, 0.4),
        ("viscous_friction", 4, -0.1),
        ("current_offset", 3, 0.1),
        ("rotor_inertia", 5, 0.05),
        ("drive_gain_error", 3, 0.03),
        ("drive_gain_error", 5, -0.03),
        ("payload", None, 0.2),
    ],
)
def test_a_step_is_named_at_its_joint(made: Geometry, effect: str, joint: int | None, amount: float) -> None:
    nights = draw_nights(made, NIGHTS, 1, change=change_of(made, effect, joint, amount), first=47)
    found = compare(nights[0], nights[1:], made)
    assert found.state == "changed" and found.stage == "watching"
    assert found.alarms
    first = found.changes[0]
    assert (first.effect, first.joint) == (effect, joint)
    wanted = 1 / (1 + amount) - 1 if effect == "drive_gain_error" else amount
    assert first.size == pytest.approx(wanted, abs=5 * first.sigma)
    assert found.since is not None and found.since.index == 47
    assert first.words in found.sentence and "night 47" in found.sentence
    assert found.unexplained is not None and found.unexplained.p_value > 1e-4


def test_a_slow_ramp_is_called_one(made: Geometry) -> None:
    change = change_of(made, "coulomb_friction", 2, 0.4)
    nights = draw_nights(made, 60, 2, change=change, first=40, ramp=True)
    found = compare(nights[0], nights[1:], made)
    assert found.since is not None and found.since.shape == "ramp"
    assert abs(found.since.index - 40) <= 4
    assert found.changes[0].words == "Coulomb friction of joint 2"
    assert found.changes[0].size == pytest.approx(0.4, abs=0.05)


def test_nothing_is_found_where_nothing_changed(made: Geometry) -> None:
    nights = draw_nights(made, 90, 3)
    states = [compare(nights[0], nights[1:k], made).state for k in range(3, 91, 2)]
    assert states.count("changed") == 0


def test_what_is_sure_and_too_small_is_not_told(made: Geometry) -> None:
    change = change_of(made, "coulomb_friction", 2, 0.5)
    nights = draw_nights(made, NIGHTS, 1, change=change, first=44)
    assert compare(nights[0], nights[1:], made).state == "changed"
    deaf = DriftSettings(negligible=0.5)
    assert compare(nights[0], nights[1:], made, deaf).state == "unchanged"


def test_the_tolerance_divides_warnings_from_failures(made: Geometry) -> None:
    change = change_of(made, "coulomb_friction", 2, 0.5)
    nights = draw_nights(made, NIGHTS, 1, change=change, first=44)
    found = compare(nights[0], nights[1:], made)
    share = (found.torque_change / found.torque_rms).max()
    np.testing.assert_allclose(found.torque_change, made.torque_rms(change), rtol=0.2, atol=0.15)
    assert not compare(nights[0], nights[1:], made, DriftSettings(tolerance=share * 1.1)).large
    assert compare(nights[0], nights[1:], made, DriftSettings(tolerance=share * 0.9)).large


def test_while_learning_only_large_changes_are_told(made: Geometry) -> None:
    small = change_of(made, "coulomb_friction", 2, 0.1)
    large = change_of(made, "drive_gain_error", 3, 0.2)
    for change, state in ((small, "unchanged"), (large, "changed")):
        nights = draw_nights(made, 5, 4, change=change, first=4)
        found = compare(nights[0], nights[1:], made)
        assert (found.stage, found.state) == ("learning", state)
        assert found.wald.p_value < 1e-6  # run-to-run variation alone does that
    assert found.changes[0].words == "drive gain of joint 3"


def test_while_learning_warmth_is_no_change_and_more_than_warmth_is(made: Geometry) -> None:
    """Five nights in, 10 K colder: friction higher by 1.5 % a kelvin is no news, by 9 % a kelvin it is."""
    friction = np.array([name.startswith("F") for name in made.base.names])
    usual = made.torque_rms(made.beta)
    for per_kelvin, state in ((0.015, "unchanged"), (0.09, "changed")):
        change = made.beta * friction * 10.0 * per_kelvin
        assert (made.torque_rms(change) > DriftSettings().tolerance * usual).any()
        nights = draw_nights(made, 5, 4, change=change, first=4, per_kelvin=0.0)
        assert nights[0].celsius is not None
        nights[-1] = replace(nights[-1], celsius=nights[0].celsius - 10.0)
        found = compare(nights[0], nights[1:], made)
        assert (found.stage, found.state) == ("learning", state)
        assert found.large == (state == "changed")
        blind = [replace(night, celsius=None) for night in nights]
        assert compare(blind[0], blind[1:], made).state == state


def test_temperature_is_no_change(made: Geometry) -> None:
    """A cold night beyond those seen so far: alarms without the temperatures, none with them."""
    nights = draw_nights(made, NIGHTS, 5)
    cold = draw_nights(made, NIGHTS, 5, per_kelvin=-0.01)[-1]
    friction = np.array([name.startswith("F") for name in made.base.names])
    shifted = cold.values + made.beta * friction * 0.3
    assert cold.celsius is not None
    nights[-1] = replace(cold, values=shifted, celsius=cold.celsius - 30.0)
    assert compare(nights[0], nights[1:], made).state == "unchanged"
    blind = [replace(night, celsius=None) for night in nights]
    assert compare(blind[0], blind[1:], made).state == "changed"


def test_a_changed_base_is_refused(made: Geometry) -> None:
    nights = draw_nights(made, 3, 6)
    short = Night(3.0, nights[0].values[:-1], nights[0].covariance[:-1, :-1], label="run 9")
    with pytest.raises(IdentificationError, match="run 9: 60 parameters; allowed: the 61 of the baseline"):
        compare(nights[0], [*nights[1:], short], made)
    with pytest.raises(IdentificationError, match="no night"):
        compare(nights[0], [], made)


def test_two_changes_are_both_named(made: Geometry) -> None:
    change = change_of(made, "coulomb_friction", 2, 0.2) + change_of(made, "payload", None, 0.3)
    nights = draw_nights(made, NIGHTS, 7, change=change, first=46)
    found = compare(nights[0], nights[1:], made)
    assert {c.words for c in found.changes} == {"Coulomb friction of joint 2", "payload on the tool"}


def test_false_alarms_of_the_charts_keep_the_budget() -> None:
    """300 arms for a year with 40 charts each; mean, slope and variance unknown.

    Half an alarm a year per arm, 0.2 of either kind: in 340 nights after learning 300 arms expect 56 each.
    """
    rng = np.random.default_rng(8)
    budget = budget_per_night(0.5, 365.0)
    one_night, trend = one_night_threshold(budget.one_night, 40), trend_threshold(budget.trend, 40)
    singles = trends = 0
    celsius = 22 + 6 * np.sin(np.arange(365) / 58) + rng.normal(0, 2, 365)
    for _ in range(6):
        series = rng.normal(size=(365, 50 * 40)) + 0.4 * celsius[:, np.newaxis]
        scores = normal_scores(recursive_residuals(series, celsius, np.ones(365, dtype=bool)))
        scores[:25] = np.nan
        singles += int((np.abs(scores[25:]) > one_night).sum())
        trends += sum(int((sums.max(axis=0) > trend).sum()) for sums in cusum(scores))
    assert 35 <= singles <= 80
    assert 25 <= trends <= 80
