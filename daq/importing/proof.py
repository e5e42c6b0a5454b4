"""What the data themselves say of a log's channels: derivative, following, gravity.

All at a few hundred samples of smoothed signals: enough to tell what is what, and quick.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.effects import State
from ident.parameters.regressor import RegressorModel
from ident.signals import differentiate, low_pass
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_ROWS = 400
"""Samples at which the torque is compared with the motion."""
_SAME = 0.9
"""Correlation from which on one channel is another's derivative."""


def smooth(values: FloatArray, period: float, cutoff: float) -> FloatArray:
    """The channel as identification sees it, samples × joints."""
    return low_pass(values, cutoff, period, 4)


def derivative_of(position: FloatArray, period: float) -> FloatArray:
    return differentiate(position, period, 2)


def slope_between(first: FloatArray, second: FloatArray) -> tuple[float, float]:
    """By how much the second is larger than the first, and their correlation: medians over joints."""
    slopes, correlations = [], []
    for one, other in zip(first.T, second.T, strict=True):
        a, b = one - one.mean(), other - other.mean()
        sizes = float(np.abs(a).max(initial=0.0)), float(np.abs(b).max(initial=0.0))
        if min(sizes) > 0 and np.isfinite(sizes).all():
            a, b = a / sizes[0], b / sizes[1]  # a damaged column may hold values whose squares are too large
            slopes.append(a @ b / (a @ a) * sizes[1] / sizes[0])
            correlations.append(a @ b / np.sqrt((a @ a) * (b @ b)))
    if not slopes:
        return 0.0, 0.0
    return float(np.median(slopes)), float(np.median(correlations))


def is_same(correlation: float) -> bool:
    return correlation > _SAME


