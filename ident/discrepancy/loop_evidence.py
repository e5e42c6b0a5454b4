"""The present model in closed loop, and what each effect would change of the drives' torque there."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import binary_dilation, binary_opening, convolve1d

from ident.closed_loop import SimulatedRun
from ident.closed_loop.torque_parts import TorqueParts
from ident.discrepancy.loop import (
    COARSE,
    FINE,
    Loop,
    Standstill,
    added,
    depends_on_time,
    sample_of,
    settled,
    with_standstill_of,
)
from ident.discrepancy.loop_parts import exact_sign_variant, simulated_parts, with_exact_signs
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.effects import Effect, State
from ident.effects.family import PlacedEffect
from ident.effects.placed import Placed
from ident.effects.simulated import SimulatedParts
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Robot

_log = logging.getLogger(__name__)

_TAPS = 12
"""Rows over which the loop answers a torque."""
_PROBE = 1.0
"""What an effect is simulated with changes the torque by so many times the noise, where it shows most."""
_REST, _REST_SPEED = 0.1, 0.002
"""s of a drive below this share of its speed limit are a rest."""


@dataclass(frozen=True)
class LoopEvidence:
    """One model with its parameters, simulated; and the answers of the loop to changes of it.

    Attributes:
        loop: the recordings.
        base: the model.
        standstill: how each drive's dry friction turns its sign.
        parts: the model as the simulation takes it.
        runs: of the model, per number of integration steps.
        motion: per recording the simulated motion at the middle of each row of the settling and one period.
        answer: (n, taps) how the loop answers torque on a drive, row after row; None until it is known.
        noise: (n,) rms of what does not repeat in the drives' torque.
    """

    loop: Loop
    base: BaseParameters
    present: Present
    standstill: Standstill
    parts: TorqueParts
    runs: dict[int, tuple[SimulatedRun, ...]]
    motion: tuple[State, ...]
    noise: FloatArray
    answer: FloatArray | None = None

    @property
    def robot(self) -> Robot:
        return self.loop.robot

    def screen(self, effects: Sequence[PlacedEffect]) -> FloatArray:
        """About what effects do to the drives' torque: rows × drives × all their parameters."""
        columns = [self._columns(self.variant(effect)) for effect in effects]
        return self._through_loop(np.concatenate(columns, axis=2))

    def variant(self, effect: PlacedEffect) -> Placed:
        """The effect on an arm whose friction has an exact sign."""
        return exact_sign_variant(self.robot, effect, self.present)

    def respond(self, effect: PlacedEffect) -> FloatArray | None:
        """What the effect does per unit of each parameter, by simulation: rows × drives × p.

        Args:
            effect: of the vocabulary.

        Returns:
            None where the loop with the effect cannot be simulated.
        """
        variant = self.variant(effect)
        values = self.probe(effect)
        substeps = FINE if effect.stiff or self.parts.extra.springs else COARSE
        columns = []
        for k, value in enumerate(values):
            only = np.zeros(values.size)
            only[k] = value
            change = self.change_by(variant, only, substeps)
            if change is None:
                return None
            columns.append(change / value)
        return np.stack(columns, axis=2)

    def change_by(self, variant: Placed, values: FloatArray, substeps: int) -> FloatArray | None:
        """The same that an effect with an exact sign brings, its parameters (p,) given."""
        more = with_standstill_of(variant.simulated(values), self.standstill, self.robot)
        return self.change(more, substeps)

    def change(self, more: SimulatedParts, substeps: int = COARSE) -> FloatArray | None:
        """Change of the drives' torque that further parts bring; rows × drives, None where it runs away."""
        return self.change_to(added(self.parts, more), substeps)

    def change_to(self, parts: TorqueParts, substeps: int) -> FloatArray | None:
        """The same of other parts in place of the model's."""
        try:
            runs = self.loop.run(parts, substeps)
        except IdentificationError as error:
            _log.debug("not simulated: %s", error)
            return None
        return self.loop.torque(runs) - self.loop.torque(self.run(substeps))

    def run(self, substeps: int) -> tuple[SimulatedRun, ...]:
        """The model's own run."""
        if substeps not in self.runs:
            self.runs[substeps] = self.loop.run(self.parts, substeps)
        return self.runs[substeps]

    def probe(self, effect: PlacedEffect) -> FloatArray:
        """(p,) a value of each parameter that shows but stays within what is linear."""
        if effect.whole:
            return np.ones(len(effect.parameters))
        columns = self.screen([effect])
        size = np.sqrt(np.mean(columns**2, axis=0)) / self.noise[:, np.newaxis]
        values = _PROBE / np.maximum(size.max(axis=0), 1e-12)
        negative = np.array([high <= 0.0 for _, high in effect.bounds])
        return np.asarray(np.where(negative, -values, values))

    def column(self, index: int, step: float) -> FloatArray:
        """What a step of a base parameter does, per unit: rows × drives.

        Raises:
            IdentificationError: the loop cannot be simulated there.
        """
        base, standard = self.base, self.present.standard
        moved = np.zeros(base.independent.size)
        moved[index] = step
        shift = np.linalg.lstsq(base.relation, moved, rcond=None)[0]
        parts = simulated_parts(self.loop, base, standard + shift, self.standstill)
        substeps = FINE if parts.extra.springs else COARSE
        change = self.loop.torque(self.loop.run(parts, substeps)) - self.loop.torque(self.run(substeps))
        return np.asarray(change / step)

    def motion_of_rows(self) -> list[State]:
        """Per recording, the simulated motion at its rows, with the recording's time."""
        return [
            replace(_at(motion, rows), time=piece.started + self._row_times(piece))
            for piece, motion, rows in zip(self.loop.prepared, self.motion, self._rows, strict=True)
        ]

    def base_columns(self) -> FloatArray:
        """The base regressor at the simulated motion as drive torque: rows × drives × b, before the loop."""
        model = self.base.model
        usual = tuple(effect for effect in model.effects if not isinstance(effect, Placed))
        exact = with_exact_signs(RegressorModel(model.robot, usual))
        variants = tuple(
            self.variant(effect) for effect in model.effects[len(usual) :] if isinstance(effect, Placed)
        )
        whole = RegressorModel(exact.robot, (*exact.effects, *variants))
        return self._columns(BaseParameters(whole, self.base.independent, self.base.relation))

    def screened_base(self) -> FloatArray:
        """The same through the loop, about."""
        return self._through_loop(self.base_columns())

    def after(self, other: LoopEvidence) -> LoopEvidence:
        """The evidence with what another one knows of the same loop."""
        return replace(self, answer=other.answer)

    def _columns(self, effect: Effect | BaseParameters) -> FloatArray:
        """Columns at the simulated motion, as drive torque, tiled over the recordings."""
        parts = []
        for piece, motion, rows in zip(self.loop.prepared, self.motion, self._rows, strict=True):
            if isinstance(effect, Placed) and _drifts(effect):
                whole = _at(motion, rows)
                time = piece.started + self._row_times(piece)
                parts.append(self._at_drives(effect.columns(replace(whole, time=time))))
            else:
                parts.append(self._at_drives(effect.columns(motion)).take(rows, axis=0))
        return np.concatenate(parts)

    def _at_drives(self, columns: FloatArray) -> FloatArray:
        """Joints' columns, as the drives' torque."""
        return np.asarray(np.einsum("rjp,jd->rdp", columns, self._back))

    @cached_property
    def _back(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.robot.transmission_matrix))

    def moving(self) -> BoolArray:
        """Rows × drives: not at rest, nor within a moment of it; a reversal is no rest.

        What holds a drive at rest is friction of a past that nobody knows.
        """
        parts = []
        matrix = self.robot.transmission_matrix
        slow = _REST_SPEED * (np.abs(matrix) @ self.robot.velocity_limits)
        for piece, motion, rows in zip(self.loop.prepared, self.motion, self._rows, strict=True):
            still = np.abs(motion.velocity @ matrix.T)[rows] < slow
            row = piece.recording.sample_time * self.loop.decimation
            long = np.ones((max(2, round(_REST / row)), 1), dtype=np.bool_)
            at_rest = binary_opening(still, long)
            parts.append(~binary_dilation(at_rest, np.ones((2 * long.shape[0] + 1, 1), dtype=np.bool_)))
        return np.concatenate(parts)

    def _row_times(self, piece: PreparedRecording) -> FloatArray:
        return np.asarray(piece.recording.time[self._middles(piece)])

    def _middles(self, piece: PreparedRecording) -> IntArray:
        """Which sample of a recording is in the middle of each of its rows."""
        rows, decimation = self.loop.count(piece), self.loop.decimation
        return settled(piece) + np.arange(rows) * decimation + decimation // 2

    @cached_property
    def _rows(self) -> tuple[IntArray, ...]:
        """Per recording, which row of the simulated motion stands for each of its rows."""
        decimation, found = self.loop.decimation, []
        for piece, motion in zip(self.loop.prepared, self.motion, strict=True):
            first = (sample_of(piece, self._middles(piece)) - decimation // 2) // decimation
            found.append(np.asarray(np.minimum(first, motion.position.shape[0] - 1)))
        return tuple(found)

    def _through_loop(self, columns: FloatArray) -> FloatArray:
        if self.answer is None:
            return columns
        out = np.zeros_like(columns)
        for drive, answer in enumerate(self.answer):
            if columns[:, drive].any():  # most effects are of one drive
                own = out[:, drive]
                convolve1d(columns[:, drive], answer, 0, own, mode="constant", origin=-(_TAPS // 2))
        return out

    def with_answer(self, exact: FloatArray, which: Sequence[int]) -> LoopEvidence:
        """The evidence with the loop's answer fitted to simulated base columns (rows × drives × k)."""
        given = self.base_columns()[:, :, list(which)]
        answers = np.zeros((given.shape[1], _TAPS))
        answers[:, 0] = 1.0
        for drive in range(given.shape[1]):
            x, y = given[:, drive], exact[:, drive]
            size = np.sqrt(np.mean(x**2, axis=0))
            used = size > 1e-12
            if not used.any():
                continue
            x, y = x[:, used] / size[used], y[:, used] / size[used]
            lagged = np.stack([_late(x, k)[_TAPS:].ravel() for k in range(_TAPS)], axis=1)
            answers[drive] = np.linalg.lstsq(lagged.T @ lagged, lagged.T @ y[_TAPS:].ravel(), rcond=1e-8)[0]
        return replace(self, answer=answers)


def _late(values: FloatArray, rows: int) -> FloatArray:
    return values if rows == 0 else np.concatenate([np.zeros_like(values[:rows]), values[:-rows]])


def _at(motion: State, rows: IntArray) -> State:
    torque = None if motion.torque is None else motion.torque[rows]
    return State(
        motion.position[rows], motion.velocity[rows], motion.acceleration[rows], None, torque, motion.load
    )


def _drifts(effect: Placed) -> bool:
    return depends_on_time(effect.simulated(np.ones(len(effect.parameters))))
