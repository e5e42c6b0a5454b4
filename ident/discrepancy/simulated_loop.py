"""A model simulated on recordings: what it leaves of the drives' torque, and what of that is noise."""

from __future__ import annotations

import numpy as np

from ident.closed_loop import SimulatedRun
from ident.discrepancy.loop import (
    FINE,
    Loop,
    Standstill,
    repeated,
    settled,
)
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_parts import simulated_parts
from ident.discrepancy.prepared_recording import PreparedRecording, without_drift
from ident.discrepancy.repeats import not_repeating
from ident.effects import State
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from robots.arrays import FloatArray


def loop_evidence(
    loop: Loop, base: BaseParameters, beta: FloatArray, standstill: Standstill
) -> tuple[LoopEvidence, FloatArray, FloatArray]:
    """Simulate a model: the evidence, what it leaves of the measured torque, and what of that is noise.

    The last two are rows × drives, N·m (or N).

    Raises:
        IdentificationError: the loop cannot be simulated with these parameters, or nothing repeats.
    """
    if any(piece.period is None for piece in loop.prepared):
        raise IdentificationError("the trajectory does not repeat, so noise cannot be told from misfit")
    standard = base.standard_from(beta, base.model.prior())
    parts = simulated_parts(loop, base, standard, standstill)
    runs = loop.run(parts, FINE)
    motion = tuple(_motion(loop, piece, run) for piece, run in zip(loop.prepared, runs, strict=True))
    left, noise = [], []
    for piece, run in zip(loop.prepared, runs, strict=True):
        difference = piece.recording.control_signal - repeated(run.control_signal, piece)
        left.append(difference)
        start, period = settled(piece), piece.period or 1
        alone = np.zeros_like(difference)
        alone[start:] = not_repeating(difference[start:], period)
        alone[start:] = without_drift(_tiled(piece, run, start), alone[start:], period)
        noise.append(alone)
    rest, unrepeated = loop.rows(left), loop.rows(noise)
    size = np.sqrt(np.mean(unrepeated**2, axis=0))
    present = Present(base.model, standard)
    evidence = LoopEvidence(loop, base, present, standstill, parts, {FINE: runs}, motion, size)
    return evidence, rest, unrepeated


def _tiled(piece: PreparedRecording, run: SimulatedRun, start: int) -> State:
    velocity = repeated(run.velocity, piece)[start:]
    return State(velocity, velocity, velocity, piece.recording.time[start:])


def _motion(loop: Loop, piece: PreparedRecording, run: SimulatedRun) -> State:
    """The simulated motion in the middle of the rows of the settling and one period."""
    samples = settled(piece) + (piece.period or 0)
    step = piece.recording.sample_time
    acceleration = np.gradient(run.velocity[:samples], step, axis=0)
    index = np.arange(loop.decimation // 2, samples, loop.decimation)
    torque = loop.robot.joint_torque(run.control_signal[:samples])
    return State(
        run.position[index],
        run.velocity[index],
        acceleration[index],
        piece.recording.time[index],
        torque[index],
        piece.recording.load,
    )
