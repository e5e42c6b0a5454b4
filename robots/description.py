"""What an arm is: joints, drives, transmission, controller, bus and identification settings.

Everything here is a frozen value read from one ``robot.toml``. Units are SI and radians: a revolute
axis is in rad and N·m, a prismatic axis in m and N. Arrays over the axes have shape ``(n,)``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from robots.arrays import FloatArray
from robots.consistency import check_consistency
from robots.controller_description import Controller
from robots.drive_description import (
    Brake,
    ControlSignal,
    Drive,
    DriveDynamics,
    HomingSearch,
    Identity,
    TemperatureObject,
    VelocityObject,
)
from robots.fields import Frozen, whole_number, without
from robots.identification_description import Identification
from robots.joint_description import Bus, Joint, Place

__all__ = [
    "Brake",
    "Bus",
    "ControlSignal",
    "Controller",
    "Drive",
    "DriveDynamics",
    "HomingSearch",
    "Identification",
    "Identity",
    "Joint",
    "Robot",
    "TemperatureObject",
    "VelocityObject",
]

Coupling = Annotated[float, Field(ge=-1000, le=1000)]
Acceleration = Annotated[float, Field(ge=-20, le=20)]
"""m/s²."""


class Robot(Frozen):
    """One arm, described once. ``robots.load`` makes it; nothing changes it afterwards."""

    format: Annotated[Literal[1], BeforeValidator(whole_number)] = Field(
        description="version of this file format"
    )
    name: str = Field(pattern=r"^[a-z][a-z0-9_-]*$")
    description: str
    urdf: str = Field(description="path of the URDF, relative to robot.toml")
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, -9.81)
    home: tuple[Place, ...] = Field(default=(), description="posture where motions start and end, rad or m")
    joint: tuple[Joint, ...] = Field(min_length=1)
    drive: tuple[Drive, ...] = Field(default=(), description="none: the arm is known from logs alone")
    transmission: tuple[tuple[Coupling, ...], ...] = Field(
        default=(), description="drive output position = transmission · joint position (n × n)"
    )
    controller: Controller = Field(default_factory=Controller.model_construct)
    bus: Bus = Bus()
    identification: Identification
    # Where the description came from; set by the loader, not by the file.
    folder: Path = Field(default=Path(), exclude=True)
    source_text: str = Field(default="", exclude=True, repr=False)
    known_meshes: dict[str, str] | None = Field(default=None, exclude=True, repr=False)
    """Checksums of meshes that are not at hand, of a description out of a capture; None where they are."""
    parts: dict[str, str] = Field(default_factory=dict, exclude=True, repr=False)
    """What the files said when they were read, part by part: ``robots.identity``."""

    @model_validator(mode="after")
    def _tables_fit_together(self) -> Self:
        if not self.drive:
            self.__dict__.update(self._known_from_logs())
        check_consistency(self)
        return self

    def _known_from_logs(self) -> dict[str, object]:
        """What a description without drives leaves out, where nothing but logs is to be read."""
        n = len(self.joint)
        middle = tuple(min(max(0.0, joint.position[0]), joint.position[1]) for joint in self.joint)
        identity = tuple(tuple(float(i == k) for k in range(n)) for i in range(n))
        return {
            "drive": (Drive.of_log(),) * n,
            "home": self.home or middle,
            "transmission": self.transmission or identity,
        }

    @property
    def has_drives(self) -> bool:
        """Whether the drives are described, so that the arm can be driven; else only logs of it are read."""
        return all(drive.is_given for drive in self.drive)

    def require_drives(self, wanted: str) -> None:
        """Refuse before anything begins where drives or their controller are needed.

        Args:
            wanted: what needs them, for the message.

        Raises:
            MissingFromDescription: one line with the tables that robot.toml lacks.
        """
        given = {"drive": self.has_drives, "controller": self.controller.is_given}
        if not self.has_drives:
            raise without(self.name, [table for table, there in given.items() if not there], wanted)

    def require_controller(self, wanted: str) -> None:
        """As :meth:`require_drives`, where the controller alone is needed."""
        if not self.controller.is_given:
            raise without(self.name, ["controller"], wanted)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint)

    @property
    def urdf_path(self) -> Path:
        return self.folder / self.urdf

    @property
    def lower(self) -> FloatArray:
        """Lower position limits, (n,)."""
        return np.array([joint.position[0] for joint in self.joint])

    @property
    def upper(self) -> FloatArray:
        """Upper position limits, (n,)."""
        return np.array([joint.position[1] for joint in self.joint])

    @property
    def velocity_limits(self) -> FloatArray:
        return np.array([joint.velocity for joint in self.joint])

    @property
    def acceleration_limits(self) -> FloatArray:
        return np.array([joint.acceleration for joint in self.joint])

    @property
    def jerk_limits(self) -> FloatArray:
        return np.array([joint.jerk for joint in self.joint])

    @property
    def torque_limits(self) -> FloatArray:
        return np.array([joint.torque for joint in self.joint])

    @property
    def gains(self) -> FloatArray:
        """Drive gains g_τ at the drive outputs, (n,)."""
        return np.array([drive.gain for drive in self.drive])

    @property
    def transmission_matrix(self) -> FloatArray:
        """T (n × n): drive output position = T · joint position; joint torque = Tᵀ · drive torque."""
        return np.array(self.transmission)

    @property
    def counts_per_output_unit(self) -> FloatArray:
        """Position units per rad (or m) of drive output, signed, (n,): one number for both directions."""
        per_revolution = np.array([2 * np.pi if joint.kind == "revolute" else 1.0 for joint in self.joint])
        counts = np.array([d.sign * d.output_counts for d in self.drive])
        return np.asarray(counts / per_revolution)

    @property
    def control_signal_per_count(self) -> FloatArray:
        """Control-signal units per count of each drive's object, signed, (n,)."""
        return np.array([drive.control_signal_per_count for drive in self.drive])

    def joint_torque(self, control_signal: FloatArray) -> FloatArray:
        """Joint torque from the drives' control signals: τ = Tᵀ (g_τ ∘ v_τ), eq. 5.

        Args:
            control_signal: samples × n, in control-signal units.

        Returns:
            samples × n, N·m (or N).
        """
        drive_torque = np.asarray(control_signal, dtype=np.float64) * self.gains
        return np.asarray(drive_torque @ self.transmission_matrix)

    def control_signal(self, joint_torque: FloatArray) -> FloatArray:
        """The inverse of :meth:`joint_torque`: v_τ from joint torques, samples × n."""
        drive_torque = np.linalg.solve(self.transmission_matrix.T, np.atleast_2d(joint_torque).T).T
        return np.asarray((drive_torque / self.gains).reshape(np.shape(joint_torque)))
