"""An accepted model out of its file, as what is known of an arm before it is looked at again."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.files.model_file import ModelFile, ModelFileError
from ident import BaseParameters
from ident.discrepancy import Prior
from ident.discrepancy.by_evidence import accepted_prior
from robots.arrays import FloatArray
from robots.description import Robot


def prior_from(base: BaseParameters, path: Path, accepted: ModelFile) -> Prior:
    """A model file as prior of base parameters.

    Args:
        base: the parameters.
        path: of the file, for messages.
        accepted: its content.

    Raises:
        ModelFileError: it has no correlations, or lacks a parameter.
    """
    names = tuple(parameter.name for parameter in accepted.parameter)
    covariance = accepted.covariance
    if covariance is None:
        raise ModelFileError(f"{path}: has no correlations; identify the arm again to have them written")
    missing = [name for name in base.names if name not in names]
    if missing:
        raise ModelFileError(
            f"{path}: has no {missing[0]}; allowed: a model with the parameters of the model that is examined"
        )
    order = np.array([names.index(name) for name in base.names])
    values, spread = accepted.values[order], covariance[np.ix_(order, order)]
    return accepted_prior(values, spread, _noise_of(base.model.robot, accepted))


def _noise_of(robot: Robot, accepted: ModelFile) -> FloatArray | None:
    """How loud the arm was; None where that is not known, or was seen through other filters than today's."""
    noise, then = np.array(accepted.estimate.torque_noise), accepted.identification
    now = robot.identification
    same = (then.cutoff_hz, then.filter_order) == (now.cutoff_hz, now.filter_order)
    return noise if same and noise.size == robot.n else None
