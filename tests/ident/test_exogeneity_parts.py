"""The pieces of the revised test, against statsmodels or worked out by hand: freedom, limits, words."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats
from statsmodels.stats.multitest import multipletests

from ident.covariances import covariance_named
from ident.exogeneity import GateSettings, TestedRows, WhiteRows, augmented_wald, revised_test, textbook_test
from ident.exogeneity.hypothesis import annihilate, f_test, wald_statistic
from ident.exogeneity.instruments import _largest, instruments_gate
from ident.exogeneity.rank import rank_gate
from ident.exogeneity.relevance import conditional_f
from ident.exogeneity.revised import (
    _holm_limits,
    _say_endogenous,
    _say_invalid,
    exogeneity_gate,
)
from ident.exogeneity.textbook import informative, residual_sum, single_p_values, trailing_diagonal, wald_f
from ident.exogeneity.untested import no_such_arm
from ident.verdicts import ColumnCheck, ColumnKind, Gate
from robots.arrays import FloatArray

SMALL = 12
"""Rows: so few that a degree of freedom more or less shows."""


def small(extra: int = 2) -> tuple[FloatArray, FloatArray, FloatArray]:
    """y (12,), X (12, 3) in units far apart, V̂ (12, extra)."""
    generator = np.random.default_rng(21)
    x = generator.normal(size=(SMALL, 3)) * [1.0, 1e3, 1e-3]
    v = generator.normal(size=(SMALL, extra)) + 0.3 * x[:, [0]]
    return x @ [1.0, 1e-3, 5.0] + v[:, 0] + generator.normal(size=SMALL), x, v


# Statistics


def test_the_f_test_is_that_of_statsmodels_with_few_rows() -> None:
    y, x, v = small()
    whole, part = sm.OLS(y, np.hstack([x, v])).fit(), sm.OLS(y, x).fit()
    statistic, p, difference = whole.compare_f_test(part)
    found, df, p_value = wald_f(y, x, v)
    assert (found, p_value) == pytest.approx((statistic, p), rel=1e-9)
    assert df == (difference, whole.df_resid) == (2.0, 7.0)
    assert residual_sum(y, x) == pytest.approx(part.ssr, rel=1e-10)


def test_each_columns_own_p_value_is_that_of_its_t_test() -> None:
    y, x, v = small(3)
    expected = [sm.OLS(y, np.column_stack([x, v[:, k]])).fit().pvalues[-1] for k in range(3)]
    assert single_p_values(y, x, v) == pytest.approx(expected, rel=1e-9)


def test_the_f_test_of_a_statistic_has_its_degrees_of_freedom_in_order() -> None:
    test = f_test("name", "null", 3.0, 2, 7.0)
    assert test.p_value == pytest.approx(stats.f.sf(3.0, 2, 7), rel=1e-12)
    assert test.df == (2.0, 7.0)
    assert test.rejects(test.p_value + 1e-9) and not test.rejects(test.p_value)
    assert wald_statistic(np.array([1.0, 2.0]), np.diag([4.0, 0.5])) == pytest.approx(0.25 + 8.0)
    y, x, _ = small()
    assert annihilate(y[:, np.newaxis], x)[:, 0] == pytest.approx(sm.OLS(y, x).fit().resid, abs=1e-9)


def test_what_a_column_adds_is_a_share_of_its_regressor_whatever_its_unit() -> None:
    """x₁ = 1000 e₁, x₂ = 10⁻³ e₂, x₃ = e₃; v₁ = 100 (e₁ + 4 e₄), v₂ lies in X, v₃ is new by 10⁻⁸ of |x₃|."""
    x, v = np.zeros((9, 3)), np.zeros((9, 3))
    x[0, 0], x[1, 1], x[2, 2] = 1e3, 1e-3, 1.0
    v[0, 0], v[3, 0] = 100.0, 400.0
    v[0, 1] = 7e-4
    v[8, 2] = 1e-8
    assert trailing_diagonal(x, v) == pytest.approx([0.4, 0.0, 1e-8], rel=1e-6, abs=1e-15)
    assert informative(x, v).tolist() == [0, 2]
    v[8, 2] = 1e-10
    assert informative(x, v).tolist() == [0]


def test_the_textbook_test_counts_the_columns_that_it_leaves_out() -> None:
    generator = np.random.default_rng(3)
    z = generator.normal(size=(200, 3))
    v = 0.3 * generator.normal(size=(200, 3))
    v[:, 2] = 0.0
    x = z + v
    y = x @ [1.0, 2.0, 3.0] + generator.normal(size=200)
    gate = textbook_test(WhiteRows(y, x, z))
    assert gate.detail == "i.i.d. errors; 1 null columns of V̂ left out"
    assert gate.p_value is not None
    assert textbook_test(WhiteRows(y, x, z), gate.p_value).passed
    assert not textbook_test(WhiteRows(y, x, z), float(np.nextafter(gate.p_value, 1.0))).passed
    assert textbook_test(WhiteRows(y, x, z)).passed == (gate.p_value >= 0.05)
    wrong = textbook_test(WhiteRows(y + 3.0 * v[:, 0], x, z))
    assert wrong.p_value is not None and wrong.p_value < 0.05 and not wrong.passed
    same = textbook_test(WhiteRows(y, z, z))
    assert (same.passed, same.statistic, same.p_value, same.distribution) == (True, 0.0, 1.0, "none")


@pytest.mark.parametrize("kind", ["iid", "hc"])
def test_the_wald_test_weighs_joints_and_leaves_rows_out(kind: str) -> None:
    """Two joints of different noise, some rows not used, against statsmodels on rows weighted by hand."""
    generator = np.random.default_rng(5)
    samples, sigma = 60, np.array([0.5, 20.0])
    z = generator.normal(size=(samples, 2, 3))
    v = 0.4 * generator.normal(size=(samples, 2, 3))
    x = z + v
    y = x @ [1.0, -1.0, 2.0] + sigma * generator.normal(size=(samples, 2)) + v[:, :, 0]
    used = generator.random((samples, 2)) < 0.8
    one = np.zeros(samples, dtype=np.int64)
    found = augmented_wald(y, x, z, sigma, one, used, covariance_named(kind))
    weight = np.broadcast_to(1.0 / sigma, used.shape)[used]
    yw, xw, zw = y[used] * weight, x[used] * weight[:, np.newaxis], z[used] * weight[:, np.newaxis]
    residual = xw - zw @ np.linalg.lstsq(zw, xw, rcond=None)[0]
    fit = sm.OLS(yw, np.hstack([xw, residual])).fit()
    robust = fit if kind == "iid" else fit.get_robustcov_results("HC1")
    expected = robust.f_test(np.hstack([np.zeros((3, 3)), np.eye(3)]))
    assert found.statistic == pytest.approx(float(expected.fvalue), rel=1e-8)
    assert found.df == (3.0, float(used.sum() - 6))
    assert found.p_value == pytest.approx(float(expected.pvalue), rel=1e-7)


# Holm


def test_holms_limits_reject_what_statsmodels_rejects() -> None:
    generator = np.random.default_rng(0)
    for size in (1, 5, 40):
        p_values = generator.uniform(size=size) ** 4
        rejected = multipletests(p_values, 0.05, method="holm")[0]
        assert (p_values < _holm_limits(p_values, 0.05)).tolist() == rejected.tolist()


def test_holms_limits_by_hand() -> None:
    """Four: 0.05/4, 0.05/3, 0.05/2, 0.05; after the first that stands every later one stands as well."""
    limits = _holm_limits(np.array([0.024, 0.01, 0.5, 0.02]), 0.05)
    assert limits == pytest.approx([0.024, 0.0125, 0.05, 0.05 / 3])


def test_gate_three_tells_each_columns_own_p_value_beside_its_limit() -> None:
    generator = np.random.default_rng(9)
    z = generator.normal(size=(300, 3))
    v = 0.3 * generator.normal(size=(300, 3))
    x = z + v
    y = x @ [1.0, 2.0, 3.0] + generator.normal(size=300) + 0.3 * v[:, 1] / 0.3
    rows = WhiteRows(y, x, z)
    kept = np.array([1, 2])
    gate = exogeneity_gate(rows, ("a", "b", "c"), kept, 0.05, "white")
    left = x - z @ np.linalg.lstsq(z, x, rcond=None)[0]
    own = [sm.OLS(y, np.column_stack([x, left[:, k]])).fit().pvalues[-1] for k in kept]
    assert [check.column for check in gate.columns] == ["b", "c"]
    assert [check.p_value for check in gate.columns] == pytest.approx(own, rel=1e-8)
    assert [check.size for check in gate.columns] == pytest.approx(own, rel=1e-8)
    assert [check.limit for check in gate.columns] == pytest.approx(_holm_limits(np.array(own), 0.05))
    assert [check.passed for check in gate.columns] == [False, True]
    assert gate.detail == "white; correlated with the errors: b"
    assert gate.df == (2.0, 300.0 - 5.0)
    assert gate.p_value is not None
    at = exogeneity_gate(rows, ("a", "b", "c"), kept, gate.p_value, "white")
    above = exogeneity_gate(rows, ("a", "b", "c"), kept, float(np.nextafter(gate.p_value, 1.0)), "white")
    assert at.passed and not above.passed
    clean = exogeneity_gate(rows, ("a", "b", "c"), np.array([2]), 0.05, "white")
    assert clean.detail == "white"


# Gate 1


def rows_of(x: FloatArray, z: FloatArray, seed: int = 1) -> TestedRows:
    generator = np.random.default_rng(seed)
    y = x @ np.arange(1.0, x.shape[1] + 1.0) + generator.normal(size=x.shape[0])
    used = np.ones((x.shape[0], 1), dtype=np.bool_)
    segment = np.zeros(x.shape[0], dtype=np.int64)
    return TestedRows(y[:, np.newaxis], x[:, np.newaxis], z[:, np.newaxis], segment, used)


def gate_one(case: TestedRows, settings: GateSettings | None = None) -> Gate:
    names = ("a", "b", "c")[: case.regressor.shape[2]]
    return instruments_gate(
        case, case.omega(), case.whitened(case.omega()), names, settings or GateSettings()
    )


def test_gate_one_rests_on_the_weakest_conditional_f_and_names_it() -> None:
    generator = np.random.default_rng(4)
    z = generator.normal(size=(400, 3))
    x = z + generator.normal(size=(400, 3)) * [0.1, 0.5, 0.02]
    case = rows_of(x, z)
    found = conditional_f(case.whitened(case.omega()))
    weakest = min(test.statistic for test in found.values())
    assert found[1].statistic == weakest
    assert gate_one(case).detail.endswith(f"weakest conditional first-stage F {weakest:.3g} (b)")
    assert gate_one(case).passed


def with_strength(strength: float) -> TestedRows:
    """One regressor that its instrument moves with that first-stage F, (r − 1)·|part along z|²/|rest|²."""
    generator = np.random.default_rng(6)
    z, noise = generator.normal(size=(2, 200))
    noise -= z * (z @ noise) / (z @ z)
    noise *= np.linalg.norm(z) / np.linalg.norm(noise) * np.sqrt(199.0 / strength)
    return rows_of((z + noise)[:, np.newaxis], z[:, np.newaxis])


def test_ten_is_the_first_stage_f_that_instruments_need() -> None:
    assert gate_one(with_strength(10.1)).passed
    weak = gate_one(with_strength(9.9))
    assert not weak.passed and all(check.passed for check in weak.columns)
    assert "first-stage F 9.9 (a)" in weak.detail


def test_a_column_fails_where_it_is_significant_and_larger_than_its_margin() -> None:
    generator = np.random.default_rng(8)
    z = generator.normal(size=(400, 2))
    case = rows_of(z * [1.1, 1.0] + 0.02 * generator.normal(size=(400, 2)), z)
    size = gate_one(case).columns[0].size
    assert size == pytest.approx(0.1 / 1.1, rel=0.05)
    for margin, passed in ((size, True), (np.nextafter(size, 0.0), False)):
        gate = gate_one(case, GateSettings(margin=margin))
        assert gate.columns[0].passed is passed and gate.passed == passed
        assert gate.columns[0].limit == margin
    p_value = gate_one(case).columns[0].p_value
    assert p_value is not None and p_value < 0.01
    assert gate_one(case, GateSettings(level=p_value, margin=0.01)).columns[0].passed
    assert "largest departure 9.1" in gate_one(case).detail and "% of a (margin 5 %)" in gate_one(case).detail


def test_where_the_simulation_is_exact_nothing_is_tested() -> None:
    generator = np.random.default_rng(8)
    z = generator.normal(size=(100, 2))
    gate = gate_one(rows_of(z, z))
    assert gate.passed
    assert gate.detail.endswith("X = Z exactly")
    assert (gate.statistic, gate.p_value) == (0.0, 1.0)
    assert [check.p_value for check in gate.columns] == [1.0, 1.0]
    # Rounding is no departure: off by 1e-10 of its size a column is exact, off by 1e-8 it is not.
    for size, exact in ((1e-10, True), (1e-8, False)):
        x = z.copy()
        x[:, 1] *= 1.0 + size
        assert (gate_one(rows_of(x, z)).columns[1].p_value == 1.0) is exact
    # Of its own size: what departs by a tenth is no rounding beside a column that is 1e12 times as large.
    large = z * [1e12, 1.0]
    assert gate_one(rows_of(large * [1.0, 1.1], large)).columns[1].p_value != 1.0


# Gate 2


def test_gate_two_tells_what_is_new_in_a_column_as_a_share_beside_its_floor() -> None:
    """X = Z + V with orthonormal columns: |R_kk| and the floor 0.1·‖x_k‖/√r can be written down."""
    q = np.linalg.qr(np.random.default_rng(2).normal(size=(100, 4)))[0]
    z, v = 10.0 * q[:, :2], np.column_stack([0.5 * q[:, 2], 0.05 * q[:, 3]])
    x = z + v
    gate, kept = rank_gate(WhiteRows(np.zeros(100), x, z), ("a", "b"))
    # What of V̂ is new to X = Z + V: v − x(xᵀv)/|x|², of length |v|·|z|/|x|.
    length = np.sqrt(np.array([100.25, 100.0025]))
    new = np.array([0.5, 0.05]) * 10.0 / length
    floor = 0.1 * length / np.sqrt(100.0)
    assert [check.size for check in gate.columns] == pytest.approx(new / length, rel=1e-9)
    assert [check.limit for check in gate.columns] == pytest.approx(floor / length, rel=1e-9)
    assert gate.statistic == pytest.approx(float((new / floor).max()), rel=1e-9)
    assert kept.tolist() == [0]
    assert [check.passed for check in gate.columns] == [False, True]
    assert gate.passed is False and gate.detail.startswith("1 of 2 columns")


def test_the_floor_knows_what_other_columns_hold_of_one() -> None:
    """Two columns at an angle whose sine is 0.1: the own part, and with it the floor, is a tenth."""
    q = np.linalg.qr(np.random.default_rng(2).normal(size=(100, 3)))[0]
    x = 7.0 * np.column_stack([q[:, 0], np.sqrt(0.99) * q[:, 0] + 0.1 * q[:, 1]])
    gate, _ = rank_gate(WhiteRows(np.zeros(100), x, x + 1e-3 * q[:, [2]]), ("a", "b"))
    assert [check.limit for check in gate.columns] == pytest.approx([0.1 * 0.1 / 10.0] * 2, rel=1e-6)


# Words


KINDS: dict[str, ColumnKind] = {"torque": "torque", "following error": "following error"}


def invalid(*checks: tuple[str, float, float]) -> str:
    columns = tuple(
        ColumnCheck(name, size, limit, 0.0, size <= limit, KINDS.get(name.partition(" of ")[0], "regressor"))
        for name, size, limit in checks
    )
    return _say_invalid(Gate("instruments", "", False, 1.0, "F", None, None, "", columns))


def test_each_sentence_on_a_simulation_that_is_not_the_robot_fits_into_two_lines() -> None:
    """With everything wrong that can be; the terminal gives each sentence a line of its own."""
    wrong = [(f"{kind} of joint {k}", 0.123456, 0.005) for kind in KINDS for k in (1, 2, 3)]
    sentences = invalid(*wrong, *((f"XX{k}R", 0.1, 0.05) for k in range(9))).split(". ")
    assert len(sentences) == 4
    assert all(sentence[0].isupper() and len(sentence) <= 160 for sentence in sentences)


def test_what_is_said_of_a_simulation_that_is_not_the_robot() -> None:
    said = invalid(("torque of joint 2", 0.2, 0.05), ("ZZ1R", 0.01, 0.05))
    assert said == (
        "Do not trust this model yet: the simulated arm needs another torque of joint 2 (20 %): an effect is"
        " missing. Instruments are invalid; search for the missing effect."
    )
    said = invalid(("following error of joint 1", 0.02, 0.005))
    assert said.endswith(
        "its controller or its model is wrong. Instruments are invalid; check the controller's figures."
    )
    said = invalid(("following error of joint 1", 0.02, 0.005), ("torque of joint 2", 0.2, 0.05))
    assert said.endswith("Instruments are invalid; search for the missing effect.")
    assert len(max(said.split(". "), key=len)) <= 160
    said = invalid(("a", 0.06, 0.05), ("b", 0.3, 0.05), ("c", 0.2, 0.05), ("d", 0.1, 0.05), ("e", 0.01, 0.05))
    assert "in 4 regressors, most of all b (30 %), c (20 %). Instruments" in said
    assert "loop" not in said and "torque" not in said
    # What is farthest over its own limit comes first.
    assert "b (1 %), a (6 %)" in invalid(("a", 0.06, 0.05), ("b", 0.01, 0.001))
    assert invalid(("a", 0.01, 0.05)).startswith(
        "Do not trust this model: the simulated motion does not span"
    )


def test_the_largest_departure_of_a_kind_is_said_in_percent() -> None:
    checks = (
        ColumnCheck("ZZ1R", 0.9, 0.05, None, False),
        ColumnCheck("torque of joint 1", 0.012, 0.05, None, True, "torque"),
        ColumnCheck("torque of joint 2", 0.087, 0.025, None, False, "torque"),
    )
    assert _largest(checks, "torque") == "simulation lacks 8.7 % of the torque of joint 2 (margin 2.5 %)"


def test_what_is_said_of_regressors_that_are_correlated() -> None:
    names = ("a", "b", "c", "d")
    said = _say_endogenous(names, np.array([0.5, -3.0, 1.0, 2.04]))
    assert said.endswith("which shifts least squares, most of all b by 3.0 σ, d by 2.0 σ.")
    assert "filter better" in said
    assert "filter better" in _say_endogenous(names, np.array([0.0, 1.0, 0.0, 0.0]))
    hardly = _say_endogenous(names, np.array([0.5, -0.9, 0.1, 0.2]))
    assert "but hardly" in hardly and "(most of all b by 0.9 σ, a by 0.5 σ)" in hardly


def test_an_arm_that_cannot_be_simulated_has_no_valid_instruments() -> None:
    test = no_such_arm("joint 2 ran away", "AR")
    assert test.verdict == "instruments_invalid"
    assert [gate.passed for gate in test.gates] == [False, None, None]
    assert test.gates[0].detail == "joint 2 ran away" and "joint 2 ran away" in test.recommendation


def test_the_verdict_tells_shifts_of_the_parameters_it_was_given() -> None:
    generator = np.random.default_rng(13)
    z = generator.normal(size=(600, 2))
    v = 0.3 * generator.normal(size=(600, 2))
    x = z + v
    y = x @ [1.0, 2.0] + generator.normal(size=600) + 2.0 * v[:, 0]
    used, segment = np.ones((600, 1), dtype=np.bool_), np.zeros(600, dtype=np.int64)
    case = TestedRows(y[:, np.newaxis], x[:, np.newaxis], z[:, np.newaxis], segment, used)
    test = revised_test(case, ("a", "b"), np.array([4.0, -5.0]), GateSettings())
    assert test.verdict == "endogenous"
    assert test.recommendation.endswith("most of all b by 5.0 σ, a by 4.0 σ.")
    assert [gate.passed for gate in test.gates] == [True, False, False]
