"""The drives' controller, identified from set-points, positions and control signals."""

from __future__ import annotations

from ident.controllers.identified import (
    LEAST_EXPLAINED,
    DriveLoop,
    IdentifiedController,
    LoopGain,
    identify_controller,
)
from ident.controllers.structure import Form, Timing

__all__ = [
    "LEAST_EXPLAINED",
    "DriveLoop",
    "Form",
    "IdentifiedController",
    "LoopGain",
    "Timing",
    "identify_controller",
]
