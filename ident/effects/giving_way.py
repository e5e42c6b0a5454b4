"""Links that give way at several places at once: behind gears, and on a foot that gives way as well.

With w the ways that links go farther, each along a direction e of foot and joints, and N what the motion
takes of foot and joints where nothing gives way,

    J ẅ + D ẇ + F(w) + eᵀ (N + Σ ∂N/∂e w) = 0

of every place, with the spring F and the damping D of :mod:`ident.effects.gear_state` and an inertia J of the
place's own. Two gears side by side swing as one: each made for an arm that is rigid otherwise, gears of 9
and 11 Hz left a twelfth of the torque of an arm in MuJoCo, and the second came out with a third of its
stiffness and was not confirmed. What a place changes beside others is what changes of the whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.effects.family import PresentModel
from ident.effects.felt import Course, felt
from ident.effects.foot import AXES
from ident.effects.gear_state import PARTS, unless_too_far
from ident.effects.state import State
from ident.effects.ways import Pliant, Way
from robots.arrays import FloatArray
from robots.identity_cache import IdentityCache

_KEPT = 6
"""Courses along a motion, 10 MB each: shapes of the same places ask for one again and again."""
_SEEN = 1e-3
"""Of the largest: how links began is not asked of what springs carry less of."""


def _is_alike(one: tuple[object, object], other: tuple[object, object]) -> bool:
    """Whether the very model is asked about the same places."""
    return one[0] is other[0] and one[1] == other[1]


def torque_of_giving_way(own: Sequence[Pliant], present: PresentModel, state: State) -> FloatArray:
    """Samples × joints: what places change beside those where the model gives way.

    Args:
        own: the places.
        present: the model.
        state: a motion of even samples.
    """
    beside = present.ways(state)
    ways = ways_of((*own, *(one.place for one in beside)), present, state)
    changed = [one.torque() for one in ways[: len(own)]]
    changed += [now.torque(less=one.way) for now, one in zip(ways[len(own) :], beside, strict=True)]
    return np.asarray(sum(changed))


def torque_through_gears(present: PresentModel, state: State) -> FloatArray:
    """Samples × joints: of the links, which give way where the model lets them."""
    return np.asarray(sum((one.torque() for one in present.ways(state)), present.link_torque(state)))


def ways_of(places: Sequence[Pliant], present: PresentModel, state: State) -> tuple[Way, ...]:
    """How far links give way at places of a model, all at once."""
    if not places or state.time is None or state.time.shape[0] < 2:
        return ()
    order = sorted(range(len(places)), key=lambda k: not places[k].gear.is_linear)
    links = _Links.of([places[k] for k in order], present, state)
    found = links.swing(state.repeats)
    if not state.repeats and links.rings and state.torque is not None:
        found += links.as_carried(found, _carried(links.places, present, state))
    found = unless_too_far(found, found[..., 0])
    ways = np.ascontiguousarray(found.transpose(1, 2, 0))
    made = [Way(*one) for one in zip(links.places, ways, links.course.slopes, strict=True)]
    return tuple(made[order.index(k)] for k in range(len(places)))


def _carried(places: Sequence[Pliant], present: PresentModel, state: State) -> FloatArray:
    """Samples × gears, through each gear: what was measured, less what drives take for themselves."""
    through = np.asarray(state.torque) - present.own_torque(state)
    return np.stack([-through @ one.along[AXES:] for one in places if not one.of_foot], axis=1)


@dataclass(frozen=True, eq=False)
class _Links:
    """Links that swing at places along a motion.

    Attributes:
        places: straight springs first.
        course: what they feel, the places' own inertias in it.
        step: s, between samples.
        inertia: (places,) about the middle.
    """

    places: Sequence[Pliant]
    course: Course
    step: float
    inertia: FloatArray

    @classmethod
    def of(cls, places: Sequence[Pliant], present: PresentModel, state: State) -> _Links:
        """Along a measured motion."""
        assert state.time is not None
        courses: IdentityCache[Course] = state.once(None, "felt", lambda: IdentityCache(_KEPT, _is_alike))
        asked = present, tuple((one.along.tobytes(), one.offset) for one in places)
        course = courses.of(asked, lambda: felt(places, present, state))
        own = np.array([one.own for one in places])
        matrix = course.matrix.copy()
        np.einsum("saa->sa", matrix[..., 2])[:] += own
        inertia = np.median(np.einsum("saa->sa", matrix[::PARTS, :, :, 2]), axis=0)
        return cls(places, replace(course, matrix=matrix), float(state.time[1] - state.time[0]), inertia)

    @cached_property
    def springs(self) -> FloatArray:
        """(places, 4)."""
        return np.array([one.gear.spring for one in self.places])

    @cached_property
    def frequencies(self) -> FloatArray:
        """(places,) of each as if the others were rigid, rad/s."""
        return np.asarray(np.sqrt(self.springs[:, 0] / self.inertia))

    @cached_property
    def forgets(self) -> float:
        """s in which all of them have."""
        each = zip(self.places, self.inertia, strict=True)
        return max(one.gear.rings_for(float(inertia)) for one, inertia in each)

    @property
    def rings(self) -> bool:
        """Whether they have not forgotten how they began where the record begins, and that adds."""
        lead = self.course.before * self.step
        seen = any(not one.of_foot for one in self.places)
        return seen and 0.0 < lead < self.forgets and all(one.gear.is_linear for one in self.places)

    def run(self, points: slice, begun: FloatArray, load: FloatArray | None = None) -> FloatArray:
        """Points × places × 3, from a state (places, 3) at the first of them on."""
        # Imported here: the compiler takes a second to load, and most commands need no gear state.
        from ident.kernels.gears import Swing, links_behind_gears

        load = (self.course.load if load is None else load)[points]
        each = zip(self.places, self.frequencies, strict=True)
        substeps = max(one.gear.substeps(self.step, float(frequency)) for one, frequency in each)
        straight, part = sum(one.gear.is_linear for one in self.places), self.step / (PARTS * substeps)
        found = np.empty((*load.shape, 3))
        matrix = self.course.matrix[points]
        links_behind_gears(matrix, load, part, substeps, self.springs, straight, Swing.of(begun), found)
        return found

    def swing(self, repeats: bool) -> FloatArray:
        """Samples × places × 3; in a motion that repeats until they have forgotten how they began."""
        before, recorded = self.course.before, PARTS * self.course.before
        first = PARTS * max(before - int(np.ceil(self.forgets / self.step)), 0) if repeats else 0
        begun = np.zeros((len(self.places), 3))
        for k, one in enumerate(self.places):
            felt = self.course.load[first, k], self.course.matrix[first, k, k, 0]
            begun[k, 0] = one.gear.settled(*map(float, felt))
        for _ in range(int(self.forgets / (before * self.step)) if repeats and before else 0):
            begun = self.run(slice(0, recorded + 1), begun)[-1].copy()
        return self.run(slice(first, None), begun)[recorded - first :: PARTS]

    def as_carried(self, found: FloatArray, carried: FloatArray) -> FloatArray:
        """What is missing of how they began, by what the gears' springs carry, samples × gears."""
        recorded = slice(PARTS * self.course.before, None)
        still = np.zeros_like(self.course.load)
        rings = np.stack([self.run(recorded, one, still)[::PARTS] for one in self._free(recorded.start)])
        gears = [k for k, one in enumerate(self.places) if not one.of_foot]
        missed = carried - self._force(found)[..., gears]
        each = self._force(rings)[..., gears].reshape(len(rings), -1)
        sizes = np.linalg.lstsq(each.T, missed.ravel(), rcond=_SEEN)[0]
        return np.asarray(np.tensordot(sizes, rings, 1))

    def _force(self, ways: FloatArray) -> FloatArray:
        """Of the springs, (…, places)."""
        return np.asarray(self.springs[:, 0] * ways[..., 0] + self.springs[:, 1] * ways[..., 1])

    def _free(self, point: int) -> Iterator[FloatArray]:
        """States (places, 3) without load that go on otherwise: each bent, and each let go of in motion."""
        matrix = self.course.matrix[point]
        for k in range(len(self.places)):
            for rate, size in ((0, 1.0), (1, self.frequencies[k])):
                state = np.zeros((len(self.places), 3))
                state[k, rate] = size
                felt = matrix[..., 0] @ state[:, 0] + matrix[..., 1] @ state[:, 1] + self._force(state)
                state[:, 2] = np.linalg.solve(matrix[..., 2], -felt)
                yield state
