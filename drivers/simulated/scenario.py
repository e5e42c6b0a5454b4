"""A scenario: what one simulated arm has besides rigid links, constant friction and ideal drives.

Only the plant reads it. The file is TOML, one table per effect, ``[[backlash]]`` and so on; an empty scenario
is the arm as it was drawn. docs/reference/scenario-toml.md lists the keys.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drivers.errors import DriveError
from drivers.simulated.effects import friction, gear, loads, motor
from drivers.simulated.effects.entry import Entry
from drivers.simulated.effects.noise import Noise
from robots import Robot
from robots.allowed import allowed_at, keys_of, table_at
from robots.errors import ValueNotAllowed, one_line, shown
from robots.toml_lines import Path as KeyPath
from robots.toml_lines import TomlLines, key_text

MAX_BYTES = 1_000_000


class ScenarioError(DriveError):
    """A scenario cannot be used. ``str()`` is one line: file, line, key, value, what is allowed."""


class Scenario(BaseModel):
    """All effects of one arm; everything is absent by default."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    format: Literal[1] = Field(default=1, description="version of this file format")
    viscous_friction: tuple[friction.ViscousFriction, ...] = ()
    coulomb_friction: tuple[friction.CoulombFriction, ...] = ()
    asymmetric_friction: tuple[friction.AsymmetricFriction, ...] = ()
    stribeck_friction: tuple[friction.StribeckFriction, ...] = ()
    static_friction: tuple[friction.StaticFriction, ...] = ()
    nonlinear_viscous_friction: tuple[friction.NonlinearViscousFriction, ...] = ()
    load_dependent_friction: tuple[friction.LoadDependentFriction, ...] = ()
    load_quadratic_friction: tuple[friction.LoadQuadraticFriction, ...] = ()
    directional_efficiency: tuple[friction.DirectionalEfficiency, ...] = ()
    dragging_brake: tuple[motor.DraggingBrake, ...] = ()
    drifting_friction: tuple[friction.DriftingFriction, ...] = ()
    temperature_viscous_friction: tuple[friction.TemperatureViscousFriction, ...] = ()
    position_dependent_friction: tuple[friction.PositionDependentFriction, ...] = ()
    joint_elasticity: tuple[gear.JointElasticity, ...] = ()
    stiffening_elasticity: tuple[gear.StiffeningElasticity, ...] = ()
    backlash: tuple[gear.Backlash, ...] = ()
    hysteresis: tuple[gear.Hysteresis, ...] = ()
    wrist_coupling: tuple[gear.WristCoupling, ...] = ()
    transmission: tuple[gear.Transmission, ...] = ()
    gear_ripple: tuple[gear.GearRipple, ...] = ()
    drive_gain_error: tuple[motor.DriveGainError, ...] = ()
    current_offset: tuple[motor.CurrentOffset, ...] = ()
    torque_ripple: tuple[motor.TorqueRipple, ...] = ()
    saturation: tuple[motor.Saturation, ...] = ()
    torque_constant_droop: tuple[motor.TorqueConstantDroop, ...] = ()
    command_dead_zone: tuple[motor.CommandDeadZone, ...] = ()
    encoder_eccentricity: tuple[motor.EncoderEccentricity, ...] = ()
    rotor_inertia: tuple[motor.RotorInertia, ...] = ()
    current_loop_lag: tuple[motor.CurrentLoopLag, ...] = ()
    payload: loads.Payload | None = None
    gravity_spring: tuple[loads.GravitySpring, ...] = ()
    base_tilt: loads.BaseTilt | None = None
    base_compliance: loads.BaseCompliance | None = None
    time_delay: tuple[motor.TimeDelay, ...] = ()
    cable_spring: tuple[loads.CableSpring, ...] = ()
    dress_pack_hysteresis: tuple[loads.DressPackHysteresis, ...] = ()
    contact: tuple[loads.Contact, ...] = ()
    tool_contact: loads.ToolContact | None = None
    vibration: tuple[loads.Vibration, ...] = ()
    slosh: tuple[loads.Slosh, ...] = ()
    torque_bursts: tuple[loads.TorqueBursts, ...] = ()
    dither: tuple[loads.Dither, ...] = ()
    thermal_gain_drift: tuple[motor.ThermalGainDrift, ...] = ()
    missed_samples: tuple[motor.MissedSamples, ...] = ()
    torque_crosstalk: tuple[motor.TorqueCrosstalk, ...] = ()
    noise: Noise | None = None

    @model_validator(mode="after")
    def _one_per_axis(self) -> Self:
        for name in type(self).model_fields:
            entries = getattr(self, name)
            if not isinstance(entries, tuple):
                continue
            seen: set[int] = set()
            for index, entry in enumerate(entries):
                axis = entry.axes()[0]
                if axis in seen and not entry.repeats:
                    key = "drive" if "drive" in type(entry).model_fields else "joint"
                    raise ValueNotAllowed((name, index, key), f"has {name} twice", "one table for each axis")
                seen.add(axis)
        return self

    @property
    def empty(self) -> bool:
        """Whether this is the arm as it was drawn."""
        return self == Scenario()

    def entries(self) -> Iterator[tuple[str, int | None, Entry]]:
        """Every effect: its name, its index among those of the name (None where there is one), the entry."""
        for name in type(self).model_fields:
            value = getattr(self, name)
            if isinstance(value, tuple):
                yield from ((name, index, entry) for index, entry in enumerate(value))
            elif isinstance(value, Entry):
                yield name, None, value

    def effects(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Name and axes (from 1) of every effect, noise left out."""
        return tuple((name, entry.axes()) for name, _, entry in self.entries() if name != "noise")

    def merged(self, other: Scenario) -> Scenario:
        """The effects of both.

        Raises:
            ScenarioError: both have the same effect on the same axis, or of the whole arm.
        """
        values = self.as_dict()
        for name, given in other.as_dict().items():
            if isinstance(given, list):
                values[name] = values.get(name, []) + given
            elif name in values:
                raise ScenarioError(f"scenario: {name}: given twice; allowed: one for the arm")
            else:
                values[name] = given
        return type(self).from_dict(values)

    def check(self, robot: Robot) -> None:
        """Refuses a scenario that names an axis which the arm does not have.

        Raises:
            ScenarioError: one line with key, value and what is allowed.
        """
        for name, index, entry in self.entries():
            for axis in entry.axes():
                if axis > robot.n:
                    place = key_text((name,) if index is None else (name, index))
                    raise ScenarioError(
                        f"scenario: {place}: axis {axis}; allowed: 1 to {robot.n}, the axes of {robot.name}"
                    )

    def as_dict(self) -> dict[str, Any]:
        """What the file would hold, without defaults that were not given; JSON can hold it without loss."""
        return self.model_dump(mode="json", exclude_defaults=True)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The inverse of :meth:`as_dict`.

        Raises:
            ScenarioError: one line with key, value and what is allowed.
        """
        try:
            return cls.model_validate(_with_tuples(values))
        except ValidationError as error:
            raise _first_error(error, "scenario", None) from None


EMPTY = Scenario()


def tables() -> dict[str, type[Entry]]:
    """The entry class of each table of the file, in the order of the file's reference page."""
    at = {
        name: table_at(Scenario, (name, 0)) or table_at(Scenario, (name,)) for name in Scenario.model_fields
    }
    return {name: entry for name, entry in at.items() if entry is not None and issubclass(entry, Entry)}


OUTSIDE_VOCABULARY = tuple(name for name, entry in tables().items() if entry.outside_vocabulary)
"""Effects that no model of the arm has a name for."""


def load_scenario(path: str | Path) -> Scenario:
    """Reads a scenario file.

    Raises:
        ScenarioError: one line with file, line, key, value and what is allowed.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise ScenarioError(one_line(f"{file}: cannot be read: {error.strerror}")) from None
    if len(content) > MAX_BYTES:
        raise ScenarioError(f"{file}: larger than {MAX_BYTES} bytes; allowed: a scenario in TOML")
    try:
        text = content.decode("utf-8-sig")
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError(one_line(f"{file}: not TOML: {error}")) from None
    try:
        return Scenario.model_validate(_with_tuples(data))
    except ValidationError as error:
        raise _first_error(error, str(file), TomlLines(text)) from None


def _first_error(error: ValidationError, source: str, lines: TomlLines | None) -> ScenarioError:
    found = error.errors(include_url=False)
    return ScenarioError(_line(found[0], len(found) - 1, source, lines))


def _line(entry: Any, others: int, source: str, lines: TomlLines | None) -> str:
    """The first thing wrong, in one line."""
    path: KeyPath = tuple(entry["loc"])
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, ValueNotAllowed):
        path = (*path, *cause.path)
        problem, allowed = cause.problem, cause.allowed
    elif entry["type"] == "missing":
        problem, allowed = "missing", allowed_at(Scenario, path)
    elif entry["type"] == "extra_forbidden":
        problem = "no such key"
        allowed = ", ".join(keys_of(table_at(Scenario, path[:-1]) or Scenario))
    else:
        problem, allowed = f"{shown(entry['input'])} is not allowed", allowed_at(Scenario, path)
    where = source if lines is None else f"{source}:{lines.line_of(path)}"
    more = f" (and {others} more)" if others else ""
    return one_line(f"{where}: {key_text(path)}: {problem}{more}; allowed: {allowed}")


def _with_tuples(value: Any) -> Any:
    """Lists as tuples: the models are strict and take nothing else for a frozen value."""
    if isinstance(value, list):
        return tuple(_with_tuples(entry) for entry in value)
    if isinstance(value, dict):
        return {key: _with_tuples(entry) for key, entry in value.items()}
    return value
