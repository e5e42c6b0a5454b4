"""Effects and their families: a family is one entry of the vocabulary, which can be put in several places.

The search walks over families, places and shapes; each is an effect as regressor and simulated loop use it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

from ident.effects.entry import joint_words
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

if TYPE_CHECKING:
    from ident.effects.ways import Pliant, Way

Scope = Literal["joint", "joint_pair", "drive", "tool", "base", "arm"]

Shows = Literal["motion", "reversal", "both"]
"""When an effect shows: while the joint moves, around its reversals and standstills, or in both."""


@dataclass(frozen=True)
class Place:
    """Where an effect sits: joints (or drives) count from 0."""

    scope: Scope
    joints: tuple[int, ...]

    @property
    def words(self) -> str:
        """The place as a person says it."""
        return joint_words(tuple(joint + 1 for joint in self.joints))


@dataclass(frozen=True)
class StandardParameter:
    """A parameter that an effect is linear in: what it is and where.

    Attributes:
        symbol: as in the vocabulary, e.g. ``Fc`` or ``mu``.
        place: of the effect; the last of its joints gives the name its number.
        effect: name of the effect.
        unit: SI; ``1`` for a share.
        copy: from 2 where an effect was found beside one of the model with the same parameter.
    """

    symbol: str
    place: Place
    effect: str
    unit: str
    copy: int = 1

    @property
    def joint(self) -> int | None:
        """From 0; None where it belongs to no one joint."""
        return self.place.joints[-1] if self.place.joints else None

    @property
    def name(self) -> str:
        """``Fc1``, or ``Fc1_2`` for a second one."""
        number = "" if self.joint is None else str(self.joint + 1)
        return f"{self.symbol}{number}" + (f"_{self.copy}" if self.copy > 1 else "")

    def is_usual(self, symbols: Collection[str]) -> bool:
        """Whether it has one of these symbols and is no second one, found beside it."""
        return self.copy == 1 and self.symbol in symbols


class Effect(Protocol):
    """One named cause of joint torque (method.md 6), linear in its parameters."""

    @property
    def name(self) -> str: ...

    @property
    def sentence(self) -> str: ...

    @property
    def parameters(self) -> tuple[StandardParameter, ...]: ...

    def columns(self, state: State) -> FloatArray:
        """Torque per unit of each parameter: samples × joints × parameters."""
        ...


@dataclass(frozen=True)
class Shape:
    """A parameter that the torque is not linear in: profiled over a grid, then refined within its bounds.

    What is ``fixed`` takes the values of its grid alone; of what is ``scanned`` the data say which are
    tried: of what comes again over position or time, and of a corner where something begins. At its
    ``limits`` it is another effect: friction over a power of one is viscous. The ``usual`` value is that of
    models that were written before it could be another.
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    logarithmic: bool = False
    fixed: bool = False
    limits: tuple[float, ...] = ()
    scanned: Literal["", "position", "time", "corner"] = ""
    usual: float | None = None


class PresentModel(Protocol):
    """The model under examination, for effects that depend on the torque it predicts."""

    def torque(self, state: State) -> FloatArray:
        """Joint torque of the whole model, samples × joints, N·m (or N)."""
        ...

    def own_torque(self, state: State) -> FloatArray:
        """The same of all but the links, wherever these give way."""
        ...

    def low_cutoff(self, state: State) -> State:
        """The motion for rates of torques, in which noise of positions is soon larger than the motion."""
        ...

    def link_torque(self, state: State) -> FloatArray:
        """Torque of links that follow their drives, without rotors, friction and offsets."""
        ...

    def ways(self, state: State) -> tuple[Way, ...]:
        """How far links give way where the model lets them, for an effect: at all places but its own."""
        ...

    def foot_torque(self, state: State, rocking: FloatArray) -> FloatArray:
        """Samples × (2 + joints), of links on a foot that rocks about x and y: samples × (q, q̇, q̈) × 2."""
        ...

    def link_mass_matrix(self, position: FloatArray) -> FloatArray:
        """Mass matrix of the links alone, samples × joints × joints."""
        ...

    def offset_torque(self) -> FloatArray:
        """Constant torque on each joint (n,) that the model has, from whatever it comes."""
        ...

    def drive_friction(self, drive: int) -> tuple[float, float]:
        """Dry and viscous friction of a drive (from 0) at its output, N·m and N·m·s/rad (or N, N·s/m)."""
        ...

    def has(self, symbols: Collection[str], drive: int) -> bool:
        """Whether it has a usual term with one of these symbols for a drive (from 0)."""
        ...

    def gravity_torque(self, position: FloatArray, gravity: FloatArray) -> FloatArray:
        """Torque that holds the links against a gravity (3,), m/s² in the base: samples × joints."""
        ...


