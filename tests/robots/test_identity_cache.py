"""Answers that are kept for a while."""

from __future__ import annotations

from operator import eq

import numpy as np

from robots.identity_cache import IdentityCache


def test_what_was_asked_last_is_not_made_again_and_the_oldest_is_forgotten() -> None:
    cache: IdentityCache[int] = IdentityCache(2)
    made: list[int] = []

    def make(value: int) -> int:
        made.append(value)
        return value

    first, second, third = (np.zeros(3) for _ in range(3))
    order = ((1, first), (2, second), (9, second), (9, first), (3, third), (9, first), (4, second))
    for value, asked in order:
        cache.of(asked, lambda value=value: make(value))  # type: ignore[misc]
    assert made == [1, 2, 3, 4]  # equal arrays are not the same; the second was asked for longest ago
    assert cache.of(first, lambda: make(5)) == 1


def test_what_is_forgotten_is_made_again() -> None:
    cache: IdentityCache[int] = IdentityCache(2)
    asked = np.zeros(3)
    assert cache.of(asked, lambda: 1) == cache.of(asked, lambda: 2) == 1
    cache.forget()
    assert cache.of(asked, lambda: 2) == 2


def test_what_is_the_same_can_be_said() -> None:
    cache: IdentityCache[int] = IdentityCache(2, same=eq)
    assert cache.of((1, "a"), lambda: 1) == cache.of((1, "a"), lambda: 2) == 1


def test_what_was_made_meanwhile_stays() -> None:
    cache: IdentityCache[int] = IdentityCache(4)
    first, second = np.zeros(3), np.ones(3)
    assert cache.of(first, lambda: cache.of(second, lambda: 1) + 1) == 2
    assert cache.of(second, lambda: 3) == 1
