"""The evidence from Gram matrices against the density of y, computed without any of its algebra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import multivariate_normal, norm

from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.kappa import OneJoint
from ident.discrepancy.by_evidence.evidence.library_products import LibraryProducts
from ident.discrepancy.by_evidence.evidence.noise import Noise, Whitener
from ident.discrepancy.by_evidence.evidence.prepared import Part, Prepared
from ident.discrepancy.by_evidence.evidence.rows import Known, Rows, WhiteEffects
from ident.effects import State
from robots.arrays import FloatArray

ROWS, JOINTS, KNOWN, MISFIT = 60, 2, 3, 5
KAPPA = np.array([0.7, 0.2])
LEVEL = Level(KAPPA, np.ones(2))
NOISES = (Noise(np.array([0.5, -0.2]), 0.3), Noise(np.zeros(0), 0.4))
FREE = np.array([[-np.inf, np.inf]])


def prepared() -> Prepared:
    random = np.random.default_rng(0)
    still = State(*(np.zeros((ROWS, JOINTS)) for _ in range(3)), np.arange(ROWS) * 0.01)
    torque = random.normal(size=(ROWS, JOINTS))
    used = np.ones((ROWS, JOINTS), dtype=np.bool_)
    used[20:24, 0] = False
    return Prepared(None, (Part(still, still, torque, used, None, 1, 0.01),))  # type: ignore[arg-type]


def problem() -> Rows:
    random = np.random.default_rng(1)
    data = prepared()
    known = Known(random.normal(size=(ROWS, JOINTS, KNOWN)), np.ones(KNOWN), data.torque)
    misfit = tuple(random.normal(size=(ROWS, MISFIT)) for _ in range(JOINTS))
    return Rows(data, known, misfit, NOISES)


def effect(rows: Rows, joints: tuple[int, ...], seed: int, centre: float, bounds: FloatArray) -> WhiteEffects:
    random = np.random.default_rng(seed)
    parts = [rows.whiteners[j](random.normal(size=(ROWS, 1))) if j in joints else None for j in range(JOINTS)]
    return WhiteEffects(1, tuple(parts), np.array([centre]), bounds, np.ones(1))


def density(rows: Rows, kappa: FloatArray, effects: list[WhiteEffects], noise: float = 0.0) -> float:
    """log p(y | effects), by the covariance of the white rows."""
    k = rows.known.precision.size
    y = np.concatenate([white[:, -1] for white in rows.white])
    count = y.size
    covariance, mean, start = np.eye(count), np.zeros(count), 0
    shared = np.concatenate([white[:, :k] for white in rows.white])
    covariance += shared @ np.diag(1.0 / rows.precision) @ shared.T
    for j, white in enumerate(rows.white):
        part = slice(start, start + white.shape[0])
        phi = white[:, k:-1]
        covariance[part, part] += kappa[j] ** 2 / phi.shape[1] * phi @ phi.T
        start = part.stop
    for one in effects:
        column = np.concatenate(
            [
                np.zeros(white.shape[0]) if part is None else part[:, 0]
                for white, part in zip(rows.white, one.joints, strict=True)
            ]
        )
        covariance += np.outer(column, column)
        mean += one.centre[0] * column
    return float(multivariate_normal(mean, covariance).logpdf(y))


def test_the_evidence_is_the_density_of_the_data() -> None:
    rows = problem()
    first, second = effect(rows, (0,), 2, 0.0, FREE), effect(rows, (0, 1), 3, 1.0, FREE)
    constant = density(rows, KAPPA, []) - Gram(rows, ()).posterior(LEVEL).log_evidence
    for chosen in ((first,), (second,), (first, second), (second, first)):
        for kappa in (KAPPA, 3.0 * KAPPA, np.array([1e-3, 5.0])):
            expected = density(rows, kappa, list(chosen))
            found = Gram(rows, chosen).posterior(Level(kappa, np.ones(2))).log_evidence
            assert found + constant == pytest.approx(expected, abs=1e-8)


def test_the_posterior_is_that_of_a_regression_with_a_prior() -> None:
    rows = problem()
    one = effect(rows, (1,), 4, 0.5, FREE)
    found = Gram(rows, (one,)).posterior(LEVEL)
    grid = np.linspace(-4.0, 5.0, 4001)
    shifted = [replace(one, centre=np.array([value])) for value in grid[::400]]
    assert shifted  # the posterior of θ: p(y | θ) p(θ), with θ held by a column of its own that is subtracted
    values = np.array([held(rows, one, float(value)) for value in grid[::40]])
    weights = np.exp(values - values.max()) * norm.pdf(grid[::40], 0.5, 1.0)
    weights /= weights.sum()
    mean = float(weights @ grid[::40])
    assert found.theta[0] == pytest.approx(mean, abs=1e-3)
    spread = float(np.sqrt(weights @ (grid[::40] - mean) ** 2))
    assert np.sqrt(found.covariance[-1, -1]) == pytest.approx(spread, rel=1e-2)


def held(rows: Rows, one: WhiteEffects, value: float) -> float:
    """log p(y | θ = value)."""
    column = [
        np.zeros(white.shape[0]) if part is None else part[:, 0]
        for white, part in zip(rows.white, one.joints, strict=True)
    ]
    moved = replace(rows)
    blocks = []
    for white, part in zip(rows.white, column, strict=True):
        changed = white.copy()
        changed[:, -1] -= value * part
        blocks.append(changed)
    moved.__dict__["white"] = tuple(blocks)
    return density(moved, KAPPA, [])


def test_bounds_keep_the_share_of_the_posterior_that_lies_within_them() -> None:
    rows = problem()
    free, positive = effect(rows, (1,), 4, 0.2, FREE), effect(rows, (1,), 4, 0.2, np.array([[0.0, np.inf]]))
    without = Gram(rows, (free,)).posterior(LEVEL)
    within = Gram(rows, (positive,)).posterior(LEVEL)
    deviation = np.sqrt(without.covariance[-1, -1])
    share = norm.sf(0.0, without.theta[0], deviation) / norm.sf(0.0, 0.2, 1.0)
    assert within.log_evidence - without.log_evidence == pytest.approx(np.log(share), abs=1e-9)


def test_a_parameter_without_a_prior_costs_the_same_in_every_set() -> None:
    rows = problem()
    flat = replace(rows, known=replace(rows.known, precision=np.array([0.0, 1.0, 1.0])))
    one = effect(flat, (0,), 2, 0.0, FREE)
    gain = gain_of(flat, one)
    wide = replace(rows)
    wide.__dict__["precision"] = np.array([1e-7, 1.0, 1.0])
    assert gain == pytest.approx(gain_of(wide, one), abs=1e-4)


def gain_of(rows: Rows, one: WhiteEffects) -> float:
    with_it, without = (Gram(rows, effects).posterior(LEVEL) for effects in ((one,), ()))
    return with_it.log_evidence - without.log_evidence


def test_white_rows_leave_out_what_a_gap_is_mixed_into() -> None:
    rows = problem()
    assert [white.shape[0] for white in rows.white] == [ROWS - 2 - 4 - 2, ROWS]
    series = rows.known.target[:, 0]
    third = (series[2] - 0.5 * series[1] + 0.2 * series[0]) / 0.3
    assert rows.white[0][0, -1] == pytest.approx(third)


def test_white_rows_are_those_of_a_filter_that_starts_anew_with_each_recording() -> None:
    """Of a joint among others, in units of the scales; of half the size they are rounded."""
    random = np.random.default_rng(5)
    columns, scale = random.normal(size=(ROWS, JOINTS, 2)), np.array([2.0, 0.5])
    columns[:, 1] = 0.0
    used, segment = np.ones(ROWS, dtype=np.bool_), np.repeat([0, 1], ROWS // 2)
    used[10] = False
    whitener = Whitener.of(NOISES[0], segment, used)
    taps = np.concatenate([[1.0], -NOISES[0].coefficients]) / NOISES[0].deviation
    parts = [lfilter(taps, [1.0], part, axis=0)[2:] for part in np.split(columns[:, 0] * scale, 2)]
    expected = np.delete(np.concatenate(parts), [8, 9, 10], axis=0)
    assert whitener.effect(columns, 0, scale, False) == pytest.approx(expected, rel=1e-12)
    assert whitener(columns[:, 0] * scale) == pytest.approx(expected, rel=1e-12)
    half = whitener.effect(columns, 0, scale, True)
    assert half is not None and half.dtype == np.float32
    assert half == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert whitener.effect(columns, 1, scale, False) is None


def test_rows_of_a_joint_can_be_noisier_than_what_does_not_repeat() -> None:
    rows = problem()
    one = effect(rows, (0, 1), 3, 1.0, FREE)
    gram, excess = Gram(rows, (one,)), np.array([2.5, 1.3])
    noisier = replace(
        rows, noise=tuple(replace(n, deviation=n.deviation * s) for n, s in zip(NOISES, excess, strict=True))
    )
    scaled = [None if part is None else part / s for part, s in zip(one.joints, excess, strict=True)]
    of_raw = float(rows.counts @ np.log(excess))
    expected = density(noisier, KAPPA, [replace(one, joints=tuple(scaled))]) - of_raw
    constant = density(rows, KAPPA, []) - Gram(rows, ()).posterior(LEVEL).log_evidence
    found = gram.posterior(Level(KAPPA, excess)).log_evidence
    assert found + constant == pytest.approx(expected, abs=1e-8)


def test_many_levels_of_a_joint_at_once_are_what_each_is_alone() -> None:
    rows = problem()
    bounded = effect(rows, (0, 1), 3, 1.0, np.array([[0.5, 2.0]]))
    set_of_two = (effect(rows, (0,), 2, 0.3, FREE), bounded)
    for effects in ((), (set_of_two[0],), set_of_two):
        gram, kappa, excess = Gram(rows, effects), np.array([0.05, 0.4, 3.0]), np.array([1.0, 1.7, 4.0])
        for joint in range(JOINTS):
            found = OneJoint(gram, LEVEL, joint).log_evidences(kappa, excess)
            for k in range(kappa.size):
                alone = gram.posterior(LEVEL.changed(joint, float(kappa[k]), float(excess[k])))
                assert found[k] == pytest.approx(alone.log_evidence, abs=1e-8)


def test_the_information_of_one_effect_beside_a_set_is_that_of_the_whole_gram_matrix() -> None:
    rows = problem()
    member = effect(rows, (0, 1), 5, 0.7, FREE)
    library = (effect(rows, (0,), 2, 0.3, FREE), both_columns(rows, 6), effect(rows, (1,), 7, 0.0, FREE))
    level = Level(KAPPA, np.array([1.0, 1.8]))
    products = LibraryProducts.of(rows, library)
    for members in ((), (member,)):
        expected = [beside(rows, level, members, one) for one in library]
        found = list(products.beside(Gram(rows, members), level))
        for (information, score), (own, right) in zip(found, expected, strict=True):
            assert information == pytest.approx(own, abs=1e-9)
            assert score == pytest.approx(right, abs=1e-9)


def both_columns(rows: Rows, seed: int) -> WhiteEffects:
    """An effect of two parameters on both joints."""
    one, two = effect(rows, (0, 1), seed, 0.0, FREE), effect(rows, (1,), seed + 20, 0.0, FREE)
    parts = [
        np.column_stack([a, np.zeros_like(a) if b is None else b])
        for a, b in zip(one.joints, two.joints, strict=True)
        if a is not None
    ]
    return WhiteEffects(2, tuple(parts), np.zeros(2), np.tile(FREE, (2, 1)), np.ones(2))


def beside(
    rows: Rows, level: Level, members: tuple[WhiteEffects, ...], one: WhiteEffects
) -> tuple[FloatArray, FloatArray]:
    """Information and score by Schur's complement of the Gram matrix of everything."""
    whole, _ = Gram(rows, (*members, one)).reduced(level)
    k, p = KNOWN, sum(member.count for member in members)
    y, inner, outer = k, [*range(k), *range(k + 1, k + 1 + p)], list(range(k + 1 + p, k + 1 + p + one.count))
    whole[:, y] -= whole[:, k + 1 : k + 1 + p] @ np.concatenate([np.zeros(0), *(m.centre for m in members)])
    system = whole[np.ix_(inner, inner)] + np.diag(np.concatenate([rows.precision, np.ones(p)]))
    back = np.linalg.solve(system, whole[np.ix_(inner, [*outer, y])])
    cross = whole[np.ix_(inner, outer)]
    return whole[np.ix_(outer, outer)] - cross.T @ back[:, :-1], whole[outer, y] - cross.T @ back[:, -1]


def test_products_that_are_made_together_are_those_of_each() -> None:
    rows = problem()
    effects = [
        effect(rows, joints, seed, 0.0, FREE) for seed, joints in enumerate([(0,), (1,), (0, 1), (), (1,)])
    ]
    alone = [rows.products_with(replace(one)) for one in effects]
    rows.keep_products_with(effects)
    for one, expected in zip(effects, alone, strict=True):
        kept = rows.products_with(one)
        assert rows.products_with(one) is kept
        for pair, other in zip(kept, expected, strict=True):
            for got, wanted in zip(pair, other, strict=True):
                np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-12)