class PlacedEffect(Effect, Protocol):
    """An effect of a family at one place with its shape parameters fixed."""

    @property
    def place(self) -> Place: ...

    @property
    def units(self) -> tuple[str, ...]: ...

    @property
    def shape(self) -> tuple[float, ...]: ...

    @property
    def shape_names(self) -> tuple[str, ...]: ...

    @property
    def bounds(self) -> tuple[tuple[float, float], ...]:
        """What each linear parameter can be in nature, e.g. no negative stiffness."""
        ...

    @property
    def stiff(self) -> bool: ...

    @property
    def whole(self) -> bool:
        """Whether the shapes alone make it, and its factor is 1 where they are right."""
        ...

    @property
    def scale(self) -> tuple[float, ...]:
        """Deviation of each linear parameter before any data are seen, in its unit."""
        ...

    @property
    def of_measured(self) -> bool:
        """Whether its columns are made of the measured torque."""
        ...

    @property
    def centre(self) -> tuple[float, ...]:
        """What each linear parameter is likeliest to be before any data are seen."""
        ...

    @property
    def gives_way(self) -> tuple[Pliant, ...]:
        """Places where it lets links give way."""
        ...


class EffectFamily(Protocol):
    """One name of the vocabulary.

    ``needs_prior`` is true where a refit of the base parameters would swallow the effect whole or nearly so
    (payload, drive gain, spring, offset): it can only be told against a model that existed before.
    ``essential`` are the linear parameters, from 0, that have to be there for it to be this effect;
    ``contains`` are the effects that are limits of it, ``on_top_of`` the usual terms without which it is not
    there. Of an effect that comes in waves ``several`` can sit at one place, each of its own length.
    ``nested`` is this one with the other forms of its name, which have shapes of their own.

    Traits that a search goes by: ``shows``, when; ``stiff``, whether it swings too fast for a coarse
    integration; ``rough``, whether rows leave some of it where it is there (impacts, ringing, further waves);
    ``history``, whether its torque depends on what was before; ``taken_by_alignment``, whether an estimate
    of the lag between the channels takes it up. ``settled_by`` is what on the arm shows it where no motion
    does. Names that pass for each other are declared on either (``vocabulary.confused_with``).
    """

    @property
    def name(self) -> str: ...

    @property
    def sentence(self) -> str: ...

    @property
    def scope(self) -> Scope: ...

    @property
    def shows(self) -> Shows: ...

    @property
    def needs_prior(self) -> bool: ...

    @property
    def essential(self) -> tuple[int, ...]: ...

    @property
    def contains(self) -> tuple[str, ...]: ...

    @property
    def on_top_of(self) -> tuple[str, ...]: ...

    @property
    def stiff(self) -> bool: ...

    @property
    def rough(self) -> bool: ...

    @property
    def history(self) -> bool: ...

    @property
    def taken_by_alignment(self) -> bool: ...

    @property
    def several(self) -> bool: ...

    @property
    def nested(self) -> tuple[EffectFamily, ...]:
        """Every form of this name, this one first."""

    def places(self, robot: Robot) -> tuple[Place, ...]:
        """Every place of this arm where the effect can sit."""

    def shapes(self, robot: Robot, place: Place) -> tuple[Shape, ...]:
        """Its shape parameters at a place, coarse grids; empty where it is linear throughout."""

    def effect(
        self, robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
    ) -> PlacedEffect:
        """The effect there, with these shape values in the order of :meth:`shapes`."""
