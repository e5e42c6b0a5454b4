"""Periodic reference motions within an arm's limits."""

from __future__ import annotations

import numpy as np

from benchmarks.foreign_plant.arms import Arm
from benchmarks.foreign_plant.settings import Settings

_SPEED, _HEIGHT = 0.55, 12.0
"""Share of the speed limits, and rad/s², that a motion stays below before tones come on top."""

_TONES = 12
_TONE_SHARE = 0.04
"""Of the speed limit: the rms of all tones' speed."""


def reference(arm: Arm, settings: Settings, generator: np.random.Generator) -> np.ndarray:
    """One period, samples × n, rad; it ends where it begins, at the same velocity."""
    samples = round(settings.period * settings.rate)
    if settings.motion == "fourier":
        return _fourier(arm, settings, generator, samples)
    ways = _waypoints(arm, settings, generator, samples)
    return ways if settings.motion == "waypoints" else ways + _tones(arm, settings, generator, samples)


def _middle(arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    travel = np.array([link.travel for link in arm.links])
    return travel.mean(axis=1), arm.swing * np.ptp(travel, axis=1)


def _waypoints(arm: Arm, settings: Settings, generator: np.random.Generator, samples: int) -> np.ndarray:
    """Quintic ways between random postures, all joints at once, with a short stop at some of them."""
    middle, reach = _middle(arm)
    speed = _SPEED * np.array([link.speed for link in arm.links])
    length = settings.period
    while True:
        count = max(2, round(length * generator.uniform(0.9, 1.35)))
        posts = middle + reach * generator.uniform(-1.0, 1.0, (count, arm.n))
        posts = np.vstack([posts, posts[:1]])
        stops = np.where(generator.uniform(size=count) < 0.2, 0.15, 0.0)
        lengths = generator.uniform(0.7, 1.3, count)
        lengths *= (length - stops.sum()) / lengths.sum()
        edges = np.concatenate([[0.0], np.cumsum(lengths + stops)])
        time = np.arange(samples) / settings.rate
        found = np.empty((samples, arm.n))
        for k in range(count):
            inside = (time >= edges[k] - 1e-9) & (time < edges[k + 1] - 1e-9)
            share = np.clip((time[inside] - edges[k]) / lengths[k], 0.0, 1.0)[:, np.newaxis]
            way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            found[inside] = posts[k] + way * (posts[k + 1] - posts[k])
        peak = 1.875 * np.abs(np.diff(posts, axis=0)) / lengths[:, np.newaxis]
        height = 5.774 * np.abs(np.diff(posts, axis=0)) / lengths[:, np.newaxis] ** 2
        worst = max(float((peak / speed).max()), float(np.sqrt(height.max() / _HEIGHT)))
        if worst <= 1.0:
            return found
        reach = reach * max(0.6, min(0.97, 1.0 / worst**2))


def _fourier(arm: Arm, settings: Settings, generator: np.random.Generator, samples: int) -> np.ndarray:
    """Ten harmonics of the period, scaled to the limits joint by joint."""
    middle, reach = _middle(arm)
    phase = 2 * np.pi * np.arange(samples) / samples
    orders = np.arange(1, 11)
    waves = np.concatenate([np.cos(np.outer(phase, orders)), np.sin(np.outer(phase, orders))], axis=1)
    weights = generator.normal(size=(2 * orders.size, arm.n)) / np.tile(orders, 2)[:, np.newaxis] ** 0.7
    found = waves @ weights
    found -= found.mean(axis=0)
    per_second = 2 * np.pi / settings.period
    rate = np.gradient(found, phase[1], axis=0) * per_second
    height = np.gradient(rate, phase[1], axis=0) * per_second
    speed = _SPEED * np.array([link.speed for link in arm.links])
    scale = np.minimum(reach / np.abs(found).max(axis=0), speed / np.abs(rate).max(axis=0))
    scale = np.minimum(scale, _HEIGHT / np.abs(height).max(axis=0))
    return np.asarray(middle + scale * found)


def _tones(arm: Arm, settings: Settings, generator: np.random.Generator, samples: int) -> np.ndarray:
    """Tones at multiples of the period's frequency from 2 to 28 Hz, other ones on every joint."""
    time = np.arange(samples) / settings.rate
    step = 1.0 / settings.period
    speed = np.array([link.speed for link in arm.links])
    found = np.zeros((samples, arm.n))
    for j in range(arm.n):
        hz = step * np.round(np.geomspace(2.0, 28.0, _TONES) * generator.uniform(0.95, 1.0, _TONES) / step)
        for one in hz:
            size = _TONE_SHARE * speed[j] * np.sqrt(2.0 / _TONES) / (2 * np.pi * one) * (5.0 / max(one, 5.0))
            found[:, j] += size * np.sin(2 * np.pi * one * time + generator.uniform(0.0, 2 * np.pi))
    return found
