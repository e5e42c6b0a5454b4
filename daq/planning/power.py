"""How small each effect could be on a planned motion and still be named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.files.accepted_model import prior_from
from daq.files.model_file import SUFFIX, read_model
from daq.importing.load import load_recording
from ident import IdentificationError, Recording, RegressorModel, base_parameters
from ident.discrepancy.by_evidence.evidence.prepared import settings_for
from ident.discrepancy.by_evidence.power.planned import (
    KnownBefore,
    known_from_run,
    planned_sizes,
    row_time_of,
    white_noise,
)
from ident.discrepancy.by_evidence.power.smallest import Smallest
from robots import Robot
from trajectories import PlanError, TorqueNoise, Trajectory


def power_of(robot: Robot, trajectory: Trajectory, earlier: Path | None) -> tuple[Smallest, ...]:
    """The smallest size of each effect at each place that a recording of a trajectory would name.

    Args:
        robot: the arm.
        trajectory: as planned.
        earlier: the capture or model that is accepted; the description's noise, and a clean run of this very
            motion, where None.

    Raises:
        CaptureError, ModelFileError, IdentificationError: it cannot be read or fitted.
        PlanError: the motion is too short.
    """
    motion = Recording(
        "trajectory",
        trajectory.time,
        trajectory.position,
        trajectory.position,
        np.zeros_like(trajectory.position),
    )
    known = _known(robot, motion, earlier)
    try:
        return planned_sizes(robot, motion, known)
    except IdentificationError as error:
        raise PlanError(f"{error}; allowed: a longer duration", constraint="duration") from error


def _known(robot: Robot, motion: Recording, earlier: Path | None) -> KnownBefore:
    if earlier is not None and not earlier.name.endswith(SUFFIX):
        loaded = load_recording(earlier, robot)
        return known_from_run(robot.model_copy(update={"identification": loaded.settings}), loaded.recordings)
    settings = robot.identification
    per_row = TorqueNoise.white(robot).sigma
    noise = white_noise(per_row, settings.decimation * motion.sample_time, row_time_of(robot, motion))
    known = KnownBefore(noise)
    if earlier is None:
        return known
    base = base_parameters(RegressorModel.of(settings_for(robot, motion)))
    return replace(known, prior=prior_from(base, earlier, read_model(earlier)))
