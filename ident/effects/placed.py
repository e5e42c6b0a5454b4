"""What the families of the vocabulary are made of: places, columns on a joint or through a drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ident.effects.family import Place, PresentModel, Scope, Shape, Shows, StandardParameter
from ident.effects.state import State
from ident.even_spline import EvenSpline
from robots.arrays import FloatArray
from robots.description import Robot

if TYPE_CHECKING:
    from ident.effects.simulated import SimulatedParts, Table
    from ident.effects.ways import Pliant

OFFSET_AT_LINK = Shape("offset_at_link", "1", (1.0, 0.0), 0.0, 1.0, fixed=True)
"""Whether the model's offset is a load that passes through the gear (1) or an error of measurement (0)."""

ANY = (-np.inf, np.inf)
POSITIVE = (0.0, np.inf)
_LONGEST = 3600.0
"""s; a course that the simulation tabulates."""


@dataclass(frozen=True, eq=False)
class Placed:
    """An effect of a family at one place with its shape fixed.

    ``law`` gives its columns, samples × joints × p, and ``parts`` what it is in the simulation for
    parameter values (p,); both are made of the same expressions. ``gives_way`` is where links do with it.
    """

    name: str
    sentence: str
    place: Place
    shape: tuple[float, ...]
    parameters: tuple[StandardParameter, ...]
    bounds: tuple[tuple[float, float], ...]
    law: Callable[[State], FloatArray]
    parts: Callable[[FloatArray], SimulatedParts]
    shape_names: tuple[str, ...] = ()
    scale: tuple[float, ...] = ()
    centre: tuple[float, ...] = ()
    of_measured: bool = False
    stiff: bool = False
    timeless: bool = False
    gives_way: tuple[Pliant, ...] = ()

    @property
    def units(self) -> tuple[str, ...]:
        """Of its linear parameters (p,)."""
        return tuple(parameter.unit for parameter in self.parameters)

    @property
    def whole(self) -> bool:
        """Whether the shapes alone make it, and its factor is 1 where they are right."""
        return any(self.centre)

    def columns(self, state: State) -> FloatArray:
        """Torque per unit of each parameter: samples × joints × parameters."""
        return self.law(state)

    def simulated(self, values: FloatArray) -> SimulatedParts:
        """What the effect is in the closed loop with parameter values (p,)."""
        return self.parts(values)


@dataclass(frozen=True)
class Parameters:
    """Linear parameters of a placed effect: symbols, units, what they can be in nature, how large they are.

    Before any data are seen a parameter is normal about its ``centre`` with deviation ``scale``, within its
    bounds: a physical size (:mod:`ident.effects.scales`). The centre is zero where none is given; it is one
    where the shapes alone make the effect, and the parameter is the share of it that is there. Columns
    ``of_measured`` are made of the measured torque: where they act, the model does not say what is measured.
    Of a ``whole`` effect ``gives_way`` are the places where links give way with it.
    """

    symbols: tuple[str, ...]
    units: tuple[str, ...]
    bounds: tuple[tuple[float, float], ...]
    scale: tuple[float, ...]
    centre: tuple[float, ...] = ()
    of_measured: bool = False
    gives_way: tuple[Pliant, ...] = ()


Law = Callable[[State], FloatArray]
Parts = Callable[[FloatArray], "SimulatedParts"]
Make = Callable[[Robot, Place, tuple[float, ...], PresentModel], tuple[Parameters, Law, Parts]]


