"""What recordings that were not fitted say of models: gaps, and whether a finding is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ident.discrepancy.accepted import Accepted
from ident.discrepancy.binned_residual import BinnedResidual, binned_residual
from ident.discrepancy.confirmation import Confirmation, Shown, shown_in_positions
from ident.discrepancy.gap import (
    Gap,
    LoopGap,
    LoopTrace,
    closed_loop_gap,
    position_floor,
    torque_residual,
)
from ident.discrepancy.loop import Standstill
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.residual_dependence import residual_dependences
from ident.discrepancy.results import Finding, FoundParameter
from ident.discrepancy.step import Step
from ident.discrepancy.unexplained import Unexplained, unexplained_of
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray
from robots.identity_cache import IdentityCache

LoopRun = tuple[LoopGap | None, str]
"""A model in closed loop on the validation recordings, or the reason why it cannot be simulated."""

_EXACT = 1e-12
"""rad (or m): a simulation is no nearer."""

_STEPS = 8
"""Models whose simulation is kept."""


@dataclass(frozen=True)
class LoopGaps:
    """Gaps of positions and control signals in closed loop, before anything was found and after all."""

    position: Gap | None
    control_signal: Gap | None
    trace: LoopTrace | None
    reason: str


@dataclass(frozen=True)
class Validation:
    """Recordings that nothing is fitted to.

    Attributes:
        prepared: the recordings.
        whitening: of the rows of an inverse model.
        standstill: how dry friction turns its sign, as recordings that were fitted show it; the description's
            where None.
    """

    prepared: tuple[PreparedRecording, ...]
    whitening: Whitening
    standstill: Standstill | None = None
    _runs: IdentityCache[LoopRun] = field(
        default_factory=lambda: IdentityCache(_STEPS), repr=False, compare=False
    )

    def by_likelier_law(self, step: Step) -> Validation:
        """The same with friction at standstill as the description says, where a model is nearer with that.

        A law that other recordings showed may be theirs alone, and the description's is a guess: with it the
        simulated positions of two arms that stick were 10 and 50 times as far off, and showed 523 ± 52 and
        1011 ± 157 % of static frictions that were there (90 ± 8 and 107 ± 8 % by the law that was found).
        """
        found, described = self.loop_run(step)[0], self._described.loop_run(step)[0]
        if found is None or described is None:
            return self if described is None else self._described
        farther = np.maximum(described.position, _EXACT) / np.maximum(found.position, _EXACT)
        return self if float(np.log(farther).sum()) > 0.0 else self._described

    @cached_property
    def _described(self) -> Validation:
        """With drives that hold at standstill as the description says."""
        return self if self.standstill is None else Validation(self.prepared, self.whitening)

    def gap(self, before: Step, after: Step) -> Gap:
        """Torque gap: of the simulated loop where the later step was examined in it, else of the rows."""
        return after.gap_from(before, self.prepared, self.whitening)[0]

    def loop_run(self, step: Step) -> LoopRun:
        """The model of a step in closed loop; each is compared with several others."""

        def run() -> LoopRun:
            return closed_loop_gap(step.base, step.standard_shown, self.prepared, self.standstill)

        return self._runs.of(step, run)

    def loop_gaps(self, before: LoopRun, after: LoopRun) -> LoopGaps:
        """Of two models."""
        first, last = before[0], after[0]
        if first is None or last is None:
            return LoopGaps(None, None, None, before[1] or after[1])
        floor = position_floor(self.prepared)
        none = np.full_like(floor, np.nan)
        return LoopGaps(
            Gap(first.position, last.position, floor),
            Gap(first.control_signal, last.control_signal, none),
            LoopTrace(first.time[0], first.errors[0], last.errors[0]),
            "",
        )

    def unexplained(self, step: Step) -> tuple[Unexplained, ...]:
        """What a model leaves, worst joint first."""
        return unexplained_of(
            self.prepared, [torque_residual(step.base, step.shown, piece) for piece in self.prepared]
        )

    def changes(self, before: Step, after: Step) -> FloatArray:
        """(n,) of each joint's torque where it moves, the rms of what one model adds to another."""
        moving = np.concatenate([piece.moving for piece in self.prepared])
        torque = np.concatenate([piece.torque for piece in self.prepared])
        first, last = (np.concatenate(step.residuals(self.prepared)) for step in (before, after))
        squares = [np.where(moving, values**2, 0.0).sum(axis=0) for values in (first - last, torque)]
        return np.asarray(np.sqrt(squares[0] / np.maximum(squares[1], 1e-300)))

    def finding(
        self, accepted: Accepted, without: Step, whole: Step, loops: tuple[LoopRun, LoopRun]
    ) -> Finding:
        """All that is said of one effect.

        Args:
            accepted: the effect.
            without: the final model less this effect alone.
            whole: the final model.
            loops: both in closed loop.
        """
        basis = accepted.basis
        gap, torque = whole.gap_from(without, self.prepared, self.whitening)
        if torque is None:  # the simulated positions, with the friction at standstill that was found with it
            torque = self.shown_in_loop(self.loop_run(without), self.loop_run(whole)) or Shown(0.0, 0.0)
        return Finding(
            effect=accepted.effect,
            sentence=accepted.placed.sentence,
            scope=accepted.placed.place.scope,
            joints=accepted.joints,
            parameters=_parameters(accepted),
            p_value=basis.p_value,
            score=basis.score,
            threshold=basis.threshold,
            held_out_gain=gap.closed or 0.0,
            indistinguishable_from=accepted.indistinguishable_from,
            mode="refit" if whole.prior is None else "prior",
            gap=gap,
            confirmation=Confirmation(
                torque,
                self.shown_in_loop(*loops),
                basis.doubt or accepted.unsure,
                whole.examination.simulated,
            ),
            placed=accepted.placed,
            binned_residual=self._binned_residual(without, whole),
            ranking=basis.ranking,
            probability=basis.probability,
            held=basis.held,
        )

    def shown_in_loop(self, without: LoopRun, whole: LoopRun) -> Shown | None:
        """Of what the one model changes of the other's simulated positions, the share that is there.

        Each joint counts by what the nearer of both leaves there, noise and misfit. (In units of noise
        alone the first joint of an arm with play, of which no simulation says where in it it is, decided
        what the friction of the fifth was.)
        """
        if without[0] is None or whole[0] is None:
            return None
        misfit = np.minimum(without[0].position, whole[0].position)
        errors = without[0].errors, whole[0].errors
        return shown_in_positions(without[0].time, *errors, np.maximum(misfit, _EXACT))

    def _binned_residual(self, before: Step, after: Step) -> BinnedResidual:
        """What the residual depends on before and after."""
        first, last = before.residuals(self.prepared), after.residuals(self.prepared)
        torques = [piece.torque - residual for piece, residual in zip(self.prepared, first, strict=True)]
        places = residual_dependences(self.prepared, first, torques)
        return binned_residual(self.prepared, first, last, torques, places)


def _parameters(accepted: Accepted) -> tuple[FoundParameter, ...]:
    effect = accepted.placed
    shapes = accepted.component.family.shapes(accepted.robot, effect.place)
    linear = zip(effect.parameters, accepted.linear, accepted.linear_sigma, strict=True)
    shaped = zip(shapes, effect.shape, accepted.shape_sigma, strict=True)
    return (
        *(FoundParameter(p.name, float(v), float(s), p.unit, False) for p, v, s in linear),
        *(FoundParameter(shape.name, v, float(s), shape.unit, True) for shape, v, s in shaped),
    )
