"""The column map that says what the columns of somebody else's recording mean: ``import.toml``.

docs/reference/import-toml.md holds every key. Every quantity names its columns in the order of the joints (or
drives), its unit, and where it was measured: at the motor, at the drive output, or at the joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from daq.files.toml_file import read_toml, validation_line, with_tuples
from daq.recording.errors import CaptureError
from robots import Robot
from robots.description import Identification

Side = Literal["motor", "drive", "joint"]
PositionUnit = Literal["rad", "deg", "m", "mm", "deg, mm"]
TorqueSide = Literal["motor", "drive", "joint", "current", "sensor"]
TorqueUnit = Literal["N*m", "mN*m", "N"]
TimeUnit = Literal["s", "ms", "us", "ns"]

Ratio = Annotated[float, Field(ge=-1e5, le=1e5)]
LEAST_RATIO = 1e-3
"""In size; the same bounds as of a drive's ``gear``."""
Offset = Annotated[float, Field(ge=-1e3, le=1e3)]
Names = Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Field(min_length=1)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Quantity(_Frozen):
    columns: Names = Field(description="variable names or CSV headers, in the order of the joints")
    file: str | None = Field(default=None, description="file inside a folder of CSV files")


class _Geared(_Quantity):
    side: Side = "joint"
    ratio: tuple[Ratio, ...] | None = Field(
        default=None, description="motor turns per turn of the drive output, signed; for side 'motor'"
    )

    @model_validator(mode="after")
    def _ratio_goes_with_motor(self) -> Self:
        if (self.side == "motor") != (self.ratio is not None):
            raise ValueError("ratio is needed for side 'motor' and only allowed there")
        if self.ratio is not None and any(abs(value) < LEAST_RATIO for value in self.ratio):
            raise ValueError(f"ratio must be at least {LEAST_RATIO:g} in size")
        return self


class Position(_Geared):
    """Measured or reference position; offset is added to the joint position."""

    unit: PositionUnit = Field(
        description="of an arm that turns and slides: the other joints are in SI units"
    )
    offset: tuple[Offset, ...] | None = Field(default=None, description="rad or m, one per joint")


class Torque(_Quantity):
    """Measured torque, or a current; armhil keeps control signals, so it is divided by the drive gain."""

    side: TorqueSide = Field(default="joint", description="where the torque comes from")
    ratio: tuple[Ratio, ...] | None = Field(
        default=None, description="for side 'motor': motor turns per turn"
    )
    gain: tuple[Ratio, ...] | None = Field(
        default=None, description="for side 'current': N·m or N at the drive output per unit of the column"
    )
    unit: TorqueUnit | None = Field(default=None, description="of all sides but 'current'")

    @model_validator(mode="after")
    def _keys_of_its_side(self) -> Self:
        wanted = {"motor": "ratio", "current": "gain"}.get(self.side)
        for key in ("ratio", "gain"):
            values = getattr(self, key)
            if (values is not None) != (key == wanted):
                needs = {"ratio": "motor", "gain": "current"}[key]
                raise ValueError(f"{key} is needed for side '{needs}' and only allowed there")
            if values is not None and any(value == 0 for value in values):
                raise ValueError(f"{key} must not be 0")
        if (self.unit is None) != (self.side == "current"):
            raise ValueError("unit is needed for every side but 'current'")
        return self


class ControlSignal(_Quantity):
    """The control signal v_τ itself, multiplied by ``scale``."""

    scale: Annotated[float, Field(ge=1e-9, le=1e9)] = 1.0


class Complete(_Quantity):
    """Whether each drive answered at each sample: 0 where it did not, and its values are no sample."""


class Force(_Quantity):
    """A measured wrench: three forces, N, and three moments, N·m; its part of the torques is taken off."""

    columns: Names = Field(description="fx fy fz in N, then tx ty tz in N·m")
    frame: str | None = Field(default=None, description="link at whose origin it is measured; the last one")
    axes: Literal["frame", "base"] = Field(
        default="frame", description="along the axes of the link, or the base"
    )
    acts: Literal["on_arm", "by_arm"] = "on_arm"


class Added(_Quantity):
    """What is in the control signal that no position controller put there: fed forward or injected."""

    scale: Annotated[float, Field(ge=1e-9, le=1e9)] = 1.0


class Velocity(_Geared):
    """Measured velocities."""

    unit: Literal["rad/s", "deg/s", "rpm", "m/s", "mm/s"]


class Temperature(_Quantity):
    """Temperatures of the drives or gears, °C."""


class Time(_Frozen):
    """A column of time stamps, or a sampling rate where there is none."""

    column: str | None = None
    file: str | None = None
    unit: TimeUnit = "s"
    sample_rate_hz: Annotated[float, Field(ge=1e-3, le=1e7)] | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.column is None) == (self.sample_rate_hz is None):
            raise ValueError("give either column or sample_rate_hz")
        return self


class ImportMap(_Frozen):
    """What the columns of a recording are."""

    format: Literal[1]
    time: Time
    position: Position
    reference: Position | None = None
    torque: Torque | None = None
    control_signal: ControlSignal | None = None
    complete: Complete | None = None
    velocity: Velocity | None = None
    force: Force | None = None
    added: Added | None = None
    second_encoder: Position | None = None
    temperature: Temperature | None = None
    identification: dict[str, Any] = Field(
        default_factory=dict,
        description="settings for such logs in place of the robot's; same keys as in robot.toml",
    )

    @model_validator(mode="after")
    def _one_effort(self) -> Self:
        if (self.torque is None) == (self.control_signal is None):
            raise ValueError("give either torque or control_signal")
        return self


def load_import_map(path: Path) -> ImportMap:
    """Read a column map.

    Raises:
        CaptureError: one line with the file, the line, the key and what is allowed.
    """
    kind = "a column map (import.toml), which a recording that armhil did not make needs"
    return read_toml(path, ImportMap, CaptureError, kind=kind)


def settings_of(columns: ImportMap, robot: Robot, path: Path) -> Identification:
    """The robot's identification settings with those of the column map in their place.

    Args:
        columns: the column map.
        robot: the arm.
        path: of the column map, for errors.

    Raises:
        CaptureError: one line with the file, the key and what is allowed.
    """
    sensor = columns.torque is not None and columns.torque.side == "sensor"
    return merged_settings(
        {**({"rotor_inertia": False} if sensor else {}), **columns.identification}, robot, path
    )


def merged_settings(overrides: Mapping[str, Any], robot: Robot, path: Path) -> Identification:
    """The robot's identification settings with others in their place.

    Raises:
        CaptureError: one line with the file, the key and what is allowed.
    """
    merged = robot.identification.model_dump() | with_tuples(dict(overrides))
    try:
        return Identification.model_validate(merged)
    except ValidationError as error:
        raise CaptureError(validation_line(path, error, Identification, under=("identification",))) from None
