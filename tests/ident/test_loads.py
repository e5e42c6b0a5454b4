"""Recordings with known bodies on the arm: torques by pin, which carries the bodies itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio
import pytest

from ident import Fitted, Options, Recording, identify
from ident.identification.loads import unknown_of
from robots.carried import Load
from robots.payload import Payload, PayloadError
from tests.ident.pinocchio_arm import record, tx40

CENTER, INERTIA = (0.03, -0.02, 0.10), (0.004, 0.0, 0.005, 0.0, 0.0, 0.003)
HEAVY = Payload(2.0, CENTER, INERTIA)
LIGHT = Payload(0.8, (0.0, 0.04, 0.05), (0.001, 0.0, 0.001, 0.0, 0.0, 0.001))


def body(payload: Payload) -> pinocchio.Inertia:
    """As pin carries it."""
    assert payload.center is not None
    assert payload.inertia is not None
    xx, xy, yy, xz, yz, zz = payload.inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pinocchio.Inertia(payload.mass, np.array(payload.center), tensor)


@cache
def bare() -> Recording:
    return record(1)


@cache
def heavy() -> Recording:
    return record(2, body=body(HEAVY))


@cache
def light() -> Recording:
    return record(3, body=body(LIGHT))


def on(recording: Recording, payload: Payload, name: str = "heavy.toml") -> Recording:
    return replace(recording, load=payload.load(tx40(), name))


@cache
def alone() -> Fitted:
    """Of the bare arm's recording."""
    return identify(tx40(), (bare(),), options=Options(method="ls"))


def off(fitted: Fitted, truth: Fitted) -> np.ndarray:
    """(b,) how far the parameters are from those of another fit, in σ of both."""
    one, two = fitted.result.least_squares, truth.result.least_squares
    size = np.sqrt(np.diag(one.covariance) + np.diag(two.covariance))
    return np.asarray(np.abs(one.values - two.values) / size)


def test_recordings_with_different_known_bodies_are_one_arm() -> None:
    together = (bare(), on(heavy(), HEAVY), on(light(), LIGHT, "light.toml"))
    fitted = identify(tx40(), together, options=Options(method="ls"))
    assert off(fitted, alone()).max() < 4.0
    # Three recordings say more than one, and none of the bodies is in the links.
    wider = np.sqrt(np.diag(alone().result.least_squares.covariance))
    narrower = np.sqrt(np.diag(fitted.result.least_squares.covariance))
    assert np.median(narrower / wider) < 0.8
    assert fitted.result.least_squares.relative_error_percent < 1.1 * (
        alone().result.least_squares.relative_error_percent
    )


def test_a_body_that_is_not_told_spoils_the_fit() -> None:
    fitted = identify(tx40(), (bare(), heavy()), options=Options(method="ls"))
    told = identify(tx40(), (bare(), on(heavy(), HEAVY)), options=Options(method="ls"))
    assert fitted.result.least_squares.relative_error_percent > (
        3.0 * told.result.least_squares.relative_error_percent
    )


def test_of_the_mass_alone_centre_and_inertia_are_found() -> None:
    fitted = identify(tx40(), (bare(), on(heavy(), Payload(2.0))), options=Options(method="ls"))
    assert off(fitted, alone()).max() < 4.0
    words = next(words for words in fitted.result.warnings if words.startswith("heavy.toml"))
    assert "its centre times mass is MX" in words
    base = fitted.base
    unknown = unknown_of(base, (bare(), on(heavy(), Payload(2.0))))
    true = HEAVY.load(tx40()).ten[1:]
    sigma = np.sqrt(np.diag(unknown.covariance))
    assert (np.abs(unknown.values - true) / sigma).max() < 4.0
    assert np.abs(unknown.values[:3] - true[:3]).max() < 0.01
    assert (sigma[:3] < 0.01).all()


def test_what_no_recording_tells_from_the_links_widens_their_sigma() -> None:
    """One load on all recordings: its centre is in the last link's parameters, as far as anyone knows."""
    load = Payload(2.0).load(tx40(), "heavy.toml")
    always = (replace(heavy(), load=load),)
    fitted = identify(tx40(), always, options=Options(method="ls"))
    known = identify(tx40(), (on(heavy(), HEAVY),), options=Options(method="ls"))
    words = next(words for words in fitted.result.warnings if words.startswith("heavy.toml"))
    assert "9 of the 9 unknown figures do not show" in words
    at = [k for k, name in enumerate(fitted.base.names) if name.startswith(("MX6", "MY6", "MZ6"))]
    wide, narrow = (np.sqrt(np.diag(one.result.least_squares.covariance)) for one in (fitted, known))
    assert (wide[at] > 5.0 * narrow[at]).all()
    values, true = (one.result.least_squares.values for one in (fitted, known))
    assert (np.abs(values - true) < 3.0 * wide + 3.0 * narrow).all()
    halves = [one.result.least_squares.parameters[at[0]].half_width for one in (fitted, known)]
    assert None not in halves
    assert halves[0] > 5.0 * halves[1]  # type: ignore[operator]


def test_a_known_centre_leaves_the_inertia_alone_unknown() -> None:
    load = Payload(2.0, CENTER).load(tx40())
    assert load.unknown == (4, 5, 6, 7, 8, 9)
    np.testing.assert_allclose(load.ten[:4], HEAVY.load(tx40()).ten[:4])
    point = pinocchio.Inertia(2.0, np.array(CENTER), np.zeros((3, 3))).toDynamicParameters()
    np.testing.assert_allclose(load.ten, point, atol=1e-12)


def test_a_load_is_carried_through_pieces() -> None:
    loaded = on(heavy(), HEAVY)
    piece = loaded.piece(slice(10, 500), "a piece")
    assert piece.load is loaded.load
    assert piece.time.size == 490


def test_a_load_that_no_body_has_is_refused() -> None:
    with pytest.raises(PayloadError, match="no body has the mass"):
        Payload(1.0, CENTER, (1.0, 0.0, 0.1, 0.0, 0.0, 0.1)).load(tx40())


def test_values_of_what_is_unknown_stand_in_their_order() -> None:
    load = Load("x", 5, np.array([2.0, *[0.0] * 9]), (1, 2, 3))
    assert load.with_values(np.array([1.0, 2.0, 3.0])).ten[:5].tolist() == [2.0, 1.0, 2.0, 3.0, 0.0]
