"""What a caller may ask of an identification besides the arm's settings."""

from __future__ import annotations

from dataclasses import dataclass

from ident.identification.found_effects import FoundModel
from ident.recording import Recording
from ident.results import Method


@dataclass(frozen=True)
class Options:
    """Which estimators, and what to do besides.

    Attributes:
        method: ``auto`` computes least squares and, where references allow, IV, and the revised test chooses;
            ``ls`` computes least squares alone; ``iv`` insists on IV; ``robust`` adds Huber's least squares;
            ``consistent`` simulates arms that can exist and adds the one nearest to the verdict's estimate.
        validation: recordings that are not fitted to; every estimate predicts them.
        propose_cutoff: take the cut-off from the spectrum of the positions instead of the settings.
        essential: look for the essential parameters by F-test.
        found: a model with effects that were found, which are part of the one that is identified; the usual
            one where None.
    """

    method: Method = "auto"
    validation: tuple[Recording, ...] = ()
    propose_cutoff: bool = False
    essential: bool = False
    found: FoundModel | None = None
