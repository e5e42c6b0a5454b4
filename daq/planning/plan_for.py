"""``armhil plan --for``: the motion on which one effect of a given size would be named rightly."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from daq.text.numbers import significant
from ident import BaseParameters
from ident.discrepancy.by_evidence.power.smallest import CHANCE, Smallest
from ident.effects.entry import joint_words
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from trajectories import Objective, PlanError, Trajectory, objective_for
from trajectories.information.matrix import Criterion

ROUNDS = 3
"""Times that a motion is planned for all parameters and one for the effect's joints, from new seeds."""

_SHOWN_BY = "`armhil plan ARM --power` shows effects and units"
_FORM = re.compile(r"([a-z_]+)(?:@(\d+(?:,\d+)*))?=(\S+)")


@dataclass(frozen=True)
class Wanted:
    """An effect at a place (joints from 1, none for the whole arm) and its size, in the unit of its map."""

    effect: str
    joints: tuple[int, ...]
    size: float

    @property
    def place(self) -> str:
        """As it is asked for: ``backlash@3``."""
        return _place(self.effect, self.joints)

    def among(self, sizes: Sequence[Smallest]) -> Smallest:
        """The smallest size of it that would be named.

        Raises:
            PlanError: the arm has no such effect there, or none whose size can be told before it moves.
        """
        for one in sizes:
            if (one.name, one.joints) == (self.effect, self.joints):
                return one
        raise self._refusal([(one.name, one.joints) for one in sizes])

    def require_place(self, robot: Robot) -> None:
        """Before anything is planned: the vocabulary has the effect, and the arm has it there.

        Raises:
            PlanError: it has not.
        """
        forms = [form for family in VOCABULARY for form in family.nested]
        keys = [
            (form.name, tuple(joint + 1 for joint in place.joints))
            for form in forms
            for place in form.places(robot)
        ]
        if (self.effect, self.joints) not in keys:
            raise self._refusal(keys)

    def _refusal(self, keys: Sequence[tuple[str, tuple[int, ...]]]) -> PlanError:
        places = sorted({_place(*key) for key in keys if key[0] == self.effect})
        near = get_close_matches(self.effect, sorted({name for name, _ in keys}), n=5)
        allowed = ", ".join([*(places or near), *([] if places else [_SHOWN_BY])])
        return PlanError(f"--for {self.place}; allowed: {allowed}", constraint="effect")


def wanted_of(text: str) -> Wanted:
    """``EFFECT@JOINT=SIZE``, such as ``backlash@3=0.002``; without ``@JOINT`` of the whole arm.

    Raises:
        PlanError: it is none.
    """
    found = _FORM.fullmatch(text.strip())
    try:
        size = float(found[3]) if found else math.nan
    except ValueError:
        size = math.nan
    if found is None or not (math.isfinite(size) and size > 0.0):
        raise PlanError(
            f"--for {text}; allowed: EFFECT@JOINT=SIZE with a size above 0, such as backlash@3=0.002, or"
            f" payload=1.5 of the whole arm; {_SHOWN_BY}",
            constraint="effect",
        )
    joints = tuple(int(number) for number in found[2].split(",")) if found[2] else ()
    return Wanted(found[1], joints, size)


@dataclass(frozen=True)
class SeenPlan:
    """A motion, what it was planned for, and what it would name."""

    trajectory: Trajectory
    objective: Objective
    power: tuple[Smallest, ...]
    smallest: Smallest


def plan_for(
    wanted: Wanted,
    objectives: Sequence[Objective],
    planned: Callable[[Objective, int], Trajectory],
    power_of: Callable[[Trajectory], tuple[Smallest, ...]],
    stopped: Callable[[], bool],
) -> SeenPlan:
    """Plan motions until one would name the effect; the one that names the smallest where none would.

    Args:
        wanted: the effect.
        objectives: what motions are planned for, in turn.
        planned: plans one, with the number that is added to the seed.
        power_of: what it would name.
        stopped: whether somebody wants the best so far.

    Raises:
        PlanError: no motion meets the request, or there is no such effect.
    """
    best: SeenPlan | None = None
    for number, objective in _in_turn(objectives):
        trajectory = planned(objective, number)
        power = power_of(trajectory)
        smallest = wanted.among(power)
        if best is None or smallest.tells_more_than(best.smallest):
            best = SeenPlan(trajectory, objective, power, smallest)
        if best.smallest.names(wanted.size) or stopped():
            break
    assert best is not None, "there is an objective"
    return best


def objectives_for(
    wanted: Wanted, base: BaseParameters, usual: Objective, criterion: Criterion
) -> tuple[Objective, ...]:
    """All parameters, or those that were asked for; and those of the effect's joints, where it has any."""
    if not wanted.joints or criterion == "condition":
        return (usual,)
    try:
        return usual, objective_for(base, [f"joint{joint}" for joint in wanted.joints], criterion)
    except PlanError:  # the base parameters of that joint stand at others, or there is no such joint
        return (usual,)


def _in_turn(objectives: Sequence[Objective]) -> Iterator[tuple[int, Objective]]:
    for number in range(ROUNDS):
        for objective in objectives:
            yield number, objective


def verdict_words(wanted: Wanted, smallest: Smallest) -> str:
    """Whether the effect would be named, from what size on, and what stands in the way."""
    unit = "" if smallest.unit == "1" else f" {smallest.unit}"
    what = f"{wanted.effect.replace('_', ' ')} of {joint_words(wanted.joints)}"
    of = f"{wanted.size:g}{unit}"
    rival, joints = smallest.rival
    hides = "noise" if rival == "nothing" else f"{rival.replace('_', ' ')} of {joint_words(joints)}"
    if not smallest.seen:
        return f"{what}: no size of it would be named on any motion tried, it is not told from {hides}"
    from_on = f"from {significant(smallest.size)}{unit} {'down' if smallest.falls else 'on'}"
    if smallest.names(wanted.size):
        return f"{what} of {of} would be named rightly in {CHANCE:.0%} of recordings: {from_on}"
    return (
        f"{what} of {of} would not be named: only {from_on}, last told from"
        f" {hides}; a longer --duration or more --periods show less"
    )


def _place(effect: str, joints: Sequence[int]) -> str:
    return f"{effect}@{','.join(map(str, joints))}" if joints else effect
