"""Pseudo-inertias against the definition by point masses, and against the classical conditions."""

from __future__ import annotations

import numpy as np
import pinocchio
from hypothesis import given
from hypothesis import strategies as st

from robots.pseudo_inertia import impossible_links, link_map, link_of_pseudo_inertia, pseudo_inertia

seeds = st.integers(0, 10_000)


def body(seed: int, points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A cloud of point masses: standard parameters, masses and places."""
    generator = np.random.default_rng(seed)
    masses, places = generator.uniform(0.1, 2.0, points), generator.normal(0.0, 0.3, (points, 3))
    inertia = sum(m * ((x @ x) * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, places, strict=True))
    tail = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return np.concatenate([[masses.sum()], masses @ places, tail]), masses, places


@given(seed=seeds, points=st.integers(1, 8))
def test_it_is_the_second_moment_of_the_mass(seed: int, points: int) -> None:
    link, masses, places = body(seed, points)
    extended = np.column_stack([places, np.ones(points)])
    assert np.allclose(pseudo_inertia(link), (extended.T * masses) @ extended, atol=1e-12)
    assert impossible_links(link[np.newaxis]) == ()


@given(seed=seeds)
def test_there_and_back(seed: int) -> None:
    link = np.random.default_rng(seed).normal(size=10)
    assert np.allclose(link_of_pseudo_inertia(pseudo_inertia(link)), link, atol=1e-14)
    assert np.allclose(link_map() @ pseudo_inertia(link).ravel(), link, atol=1e-14)


@given(seed=seeds)
def test_impossible_is_what_the_triangle_inequality_says(seed: int) -> None:
    generator = np.random.default_rng(seed)
    moments = generator.uniform(0.01, 1.0, 3)
    rotation = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    tensor = rotation @ np.diag(moments) @ rotation.T
    found = pinocchio.Inertia(2.0, generator.normal(size=3), tensor).toDynamicParameters()
    largest = moments.max()
    possible = largest <= moments.sum() - largest
    assert (impossible_links(np.array([found, -found])) == (1,)) == possible


def test_a_negative_mass_is_impossible() -> None:
    link, _, _ = body(1, 6)
    link[0] *= -1.0
    assert impossible_links(np.array([link])) == (0,)
