"""Rows of the closed loop: torque of the drives beside that of the simulated arm, with a noise model.

What :class:`Rows` are for the moving arm these are for the simulated loop, joints being drives: y is what the
drives did less what they do in the simulation, and columns are what the loop answers to a change. No noise
stands in the columns, so all rows but rests count, reversals included. Whatever decides takes either.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from ident.discrepancy.by_evidence.evidence.known import Beta, arm_lag, beta_of, lag_columns
from ident.discrepancy.by_evidence.evidence.law_columns import law_columns
from ident.discrepancy.by_evidence.evidence.load_memory import simulated_memory
from ident.discrepancy.by_evidence.evidence.misfit import joined, misfit_columns
from ident.discrepancy.by_evidence.evidence.noise import Noise, autoregressive
from ident.discrepancy.by_evidence.evidence.prepared import Part, Prepared
from ident.discrepancy.by_evidence.evidence.rows import Known, Rows
from ident.discrepancy.by_evidence.evidence.shape_columns import shape_columns
from ident.discrepancy.loop import FINE, Loop, Standstill, settled
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.prior import Prior
from ident.discrepancy.repeats import not_repeating
from ident.discrepancy.simulated_loop import loop_evidence
from ident.effects import State
from ident.effects.family import PlacedEffect
from ident.effects.usual import friction_sign
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.identity_cache import IdentityCache


@dataclass(frozen=True, eq=False)
class LoopRows(Rows):
    """Rows of a loop, with what effects change in it.

    Attributes:
        loop: the recordings' loop.
        exact: whether each effect is simulated; else its torque goes through the loop's answer, which is
            about what a small one changes where it does not stick.
    """

    loop: LoopEvidence = field(kw_only=True)
    exact: bool = field(kw_only=True, default=False)
    _responses: IdentityCache[FloatArray] = field(kw_only=True, default_factory=IdentityCache, repr=False)

    def exactly(self) -> LoopRows:
        """The same with effects that are simulated; what is made of the rows alone is that of these."""
        rows = replace(self, exact=True)
        made = (name for name in vars(self) if isinstance(getattr(Rows, name, None), cached_property))
        vars(rows).update({name: vars(self)[name] for name in made})
        return rows

    def thin(self, placed: PlacedEffect) -> FloatArray:
        """What an effect changes of the drives' torque, rows × drives × p; 0 where it cannot be simulated."""
        if not self.exact:
            return self.loop.screen([placed])
        return self._responses.of(placed, lambda: self._response(placed))

    def _response(self, placed: PlacedEffect) -> FloatArray:
        answer = self.loop.respond(placed)
        return np.zeros((*self.prepared.torque.shape, len(placed.parameters))) if answer is None else answer


def loop_rows(examination: LoopExamination, used: BoolArray | None = None) -> tuple[LoopRows, Beta]:
    """Of a model that was examined in closed loop, and how its β is made of the known factors.

    Args:
        examination: of the model.
        used: (rows, drives) which rows count; None for all but rests of the simulated arm.

    Raises:
        IdentificationError: the loop cannot be simulated.
    """
    base, before = examination.base, examination.loop
    moved, rest, noise = loop_evidence(before.loop, base, examination.beta, before.standstill)
    evidence = moved.after(before)
    more = (shape_columns(evidence), *((law_columns(evidence),) if examination.any_law else ()))
    known, beta = _known(evidence, examination.prior, examination.beta, rest, more)
    prepared = _prepared(evidence, evidence.moving() if used is None else used)
    own = _each(noise, prepared.segment, prepared.used)
    return LoopRows(prepared, known, _misfit(evidence, prepared), own, loop=evidence), beta


def expected_rows(
    loop: Loop,
    base: BaseParameters,
    prior: Prior | None,
    values: FloatArray,
    standstill: Standstill,
    noise: tuple[Noise, ...],
) -> LoopRows:
    """Of an arm that does as a model says, before it has moved.

    Args:
        loop: of the motion that is asked for.
        base: the model.
        prior: of its parameters.
        values: they themselves (b,).
        standstill: how each drive's dry friction turns its sign.
        noise: of the drives' torque, at these rows.

    Raises:
        IdentificationError: the loop cannot be simulated.
    """
    evidence, rest, _ = loop_evidence(loop, base, values, standstill)
    evidence = replace(evidence, noise=np.array([one.marginal for one in noise]))
    known, _ = _known(evidence, prior, values, np.zeros_like(rest), ())
    prepared = _prepared(evidence, evidence.moving())
    return LoopRows(prepared, known, _misfit(evidence, prepared), noise, loop=evidence)


