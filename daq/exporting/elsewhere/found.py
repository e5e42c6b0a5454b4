"""Effects that a search has found, in the terms that simulators share: bodies, shafts, springs, drives."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.files.found_model import entries_of
from daq.files.model_file import ModelFile
from ident.effects.found import Found
from ident.effects.term_family import TERM, is_term
from ident.identification.found_effects import FoundModel, extended_model
from robots import Robot
from robots.arrays import FloatArray

BODIES = frozenset(
    {
        "payload",
        "rotor_inertia",
        "viscous_friction",
        "coulomb_friction",
        "current_offset",
        "wrist_coupling",
    }
)
"""More of what every arm has: added to it, and each file says what it lacks of that."""
TILT = "base_tilt"
SPRINGS = frozenset({"gravity_spring", "cable_spring", "contact"})


@dataclass(frozen=True)
class FoundEffect:
    """One ``[[found]]`` entry with its parameters.

    Attributes:
        name: in the vocabulary.
        joints: where it sits, from 0; none for the tool, the base or the whole arm.
        row: (n,) how the place moves with the joints: its joint, or the drive's output.
        values: linear parameters by symbol, SI.
        shape: the others.
        gravity: (3,) m/s² that a tilt adds in the axes of the base.
    """

    name: str
    joints: tuple[int, ...]
    row: FloatArray
    values: Mapping[str, float]
    shape: Mapping[str, float]
    gravity: FloatArray

    @property
    def sentence(self) -> str:
        """What is lost where a file has no place for it."""
        where = ", ".join(str(joint + 1) for joint in self.joints)
        if is_term(self.name):
            (value,) = self.values.values()
            return f"Term without a name at joint {where}: {value:.6g} · {self.name.removeprefix(TERM)}, SI."
        return f"Found effect: {self.name.replace('_', ' ')}" + (f" at joint {where}." if where else ".")

    @property
    def label(self) -> str:
        """A name for it in a file."""
        return "_".join(["found", self.name, *(str(joint + 1) for joint in self.joints)])


@dataclass(frozen=True)
class Coupling:
    """A shaft that moves with more than one joint.

    Attributes:
        name: of the drive, or of what was found.
        row: (n,) how its output moves with the joints.
        inertia: kg·m² (or kg) at its output.
        viscous: N·m·s/rad (or N·s/m).
        coulomb: N·m (or N).
    """

    name: str
    row: FloatArray
    inertia: float
    viscous: float
    coulomb: float


@dataclass(frozen=True)
class Spring:
    """Torque stiffness·(q − rest) + cubic·(q − rest)³ that a joint's drive has to give.

    Attributes:
        label: a name for it.
        axis: the joint, from 0.
        stiffness, cubic: N·m/rad and N·m/rad³ (or N/m and N/m³).
        rest: rad (or m).
        side: 1 or -1 where it acts beyond ``rest`` on that side only.
    """

    label: str
    axis: int
    stiffness: float
    cubic: float
    rest: float
    side: int = 0


@dataclass(frozen=True)
class Added:
    """What found effects add to an arm; arrays have one entry per joint.

    Attributes:
        payload: (10,) standard parameters about the last link's frame.
        gravity: (3,) m/s².
        armature, damping, friction, offset: as of an arm.
        couplings: of shafts on several joints; their shares per joint are in ``armature`` and ``damping``.
    """

    payload: FloatArray
    gravity: FloatArray
    armature: FloatArray
    damping: FloatArray
    friction: FloatArray
    offset: FloatArray
    couplings: tuple[Coupling, ...]


def found_effects(robot: Robot, model: ModelFile) -> tuple[FoundEffect, ...]:
    """The effects of a model file that were found, terms among them.

    Raises:
        IdentificationError: this arm cannot have one of them, or the file lacks a parameter.
    """
    if not (model.found or model.term):
        return ()
    values = {parameter.name: parameter.value for parameter in model.parameter}
    known = FoundModel.of(model.robot.name, model.effects, entries_of(model), values)
    extended = extended_model(robot, known)
    return tuple(_of(robot, effect, values) for effect in extended.effects if isinstance(effect, Found))


def _of(robot: Robot, effect: Found, values: Mapping[str, float]) -> FoundEffect:
    own = {one.symbol: values.get(one.name, 0.0) for one in effect.parameters}
    joints = effect.place.joints
    if effect.place.scope == "drive":
        row = robot.transmission_matrix[joints[0]]
    else:
        row = np.eye(robot.n)[joints[0]] if joints else np.zeros(robot.n)
    gravity = np.zeros(3)
    if effect.name == TILT:
        given = effect.simulated(np.array(list(own.values()))).gravity
        gravity = gravity if given is None else given
    shape = dict(zip(effect.shape_names, effect.shape, strict=True))
    return FoundEffect(effect.name, joints, np.asarray(row), own, shape, gravity)


def added(robot: Robot, found: Sequence[FoundEffect]) -> Added:
    """Bodies, gravity and shafts of the effects that are of those; of the others nothing."""
    n = robot.n
    sums = Added(np.zeros(10), np.zeros(3), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), ())
    couplings: list[Coupling] = []
    for one in found:
        sums.gravity[:] += one.gravity
        if one.name == "payload":
            sums.payload[:] += list(one.values.values())
        elif one.name == "current_offset":
            sums.offset[:] += one.values["doff"] * one.row
        elif one.name == "wrist_coupling":
            couplings.append(_pair(robot, one, sums))
        elif one.name in BODIES:
            inertia, viscous, coulomb = (one.values.get(symbol, 0.0) for symbol in ("dIa", "Fv", "Fc"))
            sums.armature[:] += inertia * one.row**2
            sums.damping[:] += viscous * one.row**2
            if np.count_nonzero(one.row) > 1:
                couplings.append(Coupling(one.label, one.row, inertia, viscous, coulomb))
            else:
                sums.friction[:] += coulomb * np.abs(one.row)
    return replace(sums, couplings=tuple(couplings))


def _pair(robot: Robot, one: FoundEffect, sums: Added) -> Coupling:
    """A shaft on two joints; where the description couples them, they hold its share of each already."""
    first, second = one.joints
    row = np.zeros(robot.n)
    row[second], row[first] = 1.0, one.shape["ratio"]
    inertia, viscous, coulomb = (one.values[symbol] for symbol in ("Iam", "Fvm", "Fcm"))
    if not robot.transmission_matrix[second, first]:
        sums.armature[:] += inertia * row**2
        sums.damping[:] += viscous * row**2
    return Coupling(one.label, row, inertia, viscous, coulomb)


def merged(couplings: Sequence[Coupling]) -> tuple[Coupling, ...]:
    """One shaft for each row: what was found on a drive is added to that drive's."""
    kept: list[Coupling] = []
    for one in couplings:
        same = [k for k, other in enumerate(kept) if np.array_equal(other.row, one.row)]
        if not same:
            kept.append(one)
            continue
        before = kept[same[0]]
        kept[same[0]] = replace(
            before,
            inertia=before.inertia + one.inertia,
            viscous=before.viscous + one.viscous,
            coulomb=before.coulomb + one.coulomb,
        )
    return tuple(kept)


def springs_of(found: Sequence[FoundEffect]) -> tuple[Spring, ...]:
    """Those with a rest position; not those between two anchors."""
    springs = []
    for one in found:
        if one.name == "contact":
            angle, side = one.shape["contact_angle"], int(one.shape["side"])
            springs.append(Spring(one.label, one.joints[0], one.values["contact"], 0.0, angle, side))
        elif one.name == "cable_spring":
            cable, cubic = one.values["cable"], one.values["stiffening"]
            springs.append(Spring(one.label, one.joints[0], cable, cubic, one.shape["rest_angle"]))
        elif one.name == "gravity_spring" and one.values.get("stiffness"):
            stiffness = one.values["stiffness"]
            rest = -one.values["preload"] / stiffness
            springs.append(Spring(one.label, one.joints[0], stiffness, 0.0, rest))
    return tuple(springs)


def not_held(found: Sequence[FoundEffect], held: Collection[str]) -> tuple[str, ...]:
    """A sentence for each effect whose name is not among those that a format holds."""
    return tuple(one.sentence for one in found if one.name not in held)
