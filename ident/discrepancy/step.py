"""One step of the search: the present model, examined on the recordings to fit."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.confirmation import Shown, shown_in_torque
from ident.discrepancy.examination import Examination, examine, noise_of
from ident.discrepancy.gap import Gap, torque_floor, torque_gap
from ident.discrepancy.loop import Loop, Standstill
from ident.discrepancy.loop_examination import LoopExamination, examine_in_loop, loop_gap
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.presliding import standstill_of
from ident.discrepancy.prior import Prior, extended
from ident.discrepancy.self_simulation import with_self_simulation
from ident.effects.family import PlacedEffect
from ident.effects.placed import Placed
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Step:
    """The present model, examined.

    Attributes:
        base: its base parameters.
        prior: what is known of them beforehand; None after a refit.
        examination: of the recordings to fit.
        present: the model with the values found, as the candidates see it.
        plain: the model before anything was found.
    """

    base: BaseParameters
    prior: Prior | None
    examination: Examination
    present: Present
    plain: BaseParameters

    @classmethod
    def of(
        cls,
        base: BaseParameters,
        prepared: Sequence[PreparedRecording],
        prior: Prior | None,
        whitening: Whitening | None = None,
        plain: BaseParameters | None = None,
        simulated: bool = True,
    ) -> Step:
        """Examine a model.

        Args:
            base: its base parameters.
            prepared: recordings to fit.
            prior: of the same base parameters.
            whitening: noise model; found from the recordings where None.
            plain: the model before anything was found; this one where None.
            simulated: whether what the model leaves on a simulation of itself is taken off: not needed where
                nothing is looked for beside it.
        """
        plain = base if plain is None else plain
        examination = examine(base, prepared, prior, whitening)
        standard = base.standard_from(examination.beta, base.model.prior())
        if simulated:
            examination = with_self_simulation(examination, standard, plain)
        return cls(base, prior, examination, Present(base.model, standard), plain)

    def beside(self, effects: Sequence[PlacedEffect], sizes: Sequence[FloatArray]) -> Step:
        """The same model, its noise being what does not repeat beside effects; this where nothing repeats.

        A brake that rubs at other times in each period is noise to a model without it. In rows that are white
        by that a drag of 31 N·m came out as 12 ± 7.

        Args:
            effects: that were found.
            sizes: of each, its parameters.
        """
        examination = self.examination
        if not examination.repeats:
            return self
        whole = extended(self.base, effects, [np.ones(one.size, dtype=np.bool_) for one in sizes])
        noise, _ = noise_of(examination.prepared, whole, np.concatenate([examination.beta, *sizes]))
        return Step.of(self.base, examination.prepared, self.prior, examination.by(noise), self.plain)

    def extended(
        self,
        base: BaseParameters,
        prepared: Sequence[PreparedRecording],
        prior: Prior | None,
        start: FloatArray,
    ) -> Step:
        """A model with more effects, examined as this one was: with its noise.

        Args:
            base, prepared, prior: as of :meth:`of`.
            start: β (b,) to begin with, where that is needed.
        """
        return Step.of(base, prepared, prior, self.examination.whitening, self.plain)

    def in_loop(self, any_law: bool = False) -> LoopStep | None:
        """The same model in closed loop; None where the recordings or the model have none.

        Args:
            any_law: whether its friction at standstill may follow any law (:class:`LoopExamination`).
        """
        prepared = self.examination.prepared
        if not lag_is_known(self.base.model.robot) or any(piece.period is None for piece in prepared):
            return None
        try:
            known = None if any_law else self.standstill
            examination = examine_in_loop(
                self.base, prepared, self.prior, self.examination.beta, any_law=any_law, standstill=known
            )
        except IdentificationError as error:
            _log.info("not examined in closed loop: %s", error)
            return None
        return LoopStep.examined(examination, self.plain)

    @cached_property
    def standstill(self) -> Standstill | None:
        """How the dry friction of its drives turns its sign; None where there is no closed loop."""
        prepared = self.examination.prepared
        if not lag_is_known(self.base.model.robot):
            return None
        try:
            return standstill_of(Loop.of(self.base.model, prepared), self.base, self.examination.beta)
        except IdentificationError as error:
            _log.info("friction at standstill is not known: %s", error)
            return None

    def gap_from(
        self, before: Step, prepared: Sequence[PreparedRecording], whitening: Whitening
    ) -> tuple[Gap, Shown | None]:
        """Torque gap before and with this model, and whether the difference is there; None if rows say not.

        Args:
            before: the model without what was found.
            prepared: recordings that were not fitted.
            whitening: of their rows.
        """
        gap = Gap(
            torque_gap(before.base, before.shown, prepared),
            torque_gap(self.base, self.shown, prepared),
            torque_floor(self.base, self.shown, prepared),
        )
        return gap, shown_in_torque(prepared, before.residuals(prepared), self.residuals(prepared), whitening)

    def residuals(self, prepared: Sequence[PreparedRecording]) -> list[FloatArray]:
        """Of recordings, per piece, rows × joints, N·m (or N)."""
        return [piece.residual(self.base, self.shown) for piece in prepared]

    @property
    def placed(self) -> list[Placed]:
        """Effects that the model has beside the usual ones: found now, or before."""
        return [effect for effect in self.base.model.effects if isinstance(effect, Placed)]

    @cached_property
    def shown(self) -> FloatArray:
        """β̂ (b,) that the gap is shown with."""
        return self.examination.shown

    @cached_property
    def standard_shown(self) -> FloatArray:
        """Standard vector (p,) of :attr:`shown`, nearest to the description's."""
        return self.base.standard_from(self.shown, self.base.model.prior())


@dataclass(frozen=True)
class LoopStep(Step):
    """The present model, examined in closed loop."""

    examination: LoopExamination

    @classmethod
    def examined(cls, examination: LoopExamination, plain: BaseParameters) -> LoopStep:
        """Of the model that was examined; ``plain`` as of :class:`Step`."""
        base = examination.base
        standard = base.standard_from(examination.beta, base.model.prior())
        return cls(base, examination.prior, examination, Present(base.model, standard), plain)

    def extended(
        self,
        base: BaseParameters,
        prepared: Sequence[PreparedRecording],
        prior: Prior | None,
        start: FloatArray,
    ) -> LoopStep:
        """With this one's noise and loop."""
        return self.examined(examine_in_loop(base, prepared, prior, start, self.examination), self.plain)

    def gap_from(
        self, before: Step, prepared: Sequence[PreparedRecording], whitening: Whitening
    ) -> tuple[Gap, Shown | None]:
        """Of the simulated loop's torque, where recordings repeat; else the gap of the moving arm alone.

        Its rows say nothing of what shows at reversals: what a static friction has left at their speeds is
        nothing beside a misfit, and was there with −620 ± 30 %.
        """
        models = ((before.base, before.shown), (self.base, self.shown))
        found = loop_gap(prepared, self.examination.loop.standstill, models)
        return (super().gap_from(before, prepared, whitening)[0], None) if found is None else found