def noise_of(loop: Loop) -> tuple[Noise, ...]:
    """Of each drive's torque at a loop's rows: what differs from one period to the next.

    Raises:
        IdentificationError: nothing repeats.
    """
    alone = []
    for piece in loop.prepared:
        if piece.period is None:
            raise IdentificationError("the trajectory does not repeat, so there is no noise to be seen")
        signal, start = piece.recording.control_signal, settled(piece)
        alone.append(np.concatenate([signal[:start], not_repeating(signal[start:], piece.period)]))
    noise, segment = loop.rows(alone), loop.segment()
    return _each(noise, segment, np.ones(noise.shape, dtype=np.bool_))


def _each(noise: FloatArray, segment: IntArray, used: BoolArray) -> tuple[Noise, ...]:
    """Of each drive, of rows × drives."""
    return tuple(autoregressive(noise[:, j], segment, used[:, j]) for j in range(noise.shape[1]))


def _known(
    evidence: LoopEvidence,
    prior: Prior | None,
    values: FloatArray,
    rest: FloatArray,
    others: tuple[FloatArray, ...],
) -> tuple[Known, Beta]:
    """Columns of β (b,) and of what every loop may have, and what the prior's β leaves of the torque."""
    beta, precision = beta_of(prior, values)
    columns = evidence.screened_base()
    more = np.concatenate([_lags(evidence), simulated_memory(evidence), *others], axis=2)
    whole = np.concatenate([columns @ beta.spread, more], axis=2)
    precision = np.concatenate([precision, np.ones(more.shape[2])])
    return Known(whole, precision, rest + columns @ (values - beta.values)), beta


def _prepared(evidence: LoopEvidence, used: BoolArray) -> Prepared:
    """The recordings at the loop's rows, with the simulated motion of the drives."""
    loop, matrix = evidence.loop, evidence.robot.transmission_matrix
    counts = [loop.count(piece) for piece in loop.prepared]
    cuts = np.cumsum(counts)[:-1]
    torques = np.split(loop.measured(), cuts)
    parts = []
    for piece, motion, torque, own in zip(
        loop.prepared, evidence.motion_of_rows(), torques, np.split(used, cuts), strict=True
    ):
        position, velocity, acceleration = (
            values @ matrix.T for values in (motion.position, motion.velocity, motion.acceleration)
        )
        drives = State(position, velocity, acceleration, motion.time)
        step = piece.recording.sample_time * loop.decimation
        period = None if piece.period is None else piece.period // loop.decimation
        parts.append(Part(drives, drives, torque, own, period, 1, step))
    return Prepared(evidence.robot, tuple(parts))


def _misfit(evidence: LoopEvidence, prepared: Prepared) -> tuple[FloatArray, ...]:
    """Φ of each drive."""
    back, sign = np.linalg.inv(evidence.robot.transmission_matrix), friction_sign(evidence.robot)
    motion = evidence.motion_of_rows()
    load = np.concatenate([evidence.present.link_torque(one) for one in motion]) @ back
    state, used = joined([part.own for part in prepared.parts]), prepared.used
    return tuple(misfit_columns(j, state, load[:, j], used[:, j], sign) for j in range(load.shape[1]))


def _lags(evidence: LoopEvidence) -> FloatArray:
    """Lag between the channels: rate of the simulated torque."""
    loop = evidence.loop
    arm = arm_lag(evidence.robot, loop.prepared[0].recording.sample_time)
    counts = [loop.count(piece) for piece in loop.prepared]
    torques = np.split(loop.torque(evidence.run(FINE)), np.cumsum(counts)[:-1])
    parts = []
    for motion, torque in zip(evidence.motion_of_rows(), torques, strict=True):
        assert motion.time is not None
        parts.append(lag_columns(CubicSpline(motion.time, torque), motion.time, arm))
    return np.concatenate(parts)
