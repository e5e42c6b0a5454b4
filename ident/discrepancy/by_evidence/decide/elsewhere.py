"""What a set says of motion all over the travel, and whether another set says the same there.

Friction that falls with speed has Coulomb friction in its limit, a stiffening cable a straight spring. Where
the recordings have looked for what the one has more, and it is as good as nothing, the two say the same of
any motion and are one name. Where an arm has moved slowly, or over a tenth of its travel, the fits agree
there and nowhere else: then they are two names, and a motion tells which is right.

Two fits also differ in what either of them is not sure of, the size of a friction and the parameters beside
it: that is no difference of names. So a form is asked whether *some* limit that the recordings allow says
the same: with T − T' the difference of their torques, A the columns of the limit and of what is known beside
it, and L Lᵀ the precision of their factors,

    min ‖T − T' − A L⁻ᵀu‖  over  ‖u‖ ≤ 1.96

Nor does a form say more than its limit where the limit is a part of it, is there, and what makes it the form
is less than its own deviation: a straight spring of 4.85 ± 0.01 N·m/rad that stiffens by 0.03 ± 0.08.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import brentq

from ident.discrepancy.by_evidence.decide.instruments import predicted
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.known import known_columns
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, prepare
from ident.discrepancy.by_evidence.evidence.rows import Known, effect_rows
from ident.recording import Recording
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray, IntArray
from robots.description import Robot

_DURATION = 24.0
"""s, as a motion is that is planned to tell names apart."""

_OF_LIMITS = 0.9
"""Of travel, speed and acceleration: what a motion comes to that keeps to them."""

_ALLOWED = 1.96
"""Deviations that hold 95 % of one direction."""


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Rows of a motion all over the travel, as the model under examination predicts them.

    Attributes:
        problem: the model.
        prepared: the motion.
        known: columns of what every model has.
    """

    problem: Problem
    prepared: Prepared
    known: Known

    @classmethod
    def of(cls, problem: Problem) -> Elsewhere:
        """For the arm, the sampling and the time of the recordings that are fitted.

        A motion shows nothing of another time: a brake that lets go after the last sample has rubbed all the
        time.
        """
        robot, present, parts = problem.prepared.robot, problem.present, problem.prepared.parts
        swings = all_over(robot, parts[0].sample_time)
        recorded = parts[-1].own.time
        assert recorded is not None
        pieces = (prepare(robot, (piece,)) for piece in cut(swings, float(recorded[-1])))
        whole = Prepared(robot, tuple(part for piece in pieces for part in piece.parts))
        prepared = predicted(whole, present)
        known, _ = known_columns(prepared, problem.base, problem.prior, problem.start, present)
        return cls(problem, prepared, known)

    def same(self, form: Found, limit: Found) -> bool:
        """Whether a limit that the recordings allow lacks less of a form than an accepted model leaves.

        Args:
            form: a set as it was fitted.
            limit: another; the parameters of its members and what is known are what the recordings say of
                them, its shapes are kept.
        """
        return bool(np.all(self.lacking(form, limit) <= self.problem.misfit.accepted))

    def adds(self, form: Found, limit: Found) -> bool:
        """Whether a form has more than a limit, as far as the recordings show.

        It has not where what makes it the form is less than its own deviation, which explains no half a nat,
        other parameters of it are told at 95 %, and the form without the former says what the limit says.

        Args:
            form: a set as it was fitted; its last member is asked about.
            limit: another.
        """
        count = form.members[-1].entry.white.count
        own = np.arange(form.posterior.theta.size - count, form.posterior.theta.size)
        sigma = np.sqrt(np.diag(form.posterior.covariance))[form.posterior.known.size :]
        deviations = (np.abs(form.posterior.theta) / sigma)[own]
        untold = [k for k in form.members[-1].candidate.family.essential if deviations[k] < 1.0]
        if not untold or not np.any(deviations > _ALLOWED):
            return True
        return not self.same(_at_nothing(form, own[untold]), limit)

    def lacking(self, form: Found, limit: Found) -> FloatArray:
        """(n,) rms, N·m (or N), of what of a form the nearest such limit does not say."""
        rows = np.where(self.prepared.used, 1.0, 0.0)
        rows = rows / np.sqrt(np.maximum(rows.sum(axis=0), 1.0))  # squares of a joint's rows sum up to a mean
        change = rows * (self._torque(form) - self._torque(limit))
        columns = rows[:, :, np.newaxis] * self._columns(limit)
        flat = columns.reshape(change.size, -1)
        weight = (np.ones_like(rows) / self.problem.misfit.accepted).reshape(-1)
        moved = solve_triangular(limit.posterior.factor, (weight[:, np.newaxis] * flat).T, lower=True)
        nearest = solve_triangular(
            limit.posterior.factor, within(moved.T, weight * change.reshape(-1)), lower=True, trans=1
        )
        return np.asarray(np.sqrt(np.sum((change - columns @ nearest) ** 2, axis=0)))

    def _columns(self, found: Found) -> FloatArray:
        """Rows × joints × (k + p), of what is known and of a set's members in units of their scales."""
        placed = (member.entry.placed for member in found.members)
        own = [effect_rows(self.prepared, one) * np.array(one.scale) for one in placed]
        return np.concatenate([self.known.columns, *own], axis=2)

    def _torque(self, found: Found) -> FloatArray:
        """Rows × joints, N·m (or N), of a set and what is known beside it."""
        total = self.known.columns @ found.posterior.known
        for number, member in enumerate(found.members):
            total = total + effect_rows(self.prepared, member.entry.placed) @ found.theta(number)[0]
        return np.asarray(total)


