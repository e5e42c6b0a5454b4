"""How loud an arm was when its model was accepted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.examination import examine
from ident.discrepancy.prepared_recording import prepared_recording
from ident.discrepancy.unrepeated import noise_level
from ident.parameters.base import BaseParameters
from ident.recording import Recording
from robots.arrays import FloatArray


def accepted_noise(base: BaseParameters, recordings: Sequence[Recording]) -> FloatArray | None:
    """(n,) rms torque noise of the recordings that a model was accepted on; None where nothing repeats.

    Args:
        base: the model, of an arm with the settings of the search.
        recordings: of that time.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    prepared = [prepared_recording(base.model.robot, recording) for recording in recordings]
    found = examine(base, prepared)
    return np.asarray(noise_level(found)) if found.repeats else None
