"""The textbook and the revised test: agreement with linearmodels, size, power, and each gate's job."""

from __future__ import annotations

import numpy as np
import pytest
from linearmodels.iv import IV2SLS

from ident.covariances import covariance_named
from ident.exogeneity import (
    GateSettings,
    TestedRows,
    WhiteRows,
    augmented_wald,
    not_testable,
    revised_test,
    textbook_test,
)
from ident.exogeneity.rank import rank_gate
from ident.verdicts import RevisedTest
from robots.arrays import FloatArray

NAMES = ("a", "b", "c", "d")
SETTINGS = GateSettings(level=0.05, margin=0.05)
ROWS = 600


def rows(seed: int, endogeneity: float = 0.0, distortion: float = 0.0, spread: float = 0.2) -> WhiteRows:
    """Z with a constant column (the offset), X = Z·distorted + V, errors correlated with V by choice."""
    generator = np.random.default_rng(seed)
    z = generator.normal(size=(ROWS, 4))
    z[:, 3] = 1.0
    v = spread * generator.normal(size=(ROWS, 4))
    v[:, 3] = 0.0
    errors = generator.normal(size=ROWS) + endogeneity * v[:, 1] / spread
    x = z + v
    x[:, 0] = x[:, 0] + distortion * z[:, 1]
    return WhiteRows(x @ np.array([1.0, 2.0, -1.0, 0.5]) + errors, x, z)


def run(case: WhiteRows) -> RevisedTest:
    """The revised test of one joint."""
    tested = TestedRows(
        case.y[:, np.newaxis],
        case.x[:, np.newaxis],
        case.z[:, np.newaxis],
        np.zeros(ROWS, dtype=np.int64),
        np.ones((ROWS, 1), dtype=np.bool_),
    )
    return revised_test(tested, NAMES, np.zeros(4), SETTINGS)


def test_the_textbook_statistic_is_that_of_linearmodels() -> None:
    case = rows(1, endogeneity=0.2)
    found = textbook_test(case)
    reference = IV2SLS(case.y, case.x[:, 3:], case.x[:, :3], case.z[:, :3]).fit().wu_hausman()
    assert found.statistic == pytest.approx(reference.stat, rel=1e-8)
    assert found.p_value == pytest.approx(reference.pval, rel=1e-6)
    assert found.df == (3.0, reference.df_denom)


def test_the_wald_test_with_one_variance_is_the_textbook_test_to_the_last_digit() -> None:
    case = rows(1, endogeneity=0.2)
    used = np.ones((ROWS, 1), dtype=np.bool_)
    x, z, y = case.x[:, np.newaxis], case.z[:, np.newaxis], case.y[:, np.newaxis]
    whole = np.zeros(ROWS, dtype=np.int64)
    found = augmented_wald(y, x, z, np.ones(1), whole, used, covariance_named("iid"))
    reference = textbook_test(case)
    assert found.statistic == pytest.approx(reference.statistic, rel=1e-10)
    assert found.df == reference.df
    assert found.p_value == pytest.approx(reference.p_value, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["textbook", "revised"])
def test_size_is_nominal_where_regressors_are_exogenous(which: str) -> None:
    # 1000 replicates at 5 %: a true 5 % test stays within 3.1 to 7.2 % with probability 0.998.
    replicates = 1000
    rejected = 0
    for seed in range(replicates):
        case = rows(seed)
        if which == "textbook":
            rejected += textbook_test(case).passed is False
        else:
            rejected += run(case).verdict == "endogenous"
    assert 0.031 <= rejected / replicates <= 0.072


def test_power_grows_with_the_correlation() -> None:
    share = [
        np.mean([run(rows(seed, endogeneity=strength)).verdict == "endogenous" for seed in range(100)])
        for strength in (0.05, 0.15, 0.4)
    ]
    assert share == sorted(share)
    assert share[-1] == 1.0


