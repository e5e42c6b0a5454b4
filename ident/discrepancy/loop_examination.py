"""The present model against recordings in closed loop: torque of the drives beside that of the simulation.

Closed-loop output error: rows are what the drives did less what they do in the simulation, and columns are
what the simulation answers to each parameter. No noise is in the columns, so process torque that moves the
arm biases nothing, and all rows count, reversals included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.confirmation import Shown, shown_share
from ident.discrepancy.deviations import block_labels
from ident.discrepancy.examination import DEPENDENT, Examination, with_prior
from ident.discrepancy.gap import Gap
from ident.discrepancy.loop import Loop, Standstill
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.presliding import standstill_of
from ident.discrepancy.prior import Prior
from ident.discrepancy.simulated_loop import loop_evidence
from ident.effects.family import PlacedEffect
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.statistics.whitening import Whitening, autoregressive_whitening
from robots.arrays import BoolArray, FloatArray
from robots.standard import DRIVE_VARIANTS

_STEPS = 3
"""Simulations by which the parameters settle (Gauss and Newton's steps, with the first one's columns)."""
_DRIFTING = ("Fc_cold", "Fv_cold", "Fc_heat", "Fv_heat", "Fc_settled", "Fv_settled")
_OF_DRIVES = ("Ia", "Fv", "Fc", *DRIVE_VARIANTS, *_DRIFTING)
"""Inertia and friction of a drive, also where the friction drifts."""

_STEP = 0.3
"""A parameter's step changes the torque by so many times the noise."""


@dataclass(frozen=True)
class LoopExamination(Examination):
    """A model on whitened rows that are drive torques beside those of the simulated loop.

    Attributes:
        loop: the recordings' loop, and what effects change in it.
        any_law: whether friction at standstill may follow any law, with a size of each drive's own.
    """

    loop: LoopEvidence = field(kw_only=True)
    any_law: bool = field(kw_only=True, default=False)

    simulated: ClassVar[bool] = True

    def columns_of(self, effect: PlacedEffect) -> FloatArray | None:
        """By simulation of the loop with the effect."""
        answer = self.loop.respond(effect)
        return None if answer is None else self.whiten([answer])

    def measured_columns_of(self, effects: Sequence[PlacedEffect]) -> None:
        """None: the motion is simulated, without noise."""

    @property
    def shown(self) -> FloatArray:
        """The prior's parameters (b,) where it holds them, else the fitted ones."""
        if self.prior is None:
            return self.beta
        held = np.isfinite(np.diag(self.prior.covariance))
        return np.where(held, self.prior.values, self.beta)


def examine_in_loop(
    base: BaseParameters,
    prepared: Sequence[PreparedRecording],
    prior: Prior | None,
    start: FloatArray,
    before: LoopExamination | None = None,
    any_law: bool = False,
    standstill: Standstill | None = None,
) -> LoopExamination:
    """Fit the present model to the recordings in closed loop.

    Args:
        base: the model.
        prepared: recordings of trajectories that repeat.
        prior: what is known of its parameters.
        start: (b,) parameters to start from.
        before: the same of the model with fewer effects, whose columns still serve.
        any_law: as of :class:`LoopExamination`; that of ``before`` where there is one.
        standstill: of each drive, as ``before`` has it where there is one; looked for where None.

    Raises:
        IdentificationError: the loop cannot be simulated.
    """
    any_law = any_law if before is None else before.any_law
    known = None if before is None else before.loop
    loop = Loop.of(base.model, prepared) if known is None else known.loop
    if known is not None:
        standstill = known.standstill
    elif standstill is None:
        standstill = standstill_of(loop, base, start, any_law)
    evidence, rest, noise = loop_evidence(loop, base, start, standstill)
    segment = loop.segment()
    used = evidence.moving() if before is None else before.used
    whitening = autoregressive_whitening(noise, segment, used, 0) if before is None else before.whitening
    if before is None or known is None:
        evidence, columns = _usual_columns(evidence, prior is None)
        white = whitening.apply(columns, segment, used)
    else:
        evidence = evidence.after(known)
        old = before.regressor[: before.data_rows]
        more = _columns(evidence, range(old.shape[1], base.independent.size))
        white = np.concatenate([old, whitening.apply(more, segment, used)], axis=1)
    beta = np.asarray(start, dtype=np.float64)
    for step in range(_STEPS):
        if step:
            try:
                moved, rest, _ = loop_evidence(loop, base, beta, standstill)
            except IdentificationError:
                break
            evidence = moved.after(evidence)
        torque = whitening.apply(rest[:, :, np.newaxis], segment, used)[:, 0] + white @ beta
        y, x, _ = with_prior(torque, white, white, prior)
        beta = _solved(x, y) if before is None else beside_found(x, y, beta, before.beta.size)
    return LoopExamination(
        base,
        tuple(prepared),
        whitening,
        used,
        segment,
        y,
        x,
        x,
        beta,
        noise,
        True,
        prior,
        loop=evidence,
        any_law=any_law,
    )


