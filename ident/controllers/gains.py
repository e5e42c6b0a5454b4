"""Gains of one drive from sums of squares and products of its columns.

A law says how the columns' factors ψ follow from its gains θ; for all but the cascade they are the gains
themselves. In the cascade v = s + K_i ∫s, s = A e − B q̇ + C q̇_r, the factors are bilinear, and Gauss-Newton
solves for them. All of it needs only XᵀX and Xᵀv, so that fits on many choices of blocks cost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.controllers.columns import NAMES
from ident.controllers.structure import Form
from robots.arrays import FloatArray

_E, _DQ, _DR, _IE, _IDQ, _IDR, _ONE, _DDR = range(len(NAMES))
_ITERATIONS = 30
_STILL = 1e-10
_INTEGRALS = (0.1, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 300.0)
"""1/s; integral gains of cascades to start from."""


@dataclass(frozen=True)
class Products:
    """XᵀX (K, K), Xᵀv (K,) and vᵀv of some samples, with their number and the sum of v."""

    gram: FloatArray
    cross: FloatArray
    square: float
    total: float
    count: int

    @classmethod
    def of(cls, x: FloatArray, v: FloatArray) -> Products:
        return cls(x.T @ x, x.T @ v, float(v @ v), float(v.sum()), v.size)

    def __add__(self, other: Products) -> Products:
        return Products(
            self.gram + other.gram,
            self.cross + other.cross,
            self.square + other.square,
            self.total + other.total,
            self.count + other.count,
        )

    def squared_error(self, factors: FloatArray) -> float:
        """Σ(v − Xψ)²."""
        return float(self.square - 2 * factors @ self.cross + factors @ self.gram @ factors)

    @property
    def variation(self) -> float:
        """Σ(v − mean of v)²."""
        return self.square - self.total**2 / self.count


def solve_gains(form: Form, products: Products) -> tuple[FloatArray, FloatArray]:
    """θ of a form, and ∂ψ/∂θ (K, len θ) there.

    θ: A, B, then C where the velocity is fed forward, K_i of the cascade or the gain of ∫e of the PID, the
    integral's start (without an integral: the offset of v_τ), the gain of q̈_r; of the free form all of ψ.
    """
    starts = [np.zeros(_size(form))]
    if form.law == "cascade_p_pi":
        starts = [_given_integral(form, products, rate) for rate in _INTEGRALS]
    theta = min(starts, key=lambda start: products.squared_error(_factors(form, start)))
    for _ in range(_ITERATIONS):
        slope = _slope(form, theta)
        step = _least_squares(slope, products, products.cross - products.gram @ _factors(form, theta))
        theta = theta + step
        if np.abs(step).max() <= _STILL * np.abs(theta).max():
            break
    return theta, _slope(form, theta)


def _given_integral(form: Form, products: Products, rate: float) -> FloatArray:
    """θ of a cascade whose integral gain (1/s) is given: then all else is linear."""
    theta = np.zeros(_size(form))
    place = 2 + form.velocity_feed_forward
    theta[place] = rate
    free = np.delete(_slope(form, theta), place, axis=1)
    return np.insert(_least_squares(free, products, products.cross), place, rate)


def _least_squares(slope: FloatArray, products: Products, rest: FloatArray) -> FloatArray:
    normal = slope.T @ products.gram @ slope
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * np.outer(scale, scale)
    return np.asarray(scale * np.linalg.lstsq(scaled, scale * (slope.T @ rest), rcond=1e-13)[0])


def factors(form: Form, theta: FloatArray) -> FloatArray:
    """ψ (K,) of the gains θ."""
    return _factors(form, theta)


def _size(form: Form) -> int:
    if form.law == "free":
        return len(NAMES)
    return 3 + form.velocity_feed_forward + (form.law != "pd") + form.acceleration_feed_forward


def _proportional(form: Form) -> list[int]:
    return [_E, _DQ, _DR] if form.velocity_feed_forward else [_E, _DQ]


def _factors(form: Form, theta: FloatArray) -> FloatArray:
    psi = np.zeros(len(NAMES))
    if form.law == "free":
        psi[:] = theta
        return psi
    columns = _proportional(form)
    m = len(columns)
    psi[columns] = theta[:m]
    if form.law == "pid":
        psi[[_IE, _ONE]] = theta[m : m + 2]
    elif form.law == "cascade_p_pi":
        psi[[c + _IE for c in columns]] = theta[m] * theta[:m]
        psi[_ONE] = theta[m + 1]
    else:
        psi[_ONE] = theta[m]
    if form.acceleration_feed_forward:
        psi[_DDR] = theta[-1]
    return psi


def _slope(form: Form, theta: FloatArray) -> FloatArray:
    if form.law == "free":
        return np.eye(len(NAMES))
    slope = np.zeros((len(NAMES), theta.size))
    columns = _proportional(form)
    m = len(columns)
    slope[columns, range(m)] = 1.0
    if form.law == "pid":
        slope[[_IE, _ONE], [m, m + 1]] = 1.0
    elif form.law == "cascade_p_pi":
        integrals = [c + _IE for c in columns]
        slope[integrals, range(m)] = theta[m]
        slope[integrals, m] = theta[:m]
        slope[_ONE, m + 1] = 1.0
    else:
        slope[_ONE, m] = 1.0
    if form.acceleration_feed_forward:
        slope[_DDR, -1] = 1.0
    return slope
