"""The model under examination, as effects ask it for torques."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pinocchio

from ident.effects import CurrentOffset, Effect, RigidBody, State
from ident.effects.chain import chain_frames
from ident.effects.family import Place
from ident.effects.foot import links_on_a_foot, on_a_foot
from ident.effects.giving_way import ways_of
from ident.effects.placed import Placed
from ident.effects.simulated import SimulatedParts
from ident.effects.torque_of import torque_of
from ident.effects.ways import Pliant, Way
from ident.parameters.chain import chain_masses, chain_torque
from ident.parameters.regressor import RegressorModel
from ident.signals import low_pass_where_sampled
from robots.arrays import FloatArray
from robots.carried import Load
from robots.description import Robot
from robots.identity_cache import IdentityCache

_LIGHT = 1e-6
"""kg; far below what any torque shows."""


@dataclass(frozen=True)
class Present:
    """A model with its standard parameters (p,).

    What was found counts as it does in the simulation: a payload is a part of the links, a tilt a part of
    gravity, and both go through the gears. For an effect that sees it less itself it gives way as it does
    with the effect: ``left_out`` is where the effect does.
    """

    model: RegressorModel
    standard: FloatArray
    left_out: tuple[Pliant, ...] = ()
    _torques: IdentityCache[FloatArray] = field(default_factory=IdentityCache, repr=False, compare=False)
    _link_torques: IdentityCache[FloatArray] = field(default_factory=IdentityCache, repr=False, compare=False)
    _masses: IdentityCache[FloatArray] = field(default_factory=IdentityCache, repr=False, compare=False)
    _others: dict[tuple[str, Place], Present] = field(default_factory=dict, repr=False, compare=False)

    def forget(self) -> None:
        """Motions that it was asked about, and what is made of them."""
        for kept in (self._torques, self._link_torques, self._masses):
            kept.forget()

    def without(self, name: str, place: Place) -> Present:
        """The model as one of its own effects sees it: less that effect, where it was found."""
        kept = [
            (effect, values)
            for effect, values in self._effects()
            if not (isinstance(effect, Placed) and (effect.name, effect.place) == (name, place))
        ]
        if len(kept) == len(self.model.effects):
            return self
        if (name, place) not in self._others:
            model = RegressorModel(self.model.robot, tuple(effect for effect, _ in kept))
            own = Present(model, np.concatenate([values for _, values in kept]))
            left_out = tuple(one for one in self._places if one not in own._places)
            self._others[name, place] = replace(own, left_out=left_out)
        return self._others[name, place]

    def _effects(self) -> Iterator[tuple[Effect, FloatArray]]:
        """Each effect with its parameters (p,)."""
        for effect, own in self.model.columns_of_effects:
            yield effect, self.standard[own]

    def torque(self, state: State) -> FloatArray:
        """Joint torque of the whole model, samples × joints, N·m (or N)."""
        if state.torque is None:
            return self._torque(state)
        return self._torques.of(state, lambda: self._torque(state))  # recorded: many effects ask for it

    def low_cutoff(self, state: State) -> State:
        """The motion through a filter with a lower cut-off."""
        robot = self.model.robot
        return state.once(robot, "low cut-off", lambda: low_cutoff_motion(robot, state))

    def link_torque(self, state: State) -> FloatArray:
        """Torque of the links alone, samples × joints."""
        if state.torque is None:  # a moved motion: the whole model asks for it, and each gear in it
            return state.once(self, "links", lambda: self._link_torque(state))
        return self._link_torques.of(state, lambda: self._link_torque(state))

    def ways(self, state: State) -> tuple[Way, ...]:
        """How far links give way behind gears and on a foot that were found to."""
        places = self._places
        if not places:
            return ()
        ways = state.once(self, "ways", lambda: ways_of((*places, *self.left_out), self, state))
        return ways[: len(places)]

    @cached_property
    def _places(self) -> tuple[Pliant, ...]:
        return tuple(
            place for effect, _ in self._effects() if isinstance(effect, Placed) for place in effect.gives_way
        )

    def own_torque(self, state: State) -> FloatArray:
        """Of all but the links, wherever these give way."""
        return self._sum(np.zeros_like(state.position), state, giving=False)

    def _torque(self, state: State) -> FloatArray:
        return self._sum(self.link_torque(state).copy(), state, giving=True)

    def _sum(self, total: FloatArray, state: State, giving: bool) -> FloatArray:
        for effect, values in self._effects():
            if isinstance(effect, RigidBody) or _is_load(effect):
                continue
            if giving or not (isinstance(effect, Placed) and effect.gives_way):
                total += torque_of(effect, state, values)
        return total

    def _link_torque(self, state: State) -> FloatArray:
        chain = self._chain
        if chain is not None:
            motion = (state.position, state.velocity, state.acceleration)
            return chain_torque(chain, self._link_parameters(state.load), self._gravity, *motion)
        model = self._links(state.load)
        data = model.createData()
        torque = np.zeros_like(state.position)
        for k in range(state.position.shape[0]):
            q, v, a = state.position[k], state.velocity[k], state.acceleration[k]
            torque[k] = pinocchio.rnea(model, data, q, v, a)
        return torque

    def foot_torque(self, state: State, rocking: FloatArray) -> FloatArray:
        """Of the links about x and y of the base and on the joints, samples × (2 + joints)."""
        motion = (state.position, state.velocity, state.acceleration)
        whole = [np.hstack([rocking[:, k], part]) for k, part in enumerate(motion)]
        links = links_on_a_foot(self._link_parameters(state.load))
        return chain_torque(self._chain_on_foot, links, self._gravity, *whole)

    def link_mass_matrix(self, position: FloatArray) -> FloatArray:
        """Mass matrix of the links alone, samples × joints × joints."""
        return self._masses.of(position, lambda: self._mass_matrix(position))

    def _mass_matrix(self, position: FloatArray) -> FloatArray:
        chain = self._chain
        if chain is not None:
            return chain_masses(chain, self._link_parameters(), position)
        model = self._links()
        data = model.createData()
        samples, joints = position.shape
        mass = np.empty((samples, joints, joints))
        for k in range(samples):
            mass[k] = pinocchio.crba(model, data, position[k])
        upper = np.triu(mass)
        return np.asarray(upper + np.triu(mass, 1).transpose(0, 2, 1))

    def offset_torque(self) -> FloatArray:
        """Constant torque on each joint (n,) that the model has, from whatever it comes."""
        offsets = (values for effect, values in self._effects() if isinstance(effect, CurrentOffset))
        return np.asarray(next(offsets, np.zeros(self.model.robot.n)))

    def drive_friction(self, drive: int) -> tuple[float, float]:
        """Dry and viscous friction of a drive (from 0): the usual terms alone, none below zero.

        A drive that turns with several joints has dry friction over its own joint's speed and over its own.
        """
        own = [
            (parameter, float(value))
            for parameter, value in zip(self.model.parameters, self.standard, strict=True)
            if parameter.joint == drive
        ]
        dry, viscous = (
            sum(value for parameter, value in own if parameter.is_usual(symbols))
            for symbols in (("Fc", "Fcm"), ("Fv",))
        )
        return max(dry, 0.0), max(viscous, 0.0)

    def has(self, symbols: Collection[str], drive: int) -> bool:
        """Whether it has a usual term with one of these symbols for a drive (from 0)."""
        return any(one.joint == drive and one.is_usual(symbols) for one in self.model.parameters)

    def gravity_torque(self, position: FloatArray, gravity: FloatArray) -> FloatArray:
        """Torque that holds the links against a gravity (3,), m/s² in the base: samples × joints."""
        chain = self._chain
        if chain is not None:
            still = np.zeros_like(position)
            return chain_torque(chain, self._link_parameters(), gravity, position, still, still)
        model = self._links()
        model.gravity.linear = gravity
        data = model.createData()
        torque = np.zeros_like(position)
        for k in range(position.shape[0]):
            torque[k] = pinocchio.computeGeneralizedGravity(model, data, position[k])
        return torque

    @cached_property
    def _chain(self) -> FloatArray | None:
        """Constants of the joints for machine code; None where the links branch."""
        return chain_frames(self._rigid_body.model)

    @cached_property
    def _chain_on_foot(self) -> FloatArray:
        """The same of links on a foot; only serial ones stand on one."""
        frames = chain_frames(on_a_foot(self._rigid_body.model))
        assert frames is not None
        return frames

    @cached_property
    def _loads(self) -> tuple[SimulatedParts, ...]:
        """What was found that adds to the links or to gravity."""
        return tuple(
            effect.simulated(values)
            for effect, values in self._effects()
            if isinstance(effect, Placed) and _is_load(effect)
        )

    @property
    def _gravity(self) -> FloatArray:
        gravity = np.array(self._rigid_body.model.gravity.linear, dtype=np.float64)
        return np.asarray(sum((load.gravity for load in self._loads if load.gravity is not None), gravity))

    @property
    def _rigid_body(self) -> RigidBody:
        return next(effect for effect in self.model.effects if isinstance(effect, RigidBody))

    def _link_parameters(self, carried: Load | None = None) -> FloatArray:
        """(n, 10), with what was found on them and with a known body that the arm carries."""
        values = next(own for effect, own in self._effects() if isinstance(effect, RigidBody)).reshape(-1, 10)
        if carried is not None:
            values = values + carried.links(values.shape[0])
        return np.ascontiguousarray(
            sum((load.links for load in self._loads if load.links is not None), values)
        )

    def _links(self, carried: Load | None = None) -> pinocchio.Model:
        loaded = self._rigid_body.model.copy()
        loaded.gravity.linear = self._gravity
        for joint, ten in enumerate(self._link_parameters(carried), start=1):
            loaded.inertias[joint] = _inertia(ten)
        return loaded


def _is_load(effect: Effect) -> bool:
    """Whether a found effect is a part of the links or of gravity."""
    if not isinstance(effect, Placed) or effect.place.scope not in ("tool", "base"):
        return False
    parts = effect.simulated(np.ones(len(effect.parameters)))
    return parts.links is not None or parts.gravity is not None


def _inertia(ten: FloatArray) -> pinocchio.Inertia:
    """Ten standard parameters as pin's inertia, which divides by the mass: a massless link gets a little."""
    return pinocchio.Inertia.FromDynamicParameters(ten if ten[0] else np.array([_LIGHT, *ten[1:]]))


_LOW_CUTOFF_SHARE = 0.6
"""Of the cut-off of the positions' filter: what is left to motion of which a rate of torque is made."""


def low_cutoff_motion(robot: Robot, state: State) -> State:
    """The motion through a filter with a lower cut-off than that of the positions.

    A torque's rate has the rate of accelerations in it, and in that noise of positions is larger than the
    motion long before the cut-off: a column of noise is given too small a factor, and loses against another
    that has less of it. Where the samples are too few or too far apart the motion stays as it is.
    """
    settings = robot.identification
    cutoff = _LOW_CUTOFF_SHARE * settings.cutoff_hz
    position, velocity, acceleration = (
        low_pass_where_sampled(part, state.time, cutoff, settings.filter_order)
        for part in (state.position, state.velocity, state.acceleration)
    )
    return replace(state, position=position, velocity=velocity, acceleration=acceleration)
