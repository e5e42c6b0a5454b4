"""One arm, described once: robot.toml and URDF, their loader, and the arms that ship."""

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
    from robots.description import (
        Bus,
        Controller,
        ControlSignal,
        Drive,
        DriveDynamics,
        Identification,
        Joint,
        Robot,
    )
    from robots.errors import RobotFileError
    from robots.finding import shipped
    from robots.loading import load, robot_from_text
    from robots.rigid_body import rigid_body_model
    from robots.standard import cad_parameters, drive_parameter_names, link_parameter_names, unit_of

__all__ = [
    "Bus",
    "ControlSignal",
    "Controller",
    "Drive",
    "DriveDynamics",
    "Identification",
    "Joint",
    "Robot",
    "RobotFileError",
    "cad_parameters",
    "drive_parameter_names",
    "link_parameter_names",
    "load",
    "rigid_body_model",
    "robot_from_text",
    "shipped",
    "unit_of",
]

__getattr__ = exporter(
    __name__,
    {
        "robots.description": (
            "Bus",
            "Controller",
            "ControlSignal",
            "Drive",
            "DriveDynamics",
            "Identification",
            "Joint",
            "Robot",
        ),
        "robots.errors": ("RobotFileError",),
        "robots.finding": ("shipped",),
        "robots.loading": ("load", "robot_from_text"),
        "robots.rigid_body": ("rigid_body_model",),
        "robots.standard": (
            "cad_parameters",
            "drive_parameter_names",
            "link_parameter_names",
            "unit_of",
        ),
    },
)
