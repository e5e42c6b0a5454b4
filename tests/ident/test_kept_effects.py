"""A spring that was found against a prior keeps its stiffness: torques by pin, and a spring beside them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio

from daq.files.found_model import found_json, found_of_json, read_found_model
from daq.files.model_file import write_model
from ident import Estimate, Fitted, Options, Recording, identify
from ident.effects.entry import EffectEntry
from ident.identification.found_effects import FoundModel
from robots.arrays import FloatArray
from tests.ident.pinocchio_arm import record, tx40

STIFFNESS, PRELOAD = 30.0, 5.0
SPRING = EffectEntry("gravity_spring", (2,), {})
NAMES = ("stiffness2", "preload2")


def pulling(
    model: pinocchio.Model, data: pinocchio.Data, q: FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    return np.array([0.0, STIFFNESS * q[1] + PRELOAD, 0.0, 0.0, 0.0, 0.0])


@cache
def swinging() -> Recording:
    """A small motion about home: there a spring is much like the weight of the upper arm."""
    return record(4, hook=pulling, share=0.12)


@cache
def wide() -> Fitted:
    """Without the spring and over the whole range: what the links are."""
    return identify(tx40(), (record(1), record(2)), options=Options(method="ls"))


@cache
def known() -> FoundModel:
    """As a diagnosis against a prior finds it: to some 2 %."""
    fitted = wide()
    values = {p.name: p.value for p in fitted.result.least_squares.parameters}
    usual = tuple(effect.name for effect in fitted.base.model.effects)
    covariance = {(name, name): sigma**2 for name, sigma in zip(NAMES, (0.6, 0.4), strict=True)}
    found = {"stiffness2": STIFFNESS + 0.5, "preload2": PRELOAD - 0.3}
    return FoundModel("why.model.toml", usual, (SPRING,), values | found, covariance)


@cache
def with_spring(*, kept: bool) -> Fitted:
    model = known() if kept else replace(known(), covariance={})
    return identify(tx40(), (swinging(),), options=Options(method="ls", found=model))


def of(estimate: Estimate, name: str) -> tuple[float, float]:
    return next((p.value, p.sigma) for p in estimate.parameters if p.name == name)


def test_the_spring_keeps_what_was_found_of_it() -> None:
    alone, kept = (with_spring(kept=one).result.least_squares for one in (False, True))
    value, sigma = of(kept, "stiffness2")
    # Without the covariance the spring is left out, or hardly known.
    alone_names = [p.name for p in alone.parameters]
    assert "stiffness2" not in alone_names or of(alone, "stiffness2")[1] > 5.0
    assert sigma < 0.6
    assert abs(value - STIFFNESS) < 3.0 * sigma


def test_links_that_a_free_spring_takes_along_stay() -> None:
    alone, kept, true = (
        one.result.least_squares for one in (with_spring(kept=False), with_spring(kept=True), wide())
    )
    # The moment of the upper arm, which pulls as the spring does.
    name = next(p.name for p in true.parameters if p.name.startswith("MX2"))
    off = [abs(of(estimate, name)[0] - of(true, name)[0]) for estimate in (alone, kept)]
    assert off[1] < 3.0 * of(kept, name)[1]
    assert off[0] > 2.0 * off[1]
    half = next(p.half_width for p in kept.parameters if p.name == "stiffness2")
    assert half is not None
    assert half < 2.0


def test_recordings_that_say_something_else_say_so() -> None:
    wrong = {**known().values, "stiffness2": 10.0 * STIFFNESS}
    fitted = identify(
        tx40(), (swinging(),), options=Options(method="ls", found=replace(known(), values=wrong))
    )
    said = [words for words in fitted.result.warnings if "these recordings alone say" in words]
    assert len(said) == 1
    assert said[0].startswith("stiffness2 is 300 ± 0.6 in why.model.toml")
    none = with_spring(kept=True).result.warnings
    assert not any("these recordings alone say" in words for words in none)


def test_a_model_file_tells_what_is_known_of_the_spring(tmp_path: Path) -> None:
    fitted = with_spring(kept=True)
    log = tmp_path / "log.csv"
    log.write_text("t\n0\n", "utf-8")
    path = tmp_path / "why.model.toml"
    write_model(path, fitted, [log], fitted.base.model.robot)
    read = read_found_model(path, tx40())
    estimate = fitted.result.recommended
    own = NAMES[:1]  # an offset takes the preload up
    places = [fitted.base.names.index(name) for name in own]
    there = np.array([[read.covariance[a, b] for b in own] for a in own])
    np.testing.assert_allclose(there, estimate.covariance[np.ix_(places, places)], rtol=1e-6)
    assert found_of_json(found_json(read)) == read