def test_gate_one_stops_at_a_simulation_that_is_not_the_robot() -> None:
    test = run(rows(2, distortion=0.2))
    instruments, rank, exogeneity = test.gates
    assert test.verdict == "instruments_invalid"
    assert instruments.passed is False
    assert [check.column for check in instruments.columns if not check.passed] == ["a"]
    assert rank.passed is exogeneity.passed is None
    assert "do not trust" in test.recommendation.lower()
    assert "a (" in test.recommendation


def test_gate_one_tolerates_a_departure_within_the_margin() -> None:
    test = run(rows(3, distortion=0.03))
    instruments = test.gates[0]
    assert instruments.passed is True
    # It is significant all the same, and both are told.
    assert instruments.p_value is not None
    assert instruments.columns[0].size == pytest.approx(0.03, abs=0.02)


def test_gate_two_ends_it_when_simulation_and_measurement_agree() -> None:
    test = run(rows(4, spread=1e-7))
    assert test.verdict == "exogenous"
    assert test.gates[1].passed is True
    assert test.gates[2].passed is None


def test_gate_two_takes_out_a_constant_column_only() -> None:
    rank = run(rows(5)).gates[1]
    assert [check.column for check in rank.columns if check.passed] == ["d"]


def test_gate_two_does_not_depend_on_the_order_of_the_columns() -> None:
    # The first column's new part is small but the same as the second's: only pivoting finds the second.
    generator = np.random.default_rng(11)
    z = generator.normal(size=(ROWS, 3))
    common = generator.normal(size=ROWS)
    v = np.column_stack([1e-5 * common, 0.1 * common, np.zeros(ROWS)])
    y = generator.normal(size=ROWS)
    for order in ([0, 1, 2], [1, 0, 2], [2, 1, 0]):
        _, kept = rank_gate(WhiteRows(y, (z + v)[:, order], z[:, order]), tuple("abc"))
        assert [order[k] for k in kept] == [1]


@pytest.mark.parametrize("samples", [600, 60_000])
def test_gate_twos_floor_is_what_the_data_could_be_misled_by(samples: int) -> None:
    # With V̂ wholly in the errors its column shifts β by √r·|v|/|x| σ; the floor stands at a tenth of a σ.
    generator = np.random.default_rng(12)
    z = generator.normal(size=(samples, 1))
    direction = generator.normal(size=samples)
    direction -= z[:, 0] * (z[:, 0] @ direction) / (z[:, 0] @ z[:, 0])
    direction /= np.linalg.norm(direction)
    for share, above in ((0.09, False), (0.11, True)):
        v = share * np.linalg.norm(z) / np.sqrt(samples) * direction
        x = z + v[:, np.newaxis]
        errors = np.sqrt(samples) * direction
        shift = float(x[:, 0] @ errors) / np.linalg.norm(x)
        assert shift == pytest.approx(share, rel=0.01)
        gate, kept = rank_gate(WhiteRows(errors, x, z), ("a",))
        assert (kept.size == 1) is above
        assert gate.statistic == pytest.approx(share / 0.1, rel=0.01)


def test_gate_three_names_the_guilty_column() -> None:
    test = run(rows(6, endogeneity=0.5))
    guilty = [check.column for check in test.gates[2].columns if not check.passed]
    assert test.verdict == "endogenous"
    assert "b" in guilty


def test_without_instruments_nothing_is_claimed() -> None:
    test = not_testable("no position reference was recorded", "AR")
    assert test.verdict == "not_testable"
    assert [gate.passed for gate in test.gates] == [None, None, None]
    assert "no position reference" in test.recommendation


def test_the_revised_test_survives_what_breaks_the_textbook_one() -> None:
    # [X V̂] is rank deficient because of the constant: plain inversion fails, the gates do not.
    case = rows(7)
    _, v = case.first_stage()
    augmented: FloatArray = np.hstack([case.x, v])
    assert np.linalg.matrix_rank(augmented) < augmented.shape[1]
    assert run(case).gates[2].statistic is not None
