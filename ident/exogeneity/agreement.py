"""Does the simulation reproduce the robot? Torque and following error of one closed loop, of either.

A tight loop makes the simulated motion that of the robot whatever the model: the regressors agree, and Π = I
says little. Two signals are not forced to agree. The *following error* q_r − q goes with the inverse of the
controller's gains, so it shows a wrong gain, filter or delay. The *torque* shows an effect that the model
lacks: it is what the drives put out beyond what the simulated ones do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.closed_loop.leading import SimulatedRun
from ident.decimation import decimate
from ident.errors import IdentificationError
from ident.exogeneity.motion_functions import loop_functions, torque_functions
from ident.preparation.observed_torque import observed_torque
from ident.recording import Recording
from ident.signals import kept_samples, low_pass, motion, own_rows, own_settings
from ident.statistics.restricted import regression_whitening
from ident.statistics.tails import beyond_f
from ident.verdicts import ColumnCheck, ColumnKind
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Robot

_EXACT = 1e-9
"""A difference below this share of the signal is rounding."""

_DEPENDENT = 1e-6
"""A direction of unit columns with a singular value below this is one that others hold already."""


@dataclass(frozen=True)
class SimulationAgreement:
    """Measured and simulated signals of a closed loop on the rows of the fit, and what may explain the rest.

    Attributes:
        torque_measured, torque_simulated: samples × joints, N·m (or N).
        torque_functions: samples × joints × k, of the simulated motion.
        following_measured, following_simulated: samples × drives, q_r − q at the drive outputs, rad (or m).
        loop_functions: samples × drives × k, of the simulated motion.
        moves: drives × joints, true where a drive moves with a joint.
    """

    torque_measured: FloatArray
    torque_simulated: FloatArray
    torque_functions: FloatArray
    following_measured: FloatArray
    following_simulated: FloatArray
    loop_functions: FloatArray
    moves: BoolArray


def simulation_agreement(
    robot: Robot, recordings: Sequence[Recording], runs: Sequence[SimulatedRun]
) -> SimulationAgreement:
    """Signals of recordings and of their simulations through the filters of the rows.

    Args:
        robot: its ``identification`` settings rule filter and decimation.
        recordings: each with a reference.
        runs: the simulation of each.

    Raises:
        IdentificationError: a recording has no reference.
    """
    parts = [_one(robot, recording, run) for recording, run in zip(recordings, runs, strict=True)]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return SimulationAgreement(**joined, moves=np.asarray(robot.transmission_matrix != 0.0))


def _one(robot: Robot, recording: Recording, run: SimulatedRun) -> dict[str, FloatArray]:
    """The signals of one recording by their names."""
    reference = recording.reference
    if reference is None:
        raise IdentificationError(f"{recording.name}: no position reference was recorded")
    settings = own_settings(recording, robot.identification)
    simulated = replace(recording, position=run.position, control_signal=run.control_signal)
    moved = motion(recording.time, run.position, settings)

    def thin(values: FloatArray) -> FloatArray:
        rows = decimate(values, settings.decimation, settings.decimation_filter)
        return own_rows(rows, recording, settings)

    def following(position: FloatArray) -> FloatArray:
        error = (reference - position) @ robot.transmission_matrix.T
        smooth = low_pass(error, settings.cutoff_hz, recording.sample_time, settings.filter_order)
        return smooth[kept_samples(error.shape[0], settings)]

    keep = kept_samples(recording.time.shape[0], settings)
    signal, torque = run.control_signal[keep], robot.joint_torque(run.control_signal)[keep]
    error = following(run.position)
    speed, rate = (values @ robot.transmission_matrix.T for values in (moved.velocity, moved.acceleration))
    lacking = [
        torque_functions(moved.position[:, j], moved.velocity[:, j], torque[:, j]) for j in range(robot.n)
    ]
    wrong = [loop_functions(error[:, d], signal[:, d], speed[:, d], rate[:, d]) for d in range(robot.n)]
    return {
        "torque_measured": observed_torque(robot, recording, settings, as_rows=True),
        "torque_simulated": observed_torque(robot, simulated, settings, as_rows=True),
        "torque_functions": thin(np.stack(lacking, axis=1)),
        "following_measured": thin(following(recording.position)),
        "following_simulated": thin(error),
        "loop_functions": thin(np.stack(wrong, axis=1)),
    }


def torque_checks(
    agreement: SimulationAgreement,
    instruments: FloatArray,
    segment: IntArray,
    used: BoolArray,
    level: float,
    margin: float,
) -> tuple[ColumnCheck, ...]:
    """Per joint: how much of the torque that the simulation lacks is a function of the motion.

    Whatever the model's own columns explain is left to its parameters; the F-test asks for more than that.

    Args:
        agreement: of the simulation with the robot.
        instruments: samples × joints × b, the model's columns at the simulated motion.
        segment: (samples,) recordings.
        used: samples × joints.
        level: of the F-test.
        margin: share of the measured torque that a significant difference may have.
    """
    difference = agreement.torque_measured - agreement.torque_simulated
    found = [
        _explained(
            agreement.torque_measured[:, joint],
            difference[:, joint],
            agreement.torque_functions[:, joint],
            instruments[:, joint],
            segment,
            used[:, joint],
        )
        for joint in range(difference.shape[1])
    ]
    return _checks("torque", "joint", found, level, margin)


def following_checks(
    agreement: SimulationAgreement, segment: IntArray, used: BoolArray, level: float, margin: float
) -> tuple[ColumnCheck, ...]:
    """Per drive: how much of the following error that the simulation lacks is a function of the motion.

    Args:
        agreement: of the simulation with the robot.
        segment: (samples,) recordings.
        used: samples × joints; a drive's row is used where those of all its joints are.
        level: of the F-test.
        margin: share of the measured following error that a significant difference may have.
    """
    difference = agreement.following_measured - agreement.following_simulated
    none = np.empty((difference.shape[0], 0))
    found = [
        _explained(
            agreement.following_measured[:, drive],
            difference[:, drive],
            agreement.loop_functions[:, drive],
            none,
            segment,
            np.asarray(used[:, agreement.moves[drive]].all(axis=1)),
        )
        for drive in range(difference.shape[1])
    ]
    return _checks("following error", "drive", found, level, margin)


def _checks(
    kind: ColumnKind, axes: str, found: Sequence[tuple[float, float]], level: float, margin: float
) -> tuple[ColumnCheck, ...]:
    """One check per axis, from size and p; the p of all together are Holm's, so ``level`` is that of the arm.

    Where a feed-forward leaves little to follow, noise alone is more than a margin's share of it: then the
    p-values decide, and seven axes at 5 % each would refuse a right description in three of ten recordings.
    """
    adjusted = holm([p for _, p in found])
    return tuple(
        ColumnCheck(f"{kind} of {axes} {axis}", size, margin, p, bool(size <= margin or p >= level), kind)
        for axis, ((size, _), p) in enumerate(zip(found, adjusted, strict=True), start=1)
    )


def holm(p_values: Sequence[float]) -> list[float]:
    """p-values adjusted for their number (Holm 1979): one falls below a level with at most that chance."""
    order = np.argsort(p_values, kind="stable")
    adjusted, largest, count = [1.0] * len(p_values), 0.0, len(p_values)
    for rank, place in enumerate(order):
        largest = max(largest, min(1.0, (count - rank) * p_values[place]))
        adjusted[place] = largest
    return adjusted


def _explained(
    measured: FloatArray,
    difference: FloatArray,
    functions: FloatArray,
    absorbed: FloatArray,
    segment: IntArray,
    used: BoolArray,
) -> tuple[float, float]:
    """Share of the measured signal that functions explain of the difference; p of the F-test that it is none.

    The share is one of the rows as they are; the F-test sees rows on which the rest is white.

    Args:
        measured, difference: (samples,).
        functions: samples × k.
        absorbed: samples × m, what the difference may hold without harm.
        segment: (samples,) recordings.
        used: (samples,).
    """
    whole = float(np.linalg.norm(measured[used]))
    if float(np.linalg.norm(difference[used])) <= _EXACT * whole or not used.any():
        return 0.0, 1.0
    kept = absorbed[:, np.any(absorbed[used] != 0.0, axis=0)]
    new = _beyond(kept[used], functions[used])
    size = float(np.linalg.norm(new.T @ difference[used])) / whole
    columns, mask = np.column_stack([kept, functions])[:, np.newaxis, :], used[:, np.newaxis]
    whitening = regression_whitening(difference[:, np.newaxis], columns, segment, mask)
    y = whitening.apply(difference[:, np.newaxis, np.newaxis], segment, mask)[:, 0]
    x = whitening.apply(columns, segment, mask)
    before = _orthonormal(x[:, : kept.shape[1]])
    white = _beyond(before, x[:, kept.shape[1] :])
    gain = float(np.sum((white.T @ y) ** 2))
    left = float(y @ y - np.sum((before.T @ y) ** 2)) - gain
    freedom = y.size - before.shape[1] - white.shape[1]
    statistic = gain / white.shape[1] / (left / freedom)
    return size, beyond_f(statistic, white.shape[1], freedom)


def _beyond(before: FloatArray, functions: FloatArray) -> FloatArray:
    """An orthonormal basis (r, held) of what functions (r, k) add to the columns before."""
    basis = _orthonormal(before)
    scale = np.linalg.norm(functions, axis=0)
    unit = functions[:, scale > 0.0] / scale[scale > 0.0]
    return _orthonormal(unit - basis @ (basis.T @ unit), absolute=True)


def _orthonormal(columns: FloatArray, absolute: bool = False) -> FloatArray:
    """An orthonormal basis (r, held) of columns (r, k), scaled to unit norm first unless ``absolute``."""
    scale = np.linalg.norm(columns, axis=0)
    unit = columns if absolute else columns[:, scale > 0.0] / scale[scale > 0.0]
    if unit.shape[1] == 0:
        return np.empty((columns.shape[0], 0))
    u, values, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(u[:, values > _DEPENDENT])