@dataclass(frozen=True)
class TorqueProof:
    """Torques beside the motion of an arm, at a few hundred samples.

    Attributes:
        robot: the arm as its URDF describes it.
        position, velocity, acceleration: rows × n, smoothed; as the log has them.
        torque: rows × n, smoothed; in the log's unit.
    """

    robot: Robot
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    torque: FloatArray

    @classmethod
    def of(
        cls, robot: Robot, position: FloatArray, torque: FloatArray, period: float, cutoff: float
    ) -> TorqueProof:
        """From samples × n; the ends, where filters settle, are left out."""
        q, tau = smooth(position, period, cutoff), smooth(torque, period, cutoff)
        v = derivative_of(q, period)
        a = derivative_of(v, period)
        edge = min(len(q) // 10, int(2 / (cutoff * period)) + 2)
        rows = np.linspace(edge, len(q) - 1 - edge, min(_ROWS, len(q) - 2 * edge)).astype(int)
        return cls(robot, q[rows], v[rows], a[rows], tau[rows])

    @cached_property
    def model(self) -> RegressorModel:
        return RegressorModel.of(self.robot)

    def columns(self, offset: FloatArray) -> FloatArray:
        """Standard regressor, rows × n × p, with positions moved by ``offset``."""
        return self.model.columns(State(self.position + offset, self.velocity, self.acceleration))

    def shares(self, offset: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) torque of the log per torque of the URDF's bodies, and their deviations.

        Each joint's torque is explained by the URDF's, friction, its own inertia and an offset.
        """
        bodies = self.columns(offset) @ self.model.prior()
        found = [self._share(joint, bodies[:, joint]) for joint in range(self.n)]
        return np.array([value[0] for value, _ in found]), np.array([sigma[0] for _, sigma in found])

    def _share(self, joint: int, bodies: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A single axis asks for nothing but its own inertia: then there is no other to tell it from."""
        drive = self._drive(joint)
        size = np.std(bodies) * np.std(drive[:, 2])
        if size > 0 and abs(np.cov(bodies, drive[:, 2])[0, 1]) > _SAME_AS_INERTIA * size:
            drive = np.delete(drive, 2, axis=1)
        return _fit(np.column_stack([bodies, drive]), self.torque[:, joint])

    def frictions(self, offset: FloatArray) -> FloatArray:
        """(n, 2) viscous and dry friction of each joint, in their deviations."""
        columns, found = self.columns(offset), []
        for joint in range(self.n):
            bodies = columns[:, joint, : 10 * self.n]
            bodies = bodies[:, np.abs(bodies).max(axis=0) > 1e-12]
            drive = self._drive(joint)
            value, sigma = _fit(np.column_stack([drive, bodies]), self.torque[:, joint])
            found.append(value[:2] / np.maximum(sigma[:2], np.finfo(float).tiny))
        return np.array(found)

    def brakes(self, offset: FloatArray) -> bool:
        """Whether friction is in the torque of most joints that have one, and drives none of them."""
        live = np.ptp(self.torque, axis=0) > 0
        friction = self.frictions(offset)[live]
        driven = (friction < -_SIGNS).all(axis=1).any()
        return bool(live.any() and (friction > _SIGNS).any(axis=1).mean() > 0.5 and not driven)

    def turned(self, offset: FloatArray, against: BoolArray) -> list[int]:
        """Joints whose torque is written with the other sign.

        Both frictions would drive them; or their bodies ask for the opposite and no friction brakes them.

        Args:
            offset: of the positions.
            against: (n,) whether the bodies ask for the opposite.
        """
        friction = self.frictions(offset)
        driven = (friction < -_SIGNS).all(axis=1) | (against & ~(friction > _SIGNS).any(axis=1))
        return [int(joint) for joint in np.flatnonzero(driven)]

    def _drive(self, joint: int) -> FloatArray:
        """Columns of one drive, rows × 4: viscous and dry friction, inertia, offset."""
        v, a = self.velocity[:, joint], self.acceleration[:, joint]
        return np.column_stack([v, np.tanh(v / 0.02), a, np.ones(len(v))])

    def explained(self, offset: FloatArray) -> FloatArray:
        """(n, n) share of the variance of the torque in row i that the motion of joint j foretells.

        Bodies of any mass, friction, the joint's own inertia and an offset are fitted to every second stretch
        of the log and foretell the others: what only fits foretells nothing.
        """
        columns = self.columns(offset)[:, :, : 10 * self.n]
        fitted = (np.arange(len(columns)) * _STRETCHES // len(columns)) % 2 == 0
        found = np.zeros((self.n, self.n))
        for joint in range(self.n):
            x = np.column_stack([self._drive(joint), columns[:, joint]])
            x = x[:, np.abs(x).max(axis=0) > 1e-12]
            x = x / np.linalg.norm(x, axis=0)
            for part in (fitted, ~fitted):
                left = self.torque[~part] - x[~part] @ (
                    np.linalg.pinv(x[part], rcond=1e-3) @ self.torque[part]
                )
                size = np.var(self.torque, axis=0)
                found[:, joint] += 0.5 - 0.5 * np.mean(left**2, axis=0) / np.where(size > 0, size, np.inf)
        return found

    @property
    def n(self) -> int:
        return self.robot.n

    def error(self, offset: FloatArray) -> float:
        """Relative error of one set of bodies for all joints, each weighed by the size of its torque."""
        columns = self.columns(offset)
        size = np.std(self.torque, axis=0)
        x = (columns / size[:, np.newaxis]).reshape(-1, columns.shape[2])
        x = x[:, np.abs(x).max(axis=0) > 1e-12]
        y = (self.torque / size).reshape(-1)
        scale = np.linalg.norm(x, axis=0)
        residual = y - x @ (np.linalg.lstsq(x / scale, y, rcond=1e-7)[0] / scale)
        return float(np.linalg.norm(residual) / np.linalg.norm(y))

    def gains(self, offset: FloatArray, start: FloatArray) -> FloatArray:
        """(n,) torque at the joint per unit of the log, so that one set of bodies explains all joints.

        Bodies are shared between joints, so gains of one arm are bound to each other; only their common
        scale is not seen, and stays that of ``start`` (the geometric mean, by the URDF's masses).
        Alternating least squares: bodies by gains, gains by bodies.
        """
        columns = self.columns(offset)
        p = columns.shape[2]
        scale = np.linalg.norm(columns.reshape(-1, p), axis=0)
        keep = scale > 1e-9 * scale.max()
        x = columns[:, :, keep] / scale[keep]
        gains = start.copy()
        weight = np.std(self.torque, axis=0)
        for _ in range(_TURNS):
            sigma = np.abs(gains) * weight
            rows = (x / sigma[:, np.newaxis]).reshape(-1, x.shape[2])
            y = (self.torque * gains / sigma).reshape(-1)
            beta = np.linalg.lstsq(rows, y, rcond=1e-7)[0]
            modelled = x @ beta
            fresh = np.sum(modelled**2, axis=0) / np.sum(modelled * self.torque, axis=0)
            fresh *= np.exp(np.mean(np.log(np.abs(start)) - np.log(np.abs(fresh))))
            if np.abs(fresh / gains - 1).max() < _STILL:
                return np.asarray(fresh)
            gains = fresh
        return gains


_STRETCHES = 16
"""Of a log, every second of which is foretold from the others."""
_TURNS = 60
_STILL = 1e-3
_SAME_AS_INERTIA = 0.999
"""Correlation with the joint's acceleration."""
_SIGNS = 5.0
"""Deviations below zero from which on a friction is negative."""


def _fit(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least squares with deviations of independent errors; columns may depend on each other."""
    scale = np.linalg.norm(x, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv(x / scale, rcond=1e-9)
    solution = inverse @ y
    residual = y - x / scale @ solution
    variance = residual @ residual / max(len(y) - x.shape[1], 1)
    return solution / scale, np.sqrt(variance * np.sum(inverse**2, axis=1)) / scale
