"""From samples to a dynamic model, and whether to trust it."""

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
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

__getattr__ = exporter(
    __name__,
    {
        "ident.errors": (
            "IdentificationError",
            "MassMatrixError",
            "SimulationDivergedError",
            "SimulationError",
        ),
        "ident.identification.identify": (
            "Fitted",
            "identify",
        ),
        "ident.identification.options": ("Options",),
        "ident.parameters.base": (
            "BaseParameters",
            "base_parameters",
        ),
        "ident.parameters.regressor": (
            "RegressorModel",
            "drive_parameters",
        ),
        "ident.recording": ("Recording",),
        "ident.results": (
            "Estimate",
            "Identification",
            "Parameter",
            "TorqueTrace",
        ),
        "ident.verdicts": (
            "Gate",
            "RevisedTest",
        ),
    },
)
