"""What an effect is in the closed-loop simulation, for one set of its parameter values.

Most effects need nothing of this: inertia, damping, constants and speed terms are found from the columns. An
effect whose torque follows from anything else returns :class:`SimulatedParts`, made from the same expressions
as its columns, and is then simulated in compiled code like all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from ident.effects.foot import FootSpring
from ident.effects.speed_term import FrictionSign
from ident.effects.warming import Warming
from robots.arrays import FloatArray

_FEWEST, _MOST = 64, 65536
_EXACT_ENOUGH = 1e-7


@dataclass(frozen=True, eq=False)
class Table:
    """A function of one variable by its values at evenly spaced points; beyond the ends it goes on straight.

    It is made when it is asked for: far more ask what an effect consists of than simulate it.

    Attributes:
        lower: the first point.
        make: the space between two points, greater than 0, and the values at them: (points,), at least four.
    """

    lower: float
    make: Callable[[], tuple[float, FloatArray]]

    @classmethod
    def at(cls, lower: float, spacing: float, values: FloatArray) -> Table:
        """Of values (points,) from a first point on."""
        return cls(lower, lambda: (spacing, values))

    @classmethod
    def of(cls, function: Callable[[FloatArray], FloatArray], lower: float, upper: float) -> Table:
        """Tabulate a function of an array so finely that the cubic through its points is exact to 1e-7.

        A function with a kink or a jump gets 65 536 cells.
        """
        return cls(lower, lambda: _tabulated(function, lower, upper))

    @cached_property
    def _made(self) -> tuple[float, FloatArray]:
        return self.make()

    @property
    def spacing(self) -> float:
        """Between two points."""
        return self._made[0]

    @property
    def values(self) -> FloatArray:
        """At the points."""
        return self._made[1]


def _tabulated(
    function: Callable[[FloatArray], FloatArray], lower: float, upper: float
) -> tuple[float, FloatArray]:
    """Space between points, and values at them."""
    cells = _FEWEST
    while True:
        points = np.linspace(lower, upper, cells + 1)
        values = np.asarray(function(points), dtype=np.float64)
        between = np.asarray(function(0.5 * (points[1:-2] + points[2:-1])))
        cubic = (9 * (values[1:-2] + values[2:-1]) - values[:-3] - values[3:]) / 16
        scale = float(np.abs(values).max())
        if cells >= _MOST or float(np.abs(cubic - between).max()) <= _EXACT_ENOUGH * scale:
            return (upper - lower) / cells, values
        cells *= 2


@dataclass(frozen=True)
class Bristle:
    """A deflection that friction builds up and holds: −1 to 1, with a memory.

    Attributes:
        length: way in rad (or m) over which it builds up.
        kind: ``exponential``, dz/dx = (1 − z sign ẋ)/length (Dahl 1968), or ``slip``: dz/dx = 1/length until
            ±1 (an elasto-plastic element of Iwan's).
    """

    length: float
    kind: Literal["exponential", "slip"]


@dataclass(frozen=True)
class SoftConstraint:
    """Dry friction as a simulation holds its arms: the force of a constraint that gives way a little.

    The constraint v̇ = −v/time is met as well as a force of at most the friction can, and as a soft one it is
    short of it in proportion to that force (MuJoCo's documentation, "Computation: constraint model": a₁ +
    R f = a_ref): clip((v + time·v̇)/width, ±1). So such an arm creeps where another sticks, and answers to
    acceleration.

    Attributes:
        width: speed in rad/s (or m/s) at which it saturates while that is steady.
        time: s, in which what moves comes to rest.
    """

    width: float
    time: float


SpeedLaw = FrictionSign | Bristle | SoftConstraint | Callable[[FloatArray], FloatArray] | None
"""Over a speed: a friction sign, what has a past, a function of an array of speeds, or the speed itself."""


@dataclass(frozen=True, eq=False)
class PositionTorque:
    """Torque against the motion, on the model's side of eq. 2: torque_row · curve(position_row · q).

    Attributes:
        position_row: (n,) the position as a combination of joint positions.
        torque_row: (n,) how the torque falls on the joints.
        curve: over that position, N·m (or N).
        course: a factor over time (of the recording, s), if any.
        side: of an elastic gear on which it acts; friction over a drive's speed is always on the drive's.
    """

    position_row: FloatArray
    torque_row: FloatArray
    curve: Table
    course: Table | None = None
    side: Literal["link", "drive"] = "link"


@dataclass(frozen=True, eq=False)
class FrictionTorque:
    """torque_row · law(speed_row · q̇), times what else its size follows; the torque as a speed term's.

    Attributes:
        speed_row, torque_row: (n,), as of ``SpeedTerm``.
        law: its course over speed.
        direction: 1 or -1 where it acts in that direction of motion only.
        speed_factor: a factor over its own speed, a function of an array of speeds, if any. Dry friction that
            changes with speed is a sign with a factor: so what holds at standstill can still be bristles.
        position_row, curve: a factor over a position, if any; both or none.
        course: a factor over time (of the recording, s), if any.
        load_row, load_offset: (n,) if its size follows a load: |load_row · torque of the links + offset|; the
            offset is what of the model's constant torque passes through the gear, N·m (or N) at the drive.
        load_side: where it follows the load: while the speed drives it (load · speed ≥ 0), while it is driven
            by the load, or both; or both, and by the square of the load; or with the load's sign, by the load
            or its square.
        load_memory: time constant with which it follows the load, s.
        load_share: r where the load that it follows holds a share of friction: |load| / (1 − r) while the
            speed drives it, |load| / (1 + r) while it is driven.
        other_row, other_factor: a factor over another speed (that before the step), if any; both or none.
        warming: if its size follows the warmth of the gear, W, which its speed heats.
    """

    speed_row: FloatArray
    torque_row: FloatArray
    law: SpeedLaw
    direction: Literal[-1, 0, 1] = 0
    speed_factor: Callable[[FloatArray], FloatArray] | None = None
    position_row: FloatArray | None = None
    curve: Table | None = None
    course: Table | None = None
    load_row: FloatArray | None = None
    load_offset: float = 0.0
    load_memory: float = 0.0
    load_share: float = 0.0
    load_side: Literal["both", "driving", "driven", "square", "signed", "signed square"] = "both"
    warming: Warming | None = None
    other_row: FloatArray | None = None
    other_factor: Table | None = None


@dataclass(frozen=True)
class GearSpring:
    """A drive whose output does not move rigidly with the joints; its encoder is on the drive's side.

    Several on one drive are in series: compliances and gaps add up.

    Attributes:
        drive: which, from 0.
        compliance: rad per N·m (or m per N) at the drive output.
        cubic: N·m/rad³ (or N/m³) of one that stiffens.
        damping: N·m·s/rad (or N·s/m) beside the spring.
        gap: rad (or m), the whole play.
        offset_at_link: share of the constant torque that acts behind the gear, on the link.
    """

    drive: int
    compliance: float = 0.0
    damping: float = 0.0
    gap: float = 0.0
    offset_at_link: float = 0.0
    cubic: float = 0.0


@dataclass(frozen=True, eq=False)
class GearError:
    """A kinematic error: the gear's output is ahead of what its input says by error(input).

    Attributes:
        drive: which, from 0.
        error: rad (or m) over the drive output that the encoder says.
    """

    drive: int
    error: Table


@dataclass(frozen=True)
class DriveChange:
    """How one drive makes torque of its control signal, where that is not torque = g_τ v_τ at once.

    In this order: delay, lag, dead zone, limit, droop, gain.

    Attributes:
        drive: which, from 0.
        gain: relative error of g_τ: torque = (1 + gain) g_τ v_τ.
        lag: time constant of the current loop, s.
        delay: from control signal to torque, s.
        limit: |v_τ| beyond which the torque does not grow.
        dead_zone: |v_τ| up to which there is no torque; beyond it that much is missing.
        droop, droop_power: c and p of v_τ = y + c·|y|^p·y, where the torque is g_τ y; of one change alone.
        reading_delay: of the position that controller and recording get, s.
        gain_curve: further relative error of g_τ over the drive's output position, rad (or m), if any.
        reading_error: what its encoder reads too much over the drive's output position, rad (or m), if any.
        position_age, signal_age: of what the bus shows of position and control signal, s; the drive's own
            loop sees the present.
    """

    drive: int
    gain: float = 0.0
    lag: float = 0.0
    delay: float = 0.0
    limit: float = np.inf
    dead_zone: float = 0.0
    droop: float = 0.0
    droop_power: float = 2.0
    reading_delay: float = 0.0
    position_age: float = 0.0
    signal_age: float = 0.0
    gain_curve: Table | None = None
    reading_error: Table | None = None

    @classmethod
    def of_missing_share(cls, drive: int, share: float) -> DriveChange:
        """Of a drive whose torque is told but for a share of it: g_τ v_τ = (1 − share) · torque.

        A share beyond ±0.9, which no drive has, counts as ±0.9.
        """
        share = float(np.clip(share, -0.9, 0.9))
        return cls(drive, gain=share / (1.0 - share))


@dataclass(frozen=True, eq=False)
class SimulatedParts:
    """All of an effect with its parameters; what is not given is not there.

    Attributes:
        links: (n, 10) added to the links' standard parameters.
        gravity: (3,) added to gravity, m/s², in the axes of the base.
        inertia, damping: (n, n) torque per q̈ and per q̇.
        constant: (n,) torque.
        position, friction: torques over positions and over speeds.
        springs, errors: of gears.
        feet: of a base that gives way.
        drives: what the drives do to the control signal.
    """

    links: FloatArray | None = None
    gravity: FloatArray | None = None
    inertia: FloatArray | None = None
    damping: FloatArray | None = None
    constant: FloatArray | None = None
    position: tuple[PositionTorque, ...] = ()
    friction: tuple[FrictionTorque, ...] = ()
    springs: tuple[GearSpring, ...] = ()
    errors: tuple[GearError, ...] = ()
    feet: tuple[FootSpring, ...] = ()
    drives: tuple[DriveChange, ...] = ()


@runtime_checkable
class HasSimulatedParts(Protocol):
    """An effect that says itself what it is in the simulation."""

    def simulated(self, values: FloatArray) -> SimulatedParts:
        """The parts for parameter values (p,)."""
        ...
