"""What a plan takes from earlier work on the same arm: the errors to expect and the parameters' values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.files.model_file import SUFFIX, ModelFileError, read_model
from daq.importing.load import load_recording
from ident import BaseParameters
from ident.estimators import stack, weighted_least_squares
from ident.preparation.observation import observe
from robots import Robot
from trajectories import ExpectedValues, TorqueNoise


@dataclass(frozen=True)
class Known:
    """What is known of an arm before a plan; None where the description has to do."""

    noise: TorqueNoise | None = None
    expected: ExpectedValues | None = None


def known_from(path: Path | None, robot: Robot, base: BaseParameters) -> Known:
    """Errors and values from an earlier recording, or values from an earlier model.

    Args:
        path: a capture, a log that the arm's column map describes, or a model file; None for nothing.
        robot: the arm.
        base: its base parameters.

    Raises:
        CaptureError, IdentificationError, ModelFileError: it cannot be read or identified, or is of
            another arm.
    """
    if path is None:
        return Known()
    if path.name.endswith(SUFFIX):
        return Known(expected=_model_values(path, base))
    loaded = load_recording(path, robot)
    rows = observe(base, loaded.recordings, loaded.settings)
    fit = weighted_least_squares(stack(rows), base.names, loaded.settings.error_deviation)
    expected = ExpectedValues(fit.beta, np.sqrt(np.diag(fit.covariance)))
    return Known(TorqueNoise.of_rows(rows, fit, f"residuals of {path.name}"), expected)


def _model_values(path: Path, base: BaseParameters) -> ExpectedValues:
    model = read_model(path)
    known = {parameter.name: parameter for parameter in model.parameter}
    missing = [name for name in base.names if name not in known]
    if missing:
        raise ModelFileError(
            f"{path}: has no parameter {', '.join(missing)}; allowed: a model of {base.model.robot.name}"
        )
    found = [known[name] for name in base.names]
    return ExpectedValues(np.array([p.value for p in found]), np.array([p.sigma for p in found]))