def _usual_columns(evidence: LoopEvidence, all_of_them: bool) -> tuple[LoopEvidence, FloatArray]:
    """What the loop answers to each base parameter, rows × drives × b, and the evidence that knows how.

    Those of the drives are simulated; from them follows how the loop answers, and the others about. That is
    enough where a prior holds them; where nothing does, all are simulated.
    """
    leading = evidence.base.leading
    drives = [k for k, parameter in enumerate(leading) if parameter.symbol in _OF_DRIVES]
    columns = _columns(evidence, drives)
    evidence = evidence.with_answer(columns, drives)
    if all_of_them:
        return evidence, _columns(evidence, range(len(leading)))
    about = evidence.screened_base()
    about[:, :, drives] = columns
    return evidence, about


def _columns(evidence: LoopEvidence, which: Sequence[int]) -> FloatArray:
    """What the loop answers to some base parameters, simulated: rows × drives × parameters."""
    given = evidence.base_columns()
    size = np.sqrt(np.mean(given**2, axis=0)) / evidence.noise[:, np.newaxis]
    steps = _STEP / np.maximum(size.max(axis=0), 1e-12)
    return np.stack(at_once(lambda k: evidence.column(k, float(steps[k])), list(which)), axis=2)


def loop_gap(
    prepared: Sequence[PreparedRecording],
    standstill: Standstill,
    models: Sequence[tuple[BaseParameters, FloatArray]],
) -> tuple[Gap, Shown] | None:
    """rms per drive between the torque of the recordings and that of the simulated loop, and what they show.

    Args:
        prepared: recordings.
        standstill: how the drives' dry friction turns its sign.
        models: two, before and after a finding, with their base parameters.

    Returns:
        None where they cannot be simulated.
    """
    left, floor = [], np.zeros(0)
    try:
        loop = Loop.of(models[0][0].model, prepared)
        for base, beta in models:
            evidence, rest, noise = loop_evidence(loop, base, beta, standstill)
            moving = evidence.moving()
            left.append(rest)
            floor = _rms(noise, moving)
    except IdentificationError:
        return None
    by_noise = Whitening("block", tuple(np.empty(0) for _ in floor), floor)
    before, after = (by_noise.apply(rest[:, :, np.newaxis], loop.segment(), moving)[:, 0] for rest in left)
    blocks = block_labels(prepared, loop.segment(), moving, by_noise)
    gap = Gap(_rms(left[0], moving), _rms(left[1], moving), floor)
    return gap, shown_share(before, after, blocks)


def _rms(rows: FloatArray, used: BoolArray) -> FloatArray:
    """Per drive (n,), over the rows that count."""
    squares = np.where(used, rows**2, 0.0).sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(used.sum(axis=0), 1)))


def beside_found(x: FloatArray, y: FloatArray, beta: FloatArray, count: int) -> FloatArray:
    """β (b,) with its first parameters solved for and the others, which were found, as they are.

    What was found has been fitted within what nature allows; the model must make room for it, since before it
    has taken as much of it as it could.

    Args:
        x, y: whitened rows (N, b) and (N,).
        beta: (b,).
        count: how many come first.
    """
    found = x[:, count:] @ beta[count:]
    return np.concatenate([_solved(x[:, :count], y - found), beta[count:]])


def _solved(x: FloatArray, y: FloatArray) -> FloatArray:
    scale = np.maximum(np.linalg.norm(x, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(x / scale, y, rcond=np.sqrt(DEPENDENT))[0] / scale)
