"""The gap between model and measurement on recordings that were not fitted, beside its noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.closed_loop import simulate
from ident.discrepancy.loop import Standstill, settled
from ident.discrepancy.loop_parts import simulated_with
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.repeats import not_repeating
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Gap:
    """Per joint (n,): rms before and after the finding, and the floor that no model gets below.

    The floor is NaN where the trajectory does not repeat, so that noise cannot be told from misfit.
    """

    before: FloatArray
    after: FloatArray
    floor: FloatArray

    def explainable(self, level: FloatArray) -> FloatArray:
        """sqrt(max(level² − floor², 0)), method.md 6.1."""
        floor = np.where(np.isfinite(self.floor), self.floor, 0.0)
        return np.asarray(np.sqrt(np.maximum(level**2 - floor**2, 0.0)))

    @property
    def closed(self) -> float | None:
        """Share of the explainable gap's energy, in units of the floors, that is closed; None without one."""
        before, after = self.explainable(self.before), self.explainable(self.after)
        unit = np.where(np.isfinite(self.floor) & (self.floor > 0), self.floor, 1.0)
        whole = float(np.sum((before / unit) ** 2))
        return None if whole == 0.0 else float(1.0 - np.sum((after / unit) ** 2) / whole)


def torque_residual(base: BaseParameters, beta: FloatArray, piece: PreparedRecording) -> FloatArray:
    """Measured less predicted joint torque at the full rate, samples × joints, N·m (or N)."""
    return np.asarray(piece.full_torque - base.torque(piece.measured, beta))


def torque_gap(base: BaseParameters, beta: FloatArray, prepared: Sequence[PreparedRecording]) -> FloatArray:
    """rms torque residual per joint over the rows where it moves, (n,)."""
    squares, counts = np.zeros(base.model.robot.n), np.zeros(base.model.robot.n)
    for piece in prepared:
        residual = piece.residual(base, beta)
        squares += np.where(piece.moving, residual**2, 0.0).sum(axis=0)
        counts += piece.moving.sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(counts, 1)))


def torque_floor(base: BaseParameters, beta: FloatArray, prepared: Sequence[PreparedRecording]) -> FloatArray:
    """rms of what does not repeat in the torque residual, (n,); NaN without repeats."""
    squares, counts = np.zeros(base.model.robot.n), np.zeros(base.model.robot.n)
    for piece in prepared:
        if piece.period is None:
            return np.full(base.model.robot.n, np.nan)
        noise = piece.noise_of(torque_residual(base, beta, piece))
        squares += np.where(piece.moving, noise**2, 0.0).sum(axis=0)
        counts += piece.moving.sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(counts, 1)))


@dataclass(frozen=True)
class LoopTrace:
    """Position errors q_mes − q_s of the first validation recording, samples × joints, rad (or m)."""

    time: FloatArray
    before: FloatArray
    after: FloatArray


@dataclass(frozen=True)
class LoopGap:
    """Closed-loop differences, rms per joint or drive (n,): q_mes − q_s in rad (or m), v_τ − v_s.

    All from the instant on at which the friction is forgotten that the arm stood with, of which no simulation
    knows; ``errors`` are q_mes − q_s of each recording, samples × joints, and ``time`` is theirs.
    """

    position: FloatArray
    control_signal: FloatArray
    errors: tuple[FloatArray, ...]
    time: tuple[FloatArray, ...]


def closed_loop_gap(
    base: BaseParameters,
    standard: FloatArray,
    prepared: Sequence[PreparedRecording],
    standstill: Standstill | None = None,
) -> tuple[LoopGap | None, str]:
    """The same in the closed-loop simulation, or the reason why there is none.

    Args:
        base: the model.
        standard: (p,) its parameters.
        prepared: recordings.
        standstill: dry friction of each drive at standstill; that of the description where None.
    """
    n = base.model.robot.n
    position, signal, samples = np.zeros(n), np.zeros(n), 0
    errors: list[FloatArray] = []
    times: list[FloatArray] = []
    for piece in prepared:
        try:
            if standstill is None:
                run = simulate(base.model, standard, piece.recording)
            else:
                run = simulated_with(base, standard, standstill, piece.recording)
        except IdentificationError as error:
            return None, str(error)
        recording, start = piece.recording, min(settled(piece), run.time.shape[0] // 2)
        errors.append((recording.position - run.position)[start:])
        times.append(recording.time[start:])
        position += (errors[-1] ** 2).sum(axis=0)
        signal += ((recording.control_signal - run.control_signal)[start:] ** 2).sum(axis=0)
        samples += errors[-1].shape[0]
    sizes = np.sqrt(position / samples), np.sqrt(signal / samples)
    return LoopGap(*sizes, tuple(errors), tuple(times)), ""


def position_floor(prepared: Sequence[PreparedRecording]) -> FloatArray:
    """rms of what does not repeat in the measured positions, (n,); NaN without repeats."""
    squares, samples = 0.0, 0
    for piece in prepared:
        if piece.period is None:
            return np.full(piece.torque.shape[1], np.nan)
        squares = squares + (not_repeating(piece.recording.position, piece.period) ** 2).sum(axis=0)
        samples += piece.recording.time.shape[0]
    return np.asarray(np.sqrt(squares / samples))
