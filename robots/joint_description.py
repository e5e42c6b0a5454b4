"""What a joint of the arm is, and the bus that its drives are on: two tables of ``robot.toml``."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from robots.errors import ValueNotAllowed
from robots.fields import Frozen
from robots.standard import torque_unit

Place = Annotated[float, Field(ge=-100, le=100)]
"""rad or m; beyond sixteen turns or a hundred metres it is in degrees or millimetres."""


def _heads_a_column(name: str) -> str:
    """A spreadsheet takes what begins with =, +, - or @ for a formula and runs it, wherever a cell begins."""
    if name[:1] in ("=", "+", "-", "@") or any(mark in name for mark in ',;"\t\r\n'):
        raise ValueNotAllowed(
            (), "cannot head a column", 'a name without , ; " or tabs that begins with none of = + - @'
        )
    return name


class Joint(Frozen):
    """One joint of the URDF with the limits that planning and driving hold to."""

    name: Annotated[str, AfterValidator(_heads_a_column)] = Field(
        min_length=1, description="joint name in the URDF"
    )
    kind: Literal["revolute", "prismatic"] = "revolute"
    position: tuple[Place, Place] = Field(description="lower and upper limit, rad or m")
    velocity: float = Field(ge=1e-3, le=50, description="rad/s or m/s")
    acceleration: float = Field(ge=1e-3, le=2000, description="rad/s² or m/s²")
    jerk: float = Field(ge=1e-3, le=1e6, description="rad/s³ or m/s³")
    torque: float = Field(ge=1e-3, le=1e5, description="N·m or N, at the joint")
    torque_noise: float | None = Field(
        default=None,
        ge=1e-9,
        le=1e4,
        description="N·m or N; standard deviation of the torque error of one row",
    )

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        lower, upper = self.position
        if lower >= upper:
            raise ValueNotAllowed(("position",), "is not in order", "[lower, upper] with lower < upper")
        return self

    @property
    def unit(self) -> str:
        """Of its position."""
        return "rad" if self.kind == "revolute" else "m"

    @property
    def torque_unit(self) -> str:
        """Of its torque, or force."""
        return torque_unit(self.kind)


class Bus(Frozen):
    """How the drives are reached when the command line does not say otherwise."""

    interface: str = "udp_multicast"
    channel: str = "239.74.163.40"
    bitrate: int = Field(default=1_000_000, ge=10_000, le=1_000_000, description="bit/s")
    cycle_time: float = Field(default=0.004, ge=1e-4, le=0.1, description="SYNC period, s")
    load_limit: float = Field(
        default=0.7,
        ge=0.01,
        le=1.0,
        description="largest worst-case load of the bus, as a share of the bit rate",
    )
    master_node_id: int = Field(default=127, ge=1, le=127, description="node id in the master's heartbeat")
