"""The closed loop of some recordings, ready to be simulated many times.

A simulation of the present model under the same references and the same control law makes the same torque
as the arm, reversals and standstills included, but for noise and for what the model lacks. A sign of the
velocity cannot hold a load: friction is that of bristles here, which bend before they slide, or a smooth
function of the speed, whichever the recordings say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.closed_loop.compiled import run_compiled
from ident.closed_loop.friction_rows import FrictionRows
from ident.closed_loop.leading import Leading, SimulatedRun, leading_of
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.effects import FrictionSign, RigidBody
from ident.effects.chain import chain_frames
from ident.effects.simulated import Bristle, FrictionTorque, SimulatedParts, SoftConstraint
from ident.errors import IdentificationError
from ident.kernels.values import TANH
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray, IntArray
from robots.description import Robot

SETTLING = 1.0
"""s after the start until the arm is in its periodic motion and the friction it stood with is forgotten."""

Standstill = tuple[Bristle | FrictionSign | SoftConstraint, ...]
"""(n,) how the dry friction of each drive turns its sign at standstill."""

COARSE, FINE = 1, 4
"""Integration steps per controller sample: for what an effect changes; for what is compared with the arm."""


@dataclass(frozen=True)
class Loop:
    """Recordings, and what leads a simulation of them.

    Attributes:
        robot: the arm.
        prepared: the recordings.
        decimation: samples that are averaged to a row.
        whole, once: what leads a whole recording, and its settling and one period (all of it where nothing
            repeats); per number of integration steps.
    """

    robot: Robot
    prepared: tuple[PreparedRecording, ...]
    decimation: int
    whole: dict[int, tuple[Leading, ...]]
    once: dict[int, tuple[Leading, ...]]
    frames: FloatArray
    structures: dict[tuple[str, ...], ModelStructure] = field(default_factory=dict, repr=False, compare=False)
    """Of models with these usual effects, in their order."""

    @classmethod
    def of(cls, model: RegressorModel, prepared: Sequence[PreparedRecording]) -> Loop:
        """Prepare the recordings.

        Args:
            model: of the arm, with the settings of the search.
            prepared: the recordings.

        Raises:
            IdentificationError: a recording cannot be simulated, or is too short.
        """
        robot = model.robot
        links = next(effect for effect in model.effects if isinstance(effect, RigidBody))
        frames = chain_frames(links.model)
        if frames is None:
            raise IdentificationError("a branched chain of links has no compiled simulation")
        steps = (COARSE, FINE)
        whole = {n: tuple(leading_of(robot, _timed(piece), n) for piece in prepared) for n in steps}
        once = {n: tuple(leading_of(robot, _first_period(piece), n) for piece in prepared) for n in steps}
        return cls(robot, tuple(prepared), prepared[0].decimation, whole, once, frames)

    def run(self, parts: TorqueParts, substeps: int) -> tuple[SimulatedRun, ...]:
        """Simulate each recording; what does not depend on time only until it repeats.

        Raises:
            IdentificationError: the loop is unstable or the mass matrix is not positive definite.
        """
        if parts.others:
            raise IdentificationError(f"{parts.others[0][0].name} has no compiled simulation")
        leading = self.whole[substeps] if depends_on_time(parts.extra) else self.once[substeps]
        return tuple(run_compiled(self.frames, one, parts.carrying(one.recording.load)) for one in leading)

    def torque(self, runs: Sequence[SimulatedRun]) -> FloatArray:
        """Drive torque of runs, rows × drives over all recordings."""
        return self.rows([run.control_signal for run in runs])

    def measured(self) -> FloatArray:
        """The same of the recordings."""
        return self.rows([piece.recording.control_signal for piece in self.prepared])

    def rows(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Control signals, of whole recordings or until they repeat, as averaged drive torque."""
        parts = [
            self._averaged(repeated(signal, piece), piece)
            for signal, piece in zip(signals, self.prepared, strict=True)
        ]
        return np.concatenate(parts) * self.robot.gains

    def segment(self) -> IntArray:
        """(rows,) which recording."""
        return np.repeat(np.arange(len(self.prepared)), [self.count(piece) for piece in self.prepared])

    def count(self, piece: PreparedRecording) -> int:
        """Rows of a recording."""
        return int((piece.recording.time.shape[0] - settled(piece)) // self.decimation)

    def _averaged(self, signal: FloatArray, piece: PreparedRecording) -> FloatArray:
        start, rows = settled(piece), self.count(piece)
        kept = signal[start : start + rows * self.decimation]
        return np.asarray(kept.reshape(rows, self.decimation, -1).mean(axis=1))


def settled(piece: PreparedRecording) -> int:
    """Samples of the settling."""
    return round(SETTLING / piece.recording.sample_time)


def sample_of(piece: PreparedRecording, index: IntArray) -> IntArray:
    """Which sample of the settling and first period stands for samples of the whole recording."""
    if piece.period is None:
        return index
    start, period = settled(piece), piece.period
    return np.asarray(np.where(index < start, index, start + (index - start) % period))


def repeated(signal: FloatArray, piece: PreparedRecording) -> FloatArray:
    """A whole recording of what was simulated until it repeats, (samples, …)."""
    samples = piece.recording.time.shape[0]
    if signal.shape[0] >= samples:
        return signal
    return np.asarray(signal[sample_of(piece, np.arange(samples))])


def _timed(piece: PreparedRecording) -> Recording:
    return replace(piece.recording, time=piece.recording.time + piece.started)


def _first_period(piece: PreparedRecording) -> Recording:
    recording = piece.recording
    if piece.period is None:
        return _timed(piece)
    samples = settled(piece) + piece.period
    if samples >= recording.time.shape[0]:
        raise IdentificationError(f"{recording.name}: less than two periods after the first second")
    return recording.piece(slice(samples))


def depends_on_time(extra: SimulatedParts) -> bool:
    """Whether anything of a model changes over a recording."""
    courses = [torque.course for torque in extra.friction] + [torque.course for torque in extra.position]
    warming = any(torque.warming is not None for torque in extra.friction)
    return warming or any(course is not None for course in courses)


def added(parts: TorqueParts, more: SimulatedParts) -> TorqueParts:
    """The parts of a model with one more effect."""

    def total(old: FloatArray, new: FloatArray | None) -> FloatArray:
        return old if new is None else np.asarray(old + new)

    extra = parts.extra
    return replace(
        parts,
        links=total(parts.links, more.links),
        gravity=total(parts.gravity, more.gravity),
        inertia=total(parts.inertia, more.inertia),
        damping=total(parts.damping, more.damping),
        constant=total(parts.constant, more.constant),
        extra=SimulatedParts(
            position=(*extra.position, *more.position),
            friction=(*extra.friction, *more.friction),
            springs=(*extra.springs, *more.springs),
            errors=(*extra.errors, *more.errors),
            drives=(*extra.drives, *more.drives),
            feet=(*extra.feet, *more.feet),
        ),
    )


def with_standstill(parts: TorqueParts, standstill: Standstill, robot: Robot) -> TorqueParts:
    """The parts with what holds at standstill in place of signs of the velocity.

    Args:
        parts: of a model whose friction signs are exact.
        standstill: of each drive.
        robot: says which drive a term belongs to.
    """
    usual, bent = parts.friction, []
    signs = (usual.heads[:, 1] == TANH) & (usual.heads[:, 2] == 0.0)
    for k in np.flatnonzero(signs):
        row = usual.speed[k]
        law = standstill[_drive_of(robot, row)]
        bent.append(FrictionTorque(row, usual.strength[k] * usual.torque[k], law))
    friction = FrictionRows(
        usual.heads[~signs], usual.speed[~signs], usual.torque[~signs], usual.strength[~signs], usual.laws
    )
    extra = replace(parts.extra, friction=(*bent, *_bent(parts.extra.friction, standstill, robot)))
    return replace(parts, friction=friction, extra=extra)


def with_standstill_of(parts: SimulatedParts, standstill: Standstill, robot: Robot) -> SimulatedParts:
    """The same of one effect."""
    return replace(parts, friction=_bent(parts.friction, standstill, robot))


def _bent(
    friction: Sequence[FrictionTorque], standstill: Standstill, robot: Robot
) -> tuple[FrictionTorque, ...]:
    return tuple(
        replace(torque, law=standstill[_drive_of(robot, torque.speed_row)])
        if isinstance(torque.law, FrictionSign) and torque.direction == 0
        else torque
        for torque in friction
    )


def _drive_of(robot: Robot, row: FloatArray) -> int:
    """The drive whose row of the transmission is nearest to a speed row."""
    matrix = robot.transmission_matrix
    likeness = np.abs(matrix @ row) / np.linalg.norm(matrix, axis=1)
    return int(np.argmax(likeness))
