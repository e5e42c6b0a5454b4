"""A baseline whose model has other parameters than tonight's: compared on what both know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import BaseParameters, IdentificationError, RegressorModel, base_parameters
from ident.drift import Geometry, Night, Relation, common_base, compare, in_base_of, patterns_of
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
