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
from ident.discrepancy.by_evidence.evidence.noise import autoregressive
from ident.discrepancy.by_evidence.evidence.prepared import Part, Prepared
from ident.discrepancy.by_evidence.evidence.rows import Known, Rows
from ident.discrepancy.loop import FINE
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.simulated_loop import loop_evidence
from ident.effects import State
from ident.effects.family import PlacedEffect
from ident.effects.usual import friction_sign
from robots.arrays import BoolArray, FloatArray
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
    beta, precision = beta_of(examination.prior, examination.beta)
    columns = evidence.screened_base()
    parts = [_lags(evidence), simulated_memory(evidence)]
    if examination.any_law:
        parts.append(law_columns(evidence))
    more = np.concatenate(parts, axis=2)
    whole = np.concatenate([columns @ beta.spread, more], axis=2)
    precision = np.concatenate([precision, np.ones(more.shape[2])])
    known = Known(whole, precision, rest + columns @ (examination.beta - beta.values))
    prepared = _prepared(evidence, evidence.moving() if used is None else used)
    segment, used = prepared.segment, prepared.used
    own = tuple(autoregressive(noise[:, j], segment, used[:, j]) for j in range(noise.shape[1]))
    return LoopRows(prepared, known, _misfit(evidence, prepared), own, loop=evidence), beta


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
