"""One arm, described once: robot.toml and URDF, their loader, and the arms that ship."""

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
from robots.loading import load, robot_from_text, shipped
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
