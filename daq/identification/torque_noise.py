"""How loud an arm was when its model was identified: what a later search holds its noise against."""

from __future__ import annotations

from collections.abc import Sequence

from ident import IdentificationError, Recording, RegressorModel, base_parameters
from ident.discrepancy import accepted_noise
from ident.discrepancy.align import aligned
from ident.discrepancy.prepared_recording import prepared_recording
from ident.discrepancy.settings import searching
from ident.effects import Effect
from robots import Robot


def torque_noise(
    robot: Robot, effects: Sequence[Effect], recordings: Sequence[Recording]
) -> tuple[float, ...]:
    """(n,) rms of what does not repeat from period to period, N·m (or N), on rows as the search makes them.

    Args:
        robot: the arm, with its filters.
        effects: of the model.
        recordings: what the model was identified from.

    Returns:
        Empty where nothing repeats, or where the recordings do not determine the model.
    """
    robot, parts = searching(robot, recordings[0]), tuple(effects)
    try:
        prepared = [prepared_recording(robot, recording) for recording in recordings]
        if any(piece.period is None for piece in prepared):
            return ()
        # Between two samples noise is softer than on them, so the lag has to be the search's.
        robot = aligned(RegressorModel(robot, parts), prepared)
        found = accepted_noise(base_parameters(RegressorModel(robot, parts)), recordings)
    except IdentificationError:
        return ()
    return () if found is None else tuple(found.tolist())
