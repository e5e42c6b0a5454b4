"""The motion that tells candidates for a missing effect apart."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ident.effects import Effect, State
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray, IntArray
from robots.description import Robot
from trajectories.approach import lead_home, posture_of
from trajectories.errors import PlanError, as_plan_errors
from trajectories.information.matrix import NONE, Objective
from trajectories.information.separation import (
    DEPENDENT,
    CandidateColumns,
    Separation,
    SeparationObjective,
    separations,
)
from trajectories.judgement import Conditions
from trajectories.motions.motion import Motion, MotionState
from trajectories.motions.segments import join
from trajectories.plan import Origin, exciting_problem, finished, put_together, searches_of
from trajectories.search.chain import ChainBuilder
from trajectories.search.multi_start import Progress, best_of
from trajectories.search.problem import ExcitationProblem
from trajectories.trajectory import Trajectory

PROBE_RATE = 100.0
"""Hz at which candidates are looked at, to see which of their columns are their own."""


@dataclass(frozen=True)
class Discrimination:
    """A motion that tells candidates apart, and what it is worth.

    Attributes:
        trajectory: ready to stream.
        separation_before: of each pair on the motion that was there before.
        separation_after: of each pair, in the same order, on the new one.
    """

    trajectory: Trajectory
    separation_before: tuple[Separation, ...]
    separation_after: tuple[Separation, ...]


def discriminate(
    robot: Robot,
    base: BaseParameters,
    candidates: Sequence[Sequence[Effect]],
    *,
    cycle_time: float,
    duration: float,
    seed: int,
    names: Sequence[str] | None = None,
    before: Motion | None = None,
    known: FloatArray | None = None,
    every_row: bool = False,
    start: ArrayLike | None = None,
    conditions: Conditions | None = None,
    evaluations: int = 6_000,
    searches: int = 1,
    workers: int = 1,
    periods: int = 1,
    speed: float = 1.0,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> Discrimination:
    """Plan the motion on which candidates that explain the same misfit differ most.

    Every pair is compared with itself on ``before``, and the pair that gains least is worked on. Segments may
    also last longer than they need, so slow passes are within reach: slow motion tells a lag from a delay.
    Effects that look along time (drift, lags, hysteresis) are judged on whole motions.

    With the families of :mod:`ident.effects.vocabulary`, whose effects the discrepancy search has at hand::

        payload, spring = family_named("payload"), family_named("gravity_spring")
        candidates = [
            [payload.effect(robot, Place("tool", ()), (), present)],
            [spring.effect(robot, Place("joint", (1,)), (), present)],
        ]
        discriminate(robot, base, candidates, cycle_time=0.004, duration=12.0, seed=0, known=known)

    Args:
        robot: the arm.
        base: base parameters of the present model; a refit of them is partialled out.
        candidates: two or more sets of effects with fixed shapes, each set one explanation.
        cycle_time: of the samples, s.
        duration: of one period, from rest at home to rest at home, s.
        seed: fixes the search.
        names: of the candidates; those of their effects where not given.
        before: the motion on which they could not be told apart, to compare with; an ordinary motion of the
            same search where not given.
        known: (b × b) inverse covariance of the base parameters from an accepted model. With it, effects that
            a refit would swallow (payload, spring, gain) can be told apart too.
        every_row: count slow rows too, for effects that live at reversals.
        start, conditions, evaluations, searches, workers, periods, speed, progress, stop: as for
            :func:`trajectories.plan`.

    Raises:
        PlanError: fewer than two candidates, one that the model already has, two that no motion can tell
            apart, or a motion that cannot be made.
    """
    with as_plan_errors():
        conditions = conditions or Conditions()
        labels, posture = _labels(candidates, names), posture_of(robot, start)
        lead = lead_home(robot, posture, cycle_time, conditions)
        usual = exciting_problem(robot, base, duration, Objective(), conditions)
        effects = tuple(effect for candidate in candidates for effect in candidate)
        regressor = StackedRegressor(base, effects)
        probe = join(
            [p.motion for p in ChainBuilder(usual, np.random.default_rng(seed)).first_chain().pieces]
        )
        columns = _columns(regressor, usual, probe, labels, candidates, known)
        problem = replace(
            usual,
            regressor=regressor,
            prior=np.concatenate([usual.prior, np.zeros(len(columns.scale) - columns.model)]),
            counted=None if every_row else usual.counted,
            whole=not all(looks_at_instants(effect, probe) for effect in effects),
        )
        old = probe if before is None else before
        rate = 1.0 / (cycle_time * robot.identification.decimation)
        objective = SeparationObjective(columns).against(_matrix(old, problem, rate))
        problem = replace(problem, objective=objective)
        running = searches_of(problem, "ruckig", seed, evaluations, searches, periods)
        best, done = best_of(running, workers, progress, stop)
        if best.best_score >= NONE:
            raise PlanError(
                f"{duration:g} s of motion do not tell {' and '.join(labels)} apart; allowed: a longer "
                "duration or more evaluations",
                constraint="separation",
            )
        motion, repeat, speed = put_together(lead, best, periods, speed, cycle_time)
        origin = Origin("ruckig", seed, done, repeat, speed)
        plain = finished(robot, base, motion, cycle_time, conditions, Objective(), origin, posture)
        return Discrimination(
            replace(plain, score=best.best_score),
            separations(_matrix(old, problem, rate), columns),
            separations(_matrix(motion, problem, rate), columns),
        )


@dataclass(frozen=True)
class StackedRegressor:
    """The base regressor with the columns of further effects behind it."""

    base: BaseParameters
    effects: tuple[Effect, ...]

    def __call__(self, state: MotionState) -> FloatArray:
        """samples × joints × K."""
        here = State(state.position, state.velocity, state.acceleration, state.time)
        blocks = [self.base.columns(here), *(effect.columns(here) for effect in self.effects)]
        return np.concatenate(blocks, axis=2)


def looks_at_instants(effect: Effect, motion: Motion) -> bool:
    """Whether an effect's columns depend on each sample alone, neither on those before nor on the time."""
    count = max(20, round(motion.duration * PROBE_RATE) // 2 * 2)
    time = _evenly(motion.duration, count)
    state = motion.at(time)

    def columns(every: int, shift: float) -> FloatArray:
        rows = slice(None, None, every)
        return effect.columns(
            State(state.position[rows], state.velocity[rows], state.acceleration[rows], time[rows] + shift)
        )

    dense = columns(1, 0.0)
    size = np.abs(dense).max() + np.finfo(float).tiny
    thin, later = columns(2, 0.0), columns(1, 100.0)
    return bool(np.abs(thin - dense[::2]).max() < 1e-9 * size and np.abs(later - dense).max() < 1e-9 * size)


def _evenly(duration: float, count: int) -> FloatArray:
    return np.asarray(np.arange(count) * (duration / count), dtype=np.float64)


def _labels(candidates: Sequence[Sequence[Effect]], names: Sequence[str] | None) -> tuple[str, ...]:
    if len(candidates) < 2 or not all(candidates):
        filled = sum(map(bool, candidates))
        raise PlanError(
            f"{len(candidates)} candidates, {filled} of them with effects; allowed: two or more",
            constraint="candidates",
        )
    labels = names or ["+".join(effect.name for effect in candidate) for candidate in candidates]
    if len(labels) != len(candidates):
        raise PlanError(f"{len(labels)} names for {len(candidates)} candidates", constraint="candidates")
    return tuple(labels)


def _columns(
    regressor: StackedRegressor,
    problem: ExcitationProblem,
    probe: Motion,
    labels: tuple[str, ...],
    candidates: Sequence[Sequence[Effect]],
    known: FloatArray | None,
) -> CandidateColumns:
    """Which columns are whose, from one motion.

    Raises:
        PlanError: a candidate is part of the model, or two are the same.
    """
    count = max(10, round(probe.duration * PROBE_RATE))
    time = _evenly(probe.duration, count)
    rows = regressor(replace(probe.at(time), time=time)) / problem.sigma[:, np.newaxis]
    flat = rows.reshape(-1, rows.shape[2])
    scale = np.sqrt((flat**2).mean(axis=0))
    b = len(regressor.base.names)
    unit = flat / np.where(scale > 0.0, scale, 1.0) / np.sqrt(len(flat))
    sizes = [sum(len(effect.parameters) for effect in candidate) for candidate in candidates]
    ends = b + np.cumsum([0, *sizes])
    # A parameter that nothing is known of takes up whatever lies along its column, prior or not.
    free = np.ones(b, dtype=np.bool_) if known is None else np.diag(known) == 0.0
    model = unit[:, :b][:, free]
    blocks = [np.arange(first, last) for first, last in itertools.pairwise(ends)]
    visible = tuple(_independent(unit, block, model) for block in blocks)
    for label, block in zip(labels, visible, strict=True):
        if block.size == 0:
            raise PlanError(
                f"{label} is part of the model already: a refit explains all of it; allowed: an effect with "
                "columns of its own, or an accepted model to compare with",
                constraint="candidates",
            )
    own = {
        (i, j): _independent(unit, visible[i], np.column_stack([model, unit[:, visible[j]]]))
        for i in range(len(blocks))
        for j in range(len(blocks))
        if i != j
    }
    for i, j in own:
        if i < j and own[i, j].size == own[j, i].size == 0:
            raise PlanError(
                f"{labels[i]} and {labels[j]} make the same torque: no motion tells them apart",
                constraint="candidates",
            )
    information = np.zeros((b, b)) if known is None else known
    scale = np.where(scale > 0.0, scale, 1.0)
    weight = np.outer(scale[:b], scale[:b])
    return CandidateColumns(labels, b, visible, own, information / weight, scale)


def _independent(unit: FloatArray, block: IntArray, others: FloatArray) -> IntArray:
    """Those of a block of columns that depend neither on others nor on earlier ones of the block."""
    basis = np.linalg.qr(others)[0] if others.shape[1] else others
    kept = []
    for column in block:
        rest = unit[:, column] - basis @ (basis.T @ unit[:, column])
        rest -= basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > DEPENDENT:
            kept.append(int(column))
            basis = np.column_stack([basis, rest / size])
    return np.array(kept, dtype=np.int64)


def _matrix(motion: Motion, problem: ExcitationProblem, rate: float) -> FloatArray:
    """The information of the rows of a motion that count, ``rate`` of them per second."""
    fine = replace(problem, search_rate=max(rate, PROBE_RATE), prior=np.zeros_like(problem.prior))
    matrices = fine.matrices([motion])
    assert matrices is not None, "without a prior torque no motion is refused"
    return np.asarray(matrices[0] * (rate / PROBE_RATE))