def _at_nothing(found: Found, numbers: IntArray) -> Found:
    """A set of which some of θ are nothing, and the rest what it is then."""
    posterior = found.posterior
    mean, k = np.concatenate([posterior.known, posterior.theta]), posterior.known.size
    with_them = posterior.covariance[:, k + numbers]
    mean = mean - with_them @ np.linalg.solve(with_them[k + numbers], mean[k + numbers])
    return replace(found, posterior=replace(posterior, known=mean[:k], theta=mean[k:]))


def within(columns: FloatArray, wanted: FloatArray) -> FloatArray:
    """u (k,) of least ‖wanted − columns u‖ with ‖u‖ ≤ 1.96: no further than the 95 % of one direction.

    Args:
        columns: (rows, k), each for a deviation of what it stands for.
        wanted: (rows,).
    """
    values, vectors = eigen_of(columns.T @ columns)
    along = vectors.T @ (columns.T @ wanted)
    values = np.maximum(values, 1e-12 * max(float(values[-1]), 1e-300))

    def beyond(log_price: float) -> float:
        return float(np.linalg.norm(along / (values + np.exp(log_price)))) - _ALLOWED

    free = along / values
    if np.linalg.norm(free) <= _ALLOWED:
        return np.asarray(vectors @ free)
    # With the price alone it is within; a little more, for rounding.
    most = float(np.log(np.linalg.norm(along) / _ALLOWED)) + 1e-6
    price = np.exp(brentq(beyond, float(np.log(values[0])) - 60.0, most))
    return np.asarray(vectors @ (along / (values + price)))


def cut(swings: Recording, most: float) -> list[Recording]:
    """A motion in the fewest equal pieces that last no longer than so many s, each from time 0 on."""
    count = int(np.ceil(swings.time[-1] / most))
    samples = swings.time.shape[0] // count
    starts = samples * np.arange(count)
    return [
        Recording(
            swings.name,
            swings.time[:samples],
            None,
            swings.position[start : start + samples],
            swings.control_signal[start : start + samples],
        )
        for start in starts
    ]


def all_over(robot: Robot, step: float) -> Recording:
    """Every joint swings over its travel, as fast as it may, each in its own time; no torque.

    Args:
        robot: its limits. No collision is looked for: nothing moves.
        step: between samples, s.
    """
    time = np.asarray(step * np.arange(round(_DURATION / step)), dtype=np.float64)
    half = _OF_LIMITS * 0.5 * (robot.upper - robot.lower)
    rate = _OF_LIMITS * np.minimum(robot.velocity_limits / half, np.sqrt(robot.acceleration_limits / half))
    position = 0.5 * (robot.upper + robot.lower) + half * np.sin(np.multiply.outer(time, rate))
    return Recording("all over the travel", time, None, position, np.zeros_like(position))
