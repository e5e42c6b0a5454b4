"""A baseline whose model has other parameters than tonight's: compared on what both know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import BaseParameters, IdentificationError, RegressorModel, base_parameters
from ident.drift import (
    Geometry,
    Night,
    Relation,
    common_base,
    compare,
    determined_by,
    geometry_of,
    in_base_of,
    in_terms_of,
    patterns_of,
)
from ident.effects.entry import EffectEntry
from ident.identification.found_effects import FoundModel, extended_model
from ident.preparation.observation import Rows
from robots.arrays import FloatArray
from tests.ident.drift.arms_of_nights import draw_nights, geometry


@pytest.fixture(scope="module")
def made() -> Geometry:
    return geometry()


@pytest.fixture(scope="module")
def richer() -> BaseParameters:
    """The same arm with friction that differs from side to side."""
    robot = robots.load("tx40")
    settings = robot.identification.model_copy(update={"friction": "asymmetric"})
    return base_parameters(RegressorModel.of(robot.model_copy(update={"identification": settings})))


def in_richer(made: Geometry, richer: BaseParameters, night: Night) -> Night:
    """A night as the richer model would have it, both sides of friction equal."""
    simple = made.base.model.names
    rng = np.random.default_rng(0)
    standard = dict(
        zip(simple, made.base.standard_from(night.values, rng.normal(size=len(simple))), strict=True)
    )
    values = {name: standard.get(name, 0.0) for name in richer.model.names}
    for name in values:
        for side in ("p", "n"):
            if name.startswith(("Fc", "Fv")) and f"{name[:2]}{side}" == name[:3]:
                values[name] = standard[f"{name[:2]}{name[3:]}"]
    covariance = np.diag((1e-3 * (np.abs(richer.regroup(values)) + 0.01)) ** 2)
    return replace(night, values=richer.regroup(values), covariance=covariance)


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_a_printed_relation_is_read_again(name: str) -> None:
    base = base_parameters(RegressorModel.of(robots.load(name)))
    read, exact = Relation.read(base.names, base.expressions), Relation.of(base)
    place = [exact.standard.index(symbol) for symbol in read.standard]
    np.testing.assert_allclose(read.matrix, exact.matrix[:, place], rtol=1e-5, atol=1e-12)
    assert not np.delete(exact.matrix, place, axis=1).any()
    common = common_base(read, exact)
    assert common.names == base.names and common.lost == ()


@pytest.mark.parametrize("text", ["", "2 × ZZ1", "ZZ1 Ia1", "ZZ1 + + Ia1", "0.5"])
def test_an_expression_that_is_none(text: str) -> None:
    with pytest.raises(IdentificationError, match="parameter ZZ1R: "):
        Relation.read(("ZZ1R",), (text,))


def test_what_both_know_is_compared_and_the_rest_is_not(made: Geometry, richer: BaseParameters) -> None:
    nights = draw_nights(made, 4, 1, between=0.0, per_kelvin=0.0)
    accepted = in_richer(made, richer, nights[0])
    common = common_base(Relation.read(richer.names, richer.expressions), Relation.of(made.base))
    assert any(name.startswith("Fc") for name in common.lost) and "MX2R" in common.names

    def tonight(change: FloatArray) -> Night:
        return replace(nights[-1], values=nights[-1].values + change)

    def found(last: Night) -> tuple[str, tuple[str, ...]]:
        baseline = in_base_of(last, accepted, common)
        compared = compare(baseline, [*nights[1:-1], last], made)
        return compared.state, tuple(change.words for change in compared.changes)

    def amount(effect: str, joint: int | None, size: float) -> FloatArray:
        pattern = next(p for p in patterns_of(made) if (p.effect, p.joint) == (effect, joint))
        return np.asarray(pattern.directions[:, 0] * size)

    assert found(tonight(np.zeros_like(made.beta)))[0] == "unchanged"
    state, words = found(tonight(amount("payload", None, 3.0)))
    assert state == "changed" and words[0] == "payload on the tool"
    assert found(tonight(amount("coulomb_friction", 2, 5.0)))[0] == "unchanged"  # nothing is known of it
    nothing = replace(common, names=(), of_old=common.of_old[:0], of_new=common.of_new[:0])
    with pytest.raises(IdentificationError, match="night 0: none of its parameters"):
        in_base_of(nights[-1], accepted, nothing)


def test_the_same_base_is_carried_over_as_it_is(made: Geometry) -> None:
    one, two = draw_nights(made, 2, 2)
    exact = Relation.of(made.base)
    carried = in_base_of(two, one, common_base(exact, exact))
    np.testing.assert_allclose(carried.values, one.values, rtol=1e-9)
    np.testing.assert_allclose(carried.covariance, one.covariance, rtol=1e-6, atol=1e-14)


def test_what_a_model_takes_up_is_added_to_its_parameters() -> None:
    """A payload that the old model tells from the links is in the links of the new one, with its σ."""
    base = base_parameters(RegressorModel.of(robots.load("emps")))
    plain = Relation.of(base)
    size = len(base.names)
    own = np.hstack([np.eye(len(plain.standard)), np.zeros((len(plain.standard), 1))])
    matrix = np.vstack([plain.matrix @ own, np.eye(len(plain.standard) + 1)[-1]])
    old = Relation((*base.names, "M_payload"), (*plain.standard, "M_payload"), matrix)
    factors = np.zeros((size, 1))
    factors[base.names.index("M1R")] = 1.0
    assert determined_by(old, plain.taking_up(("M_other",), factors)) is None
    mapping = determined_by(old, plain.taking_up(("M_payload",), factors))
    assert mapping is not None
    np.testing.assert_allclose(mapping, np.hstack([np.eye(size), factors]), atol=1e-12)
    night = Night(0.0, np.arange(1.0, size + 2), np.diag(np.arange(1.0, size + 2)))
    moved = in_terms_of(night, mapping)
    assert moved.values[0] == night.values[0] + night.values[-1]
    assert moved.covariance[0, 0] == night.covariance[0, 0] + night.covariance[-1, -1]
    np.testing.assert_array_equal(moved.values[1:], night.values[1:-1])
    assert plain.taking_up((), np.zeros((size, 0))) is plain


def test_more_of_what_the_baseline_has_found_has_its_name() -> None:
    robot = robots.load("emps")
    usual = RegressorModel.of(robot)
    base = base_parameters(usual)
    values = dict(zip(base.names, base.regroup(usual.prior()), strict=True)) | {"Fs1": 8.0, "Fc1_2": 1.0}
    entries = (
        EffectEntry("coulomb_friction", (1,), {}),
        EffectEntry("stribeck_friction", (1,), {"stribeck_speed": 0.05, "exponent": 1.0}),
    )
    names = tuple(effect.name for effect in usual.effects)
    richer = base_parameters(extended_model(robot, FoundModel("file", names, entries, values)))
    regressor = np.random.default_rng(0).normal(size=(50, 1, len(richer.names)))
    rows = Rows(np.arange(50.0), np.zeros(50, int), regressor[:, :, 0], regressor, np.ones((50, 1), bool))
    beta = np.array([values[name] for name in richer.names])
    found = {p.words: p for p in patterns_of(geometry_of(richer, rows, np.ones(1), beta))}
    pattern = found["stribeck friction of joint 1"]
    assert (pattern.effect, pattern.joint, pattern.scale, pattern.units) == (
        "stribeck_friction",
        1,
        8.0,
        ("N",),
    )
    assert np.flatnonzero(pattern.directions[:, 0]).tolist() == [richer.names.index("Fs1")]
    assert np.flatnonzero(found["coulomb friction of joint 1"].directions[:, 0]).tolist() == [
        richer.names.index("Fc1_2")
    ]
    assert "Coulomb friction of joint 1" in found
