"""From samples to a dynamic model, and whether to trust it."""

from __future__ import annotations

from ident.errors import IdentificationError, MassMatrixError, SimulationDivergedError, SimulationError
from ident.identification.identify import Fitted, identify
from ident.identification.options import Options
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel, drive_parameters
from ident.recording import Recording
from ident.results import Estimate, Identification, Parameter, TorqueTrace
from ident.verdicts import Gate, RevisedTest

__all__ = [
    "BaseParameters",
    "Estimate",
    "Fitted",
    "Gate",
    "Identification",
    "IdentificationError",
    "MassMatrixError",
    "Options",
    "Parameter",
    "Recording",
    "RegressorModel",
    "RevisedTest",
    "SimulationDivergedError",
    "SimulationError",
    "TorqueTrace",
    "base_parameters",
    "drive_parameters",
    "identify",
]
