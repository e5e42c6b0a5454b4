"""``fleet.toml``: the arms that ``check --all`` and the service look after (docs/reference/fleet-toml.md)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

import robots
from daq.check.errors import CheckError
from daq.files.toml_file import read_toml
from daq.session.bench import ArmOrder
from drivers import Channel
from robots.errors import UserError

Name = Annotated[str, Field(min_length=1)]


class FleetFileError(UserError, ValueError):
    """A fleet file that cannot be read; the text is one line for the user."""


class FleetArm(BaseModel):
    """One arm of the fleet."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    robot: Name = Field(description="a shipped arm or the path of a robot.toml")
    interface: Name | None = Field(default=None, description="python-can interface; the robot's where absent")
    channel: Name | None = Field(default=None, description="channel on it; the robot's where absent")
    simulated: bool = Field(default=False, description="start simulated drives on the bus")
    seed: Annotated[int, Field(ge=0)] = Field(default=0, description="of the simulated arm")
    scenario: Name | None = Field(default=None, description="file of what the simulated arm has besides")
    trajectory: Name | None = Field(
        default=None, description="motion to drive; the accepted one where absent"
    )
    cell: Name | None = Field(default=None, description="cell.toml: what to keep clear of")

    @model_validator(mode="after")
    def _hidden_in_a_simulated_arm(self) -> FleetArm:
        if self.scenario is not None and not self.simulated:
            raise ValueError("scenario without simulated = true; allowed: with simulated drives")
        return self

    def order(self) -> ArmOrder:
        """Which arm, where.

        Raises:
            RobotFileError, MissingFromDescription: its description cannot be read, or has no drives.
        """
        robot = robots.load(self.robot)
        channel = Channel.of(robot, self.interface, self.channel)
        return ArmOrder(
            robot,
            self.robot,
            channel,
            self.simulated,
            self.seed,
            scenario=None if self.scenario is None else Path(self.scenario),
        )


class Fleet(BaseModel):
    """All arms."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    format: Literal[1]
    arm: Annotated[tuple[FleetArm, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _buses_differ(self) -> Fleet:
        buses = [(arm.interface, arm.channel) for arm in self.arm]
        twice = [bus for bus in buses if None not in bus and buses.count(bus) > 1]
        if twice:
            raise ValueError(f"two arms on {twice[0][0]} {twice[0][1]}; allowed: a bus for each")
        return self


def fleet_words(arm: FleetArm) -> str:
    """An arm of the fleet as a person knows it."""
    bus = " ".join(word for word in (arm.interface, arm.channel) if word) or "its own bus"
    return f"{arm.robot} on {bus}{', simulated' if arm.simulated else ''}"


def fleet_path() -> Path:
    """$ARMHIL_FLEET, else fleet.toml in the user's configuration folder."""
    named = os.environ.get("ARMHIL_FLEET")
    if named:
        return Path(named)
    home = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return home / "armhil" / "fleet.toml"


def read_fleet(path: Path | None = None) -> Fleet:
    """Read the fleet.

    Raises:
        FleetFileError: one line with file, line, key and what is allowed.
        CheckError: there is none.
    """
    path = path or fleet_path()
    if not path.exists():
        raise CheckError(
            f"{path}: there is no fleet; allowed: a fleet.toml with an [[arm]] for each, or --fleet"
        )
    return read_toml(path, Fleet, FleetFileError, kind="a fleet (fleet.toml)")