def _no_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Linear throughout."""
    return ()


@dataclass(frozen=True, eq=False)
class Family:
    """One name of the vocabulary; see :class:`ident.effects.family.EffectFamily`.

    ``confused_with`` names what the same data often cannot tell from it (one of the two says it for both);
    ``essential`` are the parameters, from 0, without which it is something else: a spring without stiffness
    is an offset. ``contains`` are the effects that are limits of this one: it is not reported where such a
    limit explains as much. ``on_top_of`` are the usual terms that it is a rise of. ``not_by_motion`` are
    those of ``told_from`` that no motion tells from it: on a moving arm their torque is the same.
    Of a ``rough`` one rows hold the most, and it leaves the rest where it is there.
    ``several`` of an effect that comes in waves can sit at one place. ``timeless``, which what is dear to
    calculate says of itself: its torque is that of the motion and of what was shortly before, whenever it
    happens. ``forms`` are others of the same name with shapes of their own. ``equation`` says how its torque
    is made of its parameters, for the reference page. ``row`` is where it stands in the vocabulary; a form
    that stands under another family has none.
    """

    name: str
    sentence: str
    scope: Scope
    places_of: Callable[[Robot], tuple[Place, ...]]
    make: Make
    shapes_of: Callable[[Robot, Place], tuple[Shape, ...]] = _no_shapes
    shows: Shows = "motion"
    needs_prior: bool = False
    confused_with: tuple[str, ...] = ()
    essential: tuple[int, ...] = ()
    contains: tuple[str, ...] = ()
    on_top_of: tuple[str, ...] = ()
    several: bool = False
    forms: tuple[Family, ...] = ()
    stiff: bool = False
    rough: bool = False
    history: bool = False
    timeless: bool = False
    taken_by_alignment: bool = False
    settled_by: str = ""
    told_from: Mapping[str, str] = field(default_factory=dict)
    not_by_motion: tuple[str, ...] = ()
    equation: str = ""
    row: int = 0

    @property
    def nested(self) -> tuple[Family, ...]:
        """Every form of this name."""
        return (self, *self.forms)

    def places(self, robot: Robot) -> tuple[Place, ...]:
        """Every place of this arm where the effect can sit."""
        return self.places_of(robot)

    def shapes(self, robot: Robot, place: Place) -> tuple[Shape, ...]:
        """Its shape parameters at a place."""
        return self.shapes_of(robot, place)

    def effect(self, robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel) -> Placed:
        """The effect there, with these shape values."""
        parameters, law, parts = self.make(robot, place, shape, present)
        return Placed(
            self.name,
            self.sentence,
            place,
            shape,
            tuple(
                StandardParameter(symbol, place, self.name, unit)
                for symbol, unit in zip(parameters.symbols, parameters.units, strict=True)
            ),
            parameters.bounds,
            law,
            parts,
            tuple(one.name for one in self.shapes(robot, place)),
            parameters.scale,
            parameters.centre or (0.0,) * len(parameters.symbols),
            parameters.of_measured,
            self.stiff,
            self.timeless,
            parameters.gives_way,
        )


def each_joint(robot: Robot) -> tuple[Place, ...]:
    """One place per joint."""
    return tuple(Place("joint", (joint,)) for joint in range(robot.n))


def each_drive(robot: Robot) -> tuple[Place, ...]:
    """One place per drive."""
    return tuple(Place("drive", (drive,)) for drive in range(robot.n))


def each_geared_drive(robot: Robot) -> tuple[Place, ...]:
    """One place per drive whose gear ratio is described; of an arm known from logs alone it may not be."""
    return each_drive(robot) if robot.has_drives else ()


def each_limited_drive(robot: Robot) -> tuple[Place, ...]:
    """One place per drive whose saturation is described."""
    return each_drive(robot) if robot.controller.is_given else ()


def drive_row(robot: Robot, place: Place) -> FloatArray:
    """(n,) how the output of a place's drive moves with the joints, and how its torque falls on them."""
    return np.asarray(robot.transmission_matrix[place.joints[0]])


def joint_row(robot: Robot, place: Place) -> FloatArray:
    """(n,) with a one at a place's joint."""
    return np.asarray(np.eye(robot.n)[place.joints[0]])


def along(row: FloatArray, *values: FloatArray) -> FloatArray:
    """Torques (samples,) that fall on the joints by a row (n,): samples × joints × len(values)."""
    columns = np.zeros((values[0].shape[0], row.size, len(values)))
    for k, value in enumerate(values):
        for joint in np.flatnonzero(row):  # most rows are of one joint
            columns[:, joint, k] = value * row[joint]
    return columns


def drive_torque(robot: Robot, joint_torque: FloatArray, drive: int) -> FloatArray:
    """(samples,) torque at a drive's output of joint torques, samples × joints."""
    return np.asarray(joint_torque @ np.linalg.inv(robot.transmission_matrix)[:, drive])


def rate(values: FloatArray, state: State) -> FloatArray:
    """Time derivative of a series (samples, …), that of a cubic spline; zero where time is not known.

    Central differences of samples 4 ms apart lack 8 % at 28 Hz and a quarter at 50 Hz: of a multi-sine the
    column of a lag had another form than a lag, and a delay was found in its place.
    """
    if state.time is None or state.time.shape[0] < 2:
        return np.zeros_like(values)
    slopes = EvenSpline(values.reshape(values.shape[0], -1)).slopes() / (state.time[1] - state.time[0])
    return np.asarray(slopes.reshape(values.shape))


def over_time(course: Callable[[FloatArray], FloatArray]) -> Table:
    """A course of the time since the start, s, as long as a motion that is simulated may be."""
    from ident.effects.simulated import Table  # what is not simulated needs none

    return Table.of(course, 0.0, _LONGEST)


def torque_unit(robot: Robot, place: Place) -> str:
    """Of a place's first joint."""
    return robot.joint[place.joints[0]].torque_unit


def angle_unit(robot: Robot, place: Place) -> str:
    """Of a place's first joint."""
    return robot.joint[place.joints[0]].unit


def speed_limit(robot: Robot, row: FloatArray) -> float:
    """Largest speed of a combination of joints (n,)."""
    return float(np.abs(row) @ robot.velocity_limits)
