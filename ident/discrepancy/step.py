"""One step of the search: the present model, examined on the recordings to fit."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.examination import Examination, examine, shown_values
from ident.discrepancy.loop_examination import examine_in_loop
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.discrepancy.prior import Prior
from ident.discrepancy.self_simulation import with_self_simulation
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
        before: Step | None = None,
        whitening: Whitening | None = None,
        start: FloatArray | None = None,
        simulated: bool = True,
    ) -> Step:
        """Examine a model.

        Args:
            base: its base parameters.
            prepared: recordings to fit.
            prior: of the same base parameters.
            before: the step that it extends, whose noise model and loop it keeps.
            whitening: noise model; found from the recordings where None.
            start: β (b,) to begin with; needed where the step before was examined in closed loop.
            simulated: whether what the model leaves on a simulation of itself is taken off: not needed where
                nothing is looked for beside it.
        """
        if before is not None:
            whitening = before.examination.whitening
        plain = base if before is None else before.plain
        if before is not None and before.examination.loop is not None:
            assert start is not None
            examination = examine_in_loop(base, prepared, prior, start, before.examination)
            standard = base.standard_from(examination.beta, base.model.prior())
            return cls(base, prior, examination, Present(base.model, standard), plain)
        examination = examine(base, prepared, prior, whitening)
        standard = base.standard_from(examination.beta, base.model.prior())
        if simulated:
            examination = with_self_simulation(examination, standard, plain)
        return cls(base, prior, examination, Present(base.model, standard), plain)

    def in_loop(self) -> Step | None:
        """The same model in closed loop; None where the recordings or the model have none."""
        prepared = self.examination.prepared
        if not lag_is_known(self.base.model.robot) or any(piece.period is None for piece in prepared):
            return None
        try:
            examination = examine_in_loop(self.base, prepared, self.prior, self.examination.beta)
        except IdentificationError as error:
            _log.info("not examined in closed loop: %s", error)
            return None
        standard = self.base.standard_from(examination.beta, self.base.model.prior())
        return Step(self.base, self.prior, examination, Present(self.base.model, standard), self.plain)

    @cached_property
    def shown(self) -> FloatArray:
        """β̂ (b,) that the gap is shown with."""
        return shown_values(self.examination)

    @cached_property
    def standard_shown(self) -> FloatArray:
        """Standard vector (p,) of :attr:`shown`, nearest to the description's."""
        return self.base.standard_from(self.shown, self.base.model.prior())
