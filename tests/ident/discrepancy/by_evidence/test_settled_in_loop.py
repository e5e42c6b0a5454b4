"""A rival that differs at reversals takes a finding's place where rows and closed loop together say so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import expit

import robots
from ident.discrepancy.by_evidence import diagnosis, in_motion
from ident.discrepancy.by_evidence.decide.names import Named, Slot, probabilities, with_nats
from ident.discrepancy.by_evidence.taken import is_of_reversals, rivals_in_loop
from ident.discrepancy.component import Component
from ident.discrepancy.confirmation import Shown
from ident.discrepancy.examination import Examination
from ident.discrepancy.validation import Validation
from ident.effects.family import Place
from ident.effects.vocabulary import family_named

NAMES = ("drifting_friction", "hysteresis", "static_friction")
KEYS = [(name, (0,)) for name in NAMES]
DRIFTING, HYSTERESIS, STATIC = NAMES


@dataclass(frozen=True)
class Accepted:
    """A finding."""

    component: Any
    basis: Any

    @property
    def effect(self) -> str:
        return str(self.component.key[0])


class Course:
    """With some findings."""

    first, prepared = None, ()

    def take(self, components: Sequence[Any], bases: Sequence[Any]) -> None:
        """Go on with others."""
        self.findings = [Accepted(one, basis) for one, basis in zip(components, bases, strict=True)]
        base = SimpleNamespace(model=SimpleNamespace(robot=None))
        self.step = SimpleNamespace(base=base, shown=(), has=components[0].key[0])

    def instead(self, components: Sequence[Any], bases: Sequence[Any]) -> Course:
        """Another one, with others."""
        other = Course()
        other.take(components, bases)
        return other


def settled(
    monkeypatch: pytest.MonkeyPatch,
    odds: Sequence[float],
    shown: Mapping[tuple[str, str], Shown],
    beside: str = "",
    nothing: str = "",
) -> tuple[str, dict[str, float] | None]:
    """What stands in a place, and probabilities of its names; None where the loop says nothing.

    Args:
        monkeypatch: of the test.
        odds: by the moving rows, of a name that shows there alone and of two that show at reversals.
        shown: by the loop, of a second name in the place of a first.
        beside: another finding.
        nothing: a name that the rows fit with no size.
    """
    no_size: Any = lambda course, k: course.findings[k].component.key[0] == nothing  # noqa: E731
    monkeypatch.setattr(in_motion, "_may_be_nothing", no_size)
    monkeypatch.setattr(in_motion, "_is_its_parts", lambda *_: False)
    if in_motion.is_of_reversals is is_of_reversals:
        monkeypatch.setattr(in_motion, "is_of_reversals", lambda robot, rival: True)
    monkeypatch.setattr(in_motion, "component_of", lambda _, name: SimpleNamespace(key=(name, (0,))))
    monkeypatch.setattr(in_motion, "basis_of", lambda *given: given)
    listed = probabilities(dict(zip(KEYS, odds, strict=True)), cast(Any, dict(zip(KEYS, NAMES, strict=True))))
    rivals = [one for one in listed if one.name != DRIFTING]
    monkeypatch.setattr(in_motion, "rivals_in_loop", lambda robot, finding: rivals)
    loop = SimpleNamespace(
        loop_run=lambda step: step.has, shown_in_loop=lambda now, then: shown.get((now, then))
    )
    course: Any = Course()
    both = [SimpleNamespace(key=(name, (0,))) for name in (DRIFTING, beside) if name]
    course.take(both, ["by the rows"] * len(both))
    finding: Any = SimpleNamespace(key=KEYS[0], names=listed, unsure="of the rows", doubt_of=lambda key: key)
    one: Any = in_motion.settled_in_loop(course, 0, finding, cast(Any, loop)).findings[0]
    if one.basis == "by the rows":
        return one.component.key[0], None
    key, place, unsure, doubt = one.basis
    assert key == one.component.key == doubt  # whether it is confirmed is asked of what stands
    assert unsure == ("of the rows" if key == KEYS[0] else None)  # another name has sizes of another fit
    return key[0], {key[0]: place.probability(key) for key in KEYS}


@pytest.mark.parametrize(
    ("rows", "share", "stands"),
    [
        (70.0, Shown(0.906, 0.081), HYSTERESIS),
        (2995.0, Shown(0.906, 0.081), DRIFTING),
        (66.5, Shown(0.45, 0.01), DRIFTING),
        (66.05, Shown(0.6, 0.4), DRIFTING),  # it may as well be nothing
    ],
)
def test_the_moving_rows_are_weighed_with_the_loop(
    monkeypatch: pytest.MonkeyPatch, rows: float, share: Shown, stands: str
) -> None:
    name, likely = settled(monkeypatch, (rows, 66.0, 0.0), {(DRIFTING, HYSTERESIS): share})
    assert name == stands and likely is not None
    odds = rows - 66.0 - share.nats_in_loop(True)
    assert likely[DRIFTING] == pytest.approx(expit(odds), abs=1e-9)
    assert likely[HYSTERESIS] == pytest.approx(expit(-odds), abs=1e-9)


def test_a_rival_that_the_rows_fit_with_no_size_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop did otherwise with a right viscous friction, and a static one of 0 ± 0 N·m had its place."""
    shown = {(DRIFTING, HYSTERESIS): Shown(0.632, 0.045)}
    assert settled(monkeypatch, (66.2, 66.0, 0.0), shown)[0] == HYSTERESIS
    assert settled(monkeypatch, (66.2, 66.0, 0.0), shown, nothing=HYSTERESIS) == (DRIFTING, None)


def test_a_rival_that_the_rows_show_nothing_of_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hysteresis of 3 mrad was Coulomb friction to 0.4 per mille there, and the diagnosis had no end."""
    take = Course.take

    def shows(self: Course, components: Sequence[Any], bases: Sequence[Any]) -> None:
        if any(one.key[0] == HYSTERESIS for one in components):
            raise ArithmeticError("the effects have no columns beyond the present model")
        take(self, components, bases)

    monkeypatch.setattr(Course, "take", shows)
    shown = {(DRIFTING, HYSTERESIS): Shown(1.0, 0.1)}
    assert settled(monkeypatch, (70.0, 66.0, 0.0), shown) == (DRIFTING, None)


def test_a_loop_that_cannot_be_simulated_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    assert settled(monkeypatch, (70.0, 66.0, 0.0), {}) == (DRIFTING, None)


def test_a_second_rival_is_asked_beside_what_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    there, half = Shown(1.0, 0.1), Shown(0.5, 0.1)
    shown = {(DRIFTING, HYSTERESIS): there, (HYSTERESIS, STATIC): half}
    name, likely = settled(monkeypatch, (70.0, 66.0, 65.0), shown)
    assert name == HYSTERESIS and likely is not None
    assert likely[STATIC] / likely[HYSTERESIS] == pytest.approx(np.exp(-1.0))
    assert likely[DRIFTING] == pytest.approx(np.exp(4.0 - 50.0) / (1.0 + np.exp(-1.0)), rel=1e-6)


def test_what_another_finding_is_takes_no_second_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coulomb and static friction of a joint had become hysteresis twice."""
    shown = {(DRIFTING, HYSTERESIS): Shown(1.0, 0.1)}
    assert settled(monkeypatch, (70.0, 66.0, 0.0), shown)[0] == HYSTERESIS
    assert settled(monkeypatch, (70.0, 66.0, 0.0), shown, HYSTERESIS) == (DRIFTING, None)


COULOMB, DEAD = ("coulomb_friction", (0,)), ("command_dead_zone", (0,))


def of_two(rest: float) -> tuple[Named, Named]:
    """Coulomb friction, which stands for a dead zone that is likelier by a nat, and a tight spot."""
    placed: Any = SimpleNamespace(shape_names=())
    form = Named(*DEAD, (1.0 - rest) * float(expit(1.0)), placed, 41.0)
    spot = Named("position_dependent_friction", (0,), rest, placed, 38.0)
    return Named(*COULOMB, 1.0 - rest, placed, 40.0, (form,)), spot


def test_forms_that_a_name_stands_for_are_asked_of_the_loop_one_by_one() -> None:
    names = of_two(0.1)
    every = Slot(names).each.names
    assert [one.key for one in every] == [DEAD, COULOMB, names[1].key]
    assert sum(one.probability for one in every) == pytest.approx(1.0)
    finding: Any = SimpleNamespace(names=names, key=COULOMB)
    assert [one.key for one in rivals_in_loop(robots.load("tx40"), finding)] == [DEAD, names[1].key]
    slips = Named("hysteresis", (0,), 0.02, SimpleNamespace(shape_names=("length",)), 39.0)  # type: ignore[arg-type]
    third: Any = SimpleNamespace(names=(*of_two(0.1)[:1], slips, names[1]), key=COULOMB)
    # Whatever is likelier: what shows in motion is asked beside the finding.
    asked = [one.name for one in rivals_in_loop(robots.load("tx40"), third)]
    assert asked == [DEAD[0], "position_dependent_friction", "hysteresis"]
    elsewhere: Any = SimpleNamespace(names=(of_two(0.02)[0], replace(slips, joints=(3,))), key=COULOMB)
    assert [one.name for one in rivals_in_loop(robots.load("tx40"), elsewhere)] == [DEAD[0]]
    sure: Any = SimpleNamespace(names=of_two(0.03), key=COULOMB)
    assert [one.key for one in rivals_in_loop(robots.load("tx40"), sure)] == [DEAD]


@pytest.mark.parametrize(
    ("shown", "stands", "beside"),
    [
        (Shown(0.0, 0.1), COULOMB, []),  # 50 nats against the dead zone: Coulomb friction alone
        (Shown(0.5, 0.1), COULOMB, [DEAD]),  # nothing: it cannot be told from the likelier form
        (Shown(1.0, 0.1), DEAD, []),
        (Shown(0.401, 0.3), COULOMB, [DEAD]),  # one nat: even, and two names
    ],
)
def test_the_loop_tells_a_name_from_a_form_that_contains_it(
    monkeypatch: pytest.MonkeyPatch, shown: Shown, stands: Any, beside: list[Any]
) -> None:
    for doubt in ("_may_be_nothing", "_is_its_parts"):
        monkeypatch.setattr(in_motion, doubt, lambda *_: False)
    monkeypatch.setattr(in_motion, "is_of_reversals", lambda robot, rival: False)
    monkeypatch.setattr(in_motion, "component_of", lambda _, placed: SimpleNamespace(key=DEAD))
    names = of_two(1e-3)
    monkeypatch.setattr(in_motion, "rivals_in_loop", lambda robot, finding: [names[0].forms[0]])
    loop: Any = SimpleNamespace(loop_run=lambda step: step.has, shown_in_loop=lambda now, then: shown)
    course: Any = Course()
    course.take([SimpleNamespace(key=COULOMB)], [None])
    finding: Any = SimpleNamespace(key=COULOMB, names=names, unsure="", doubt_of=lambda key: "")
    one: Any = in_motion.settled_in_loop(course, 0, finding, loop).findings[0]
    assert one.component.key == stands
    assert [other.effect for other in one.basis.indistinguishable_from] == [key[0] for key in beside]


def test_a_share_beyond_nothing_or_all_says_no_more_than_that() -> None:
    """Each of two names had less than nothing in the other's place: −55.4 ± 0.5 and −51.7 ± 0.5."""
    for there in (True, False):
        assert Shown(-55.4, 0.5).nats_in_loop(there) == pytest.approx(-0.5 / 55.4**2, rel=0.02)
        assert Shown(0.0, 0.1).nats_in_loop(there) == Shown(0.0, 0.1).nats == pytest.approx(-50.0)
        assert Shown(0.0, 0.0).nats_in_loop(there) == 0.0
    assert Shown(685.0, 7.4).nats_in_loop(False) == pytest.approx(0.5 / 684.0**2, rel=0.02)
    assert Shown(1.57, 0.1).nats_in_loop(False) == pytest.approx(0.5 / (0.57**2 + 0.1**2))


def test_a_share_between_nothing_and_all_is_neither() -> None:
    """Of what viscous does otherwise than dry friction 0.514 ± 0.045 was there: a power of the speed."""
    for there in (True, False):
        away = 0.486 - 1.959964 * 0.045
        assert Shown(0.514, 0.045).nats_in_loop(there) == pytest.approx(0.014 / (away**2 + 0.045**2))
        # A right hysteresis for Coulomb friction; and what is not told from nothing.
        for near in (Shown(0.934, 0.048), Shown(0.19, 0.1)):
            assert near.nats_in_loop(there) == near.nats


@pytest.mark.parametrize(
    ("name", "shown", "asked", "is_parts"),
    [
        ("drifting_friction", Shown(0.2, 0.66), ["coulomb_friction", "viscous_friction"], True),
        ("drifting_friction", Shown(0.9, 0.1), ["coulomb_friction", "viscous_friction"], False),
        ("drifting_friction", None, ["coulomb_friction", "viscous_friction"], False),
        ("stribeck_friction", Shown(0.2, 0.66), [], False),  # it contains one name, which is what stands
    ],
)
def test_a_rival_that_is_no_more_than_what_it_contains_is_none(
    monkeypatch: pytest.MonkeyPatch, name: str, shown: Shown | None, asked: list[str], is_parts: bool
) -> None:
    """Dry and viscous friction were a drift that settles in 43 ± 2000 s; the loop has no price for it."""
    robot = robots.load("tx40")
    family, place = family_named(name), Place("drive", (2,))
    rest = SimpleNamespace(component="another finding", basis=None)
    step: Any = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=robot)))
    course: Any = SimpleNamespace(findings=[SimpleNamespace(component=None, basis=None), rest], step=step)
    rival = Component(family, place, ())
    other: Any = SimpleNamespace(findings=[SimpleNamespace(component=rival), rest], step="with the rival")
    taken: list[Any] = []

    def beside(course: Any, components: Sequence[Any], bases: Sequence[Any]) -> Any:
        assert len(bases) == len(components)
        taken.extend(components)
        return SimpleNamespace(step="with its parts")

    monkeypatch.setattr(in_motion, "_taken", beside)
    compared: list[Any] = []

    def shown_in_loop(*runs: Any) -> Shown | None:
        compared.append(runs)
        return shown

    loop: Any = SimpleNamespace(loop_run=lambda step: step, shown_in_loop=shown_in_loop)
    assert in_motion._is_its_parts(course, 0, other, loop) is is_parts
    assert taken == (["another finding", *taken[1:]] if asked else [])
    assert [one.family.name for one in taken[1:]] == asked
    assert all(one.place == place and one.shape == () for one in taken[1:])
    assert compared == ([("with its parts", "with the rival")] if asked else [])


def test_at_reversals_the_change_is_of_another_size() -> None:
    """Of a right hysteresis in the place of Coulomb friction there was 2.46 ± 0.14."""
    assert Shown(2.46, 0.14).nats_in_loop(True) == pytest.approx(0.5 / 0.14**2)
    assert Shown(685.0, 7.4).nats_in_loop(True) == pytest.approx(0.5 / 7.4**2)


def test_names_of_motion_are_asked_for_no_more_than_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a friction that depends on the position the loop showed 3.7 ± 0.6 in the place of the truth."""
    shown = {(DRIFTING, HYSTERESIS): Shown(3.7, 0.6)}
    monkeypatch.setattr(in_motion, "is_of_reversals", lambda robot, rival: True)
    there = settled(monkeypatch, (66.5, 66.0, 0.0), shown)[1]
    monkeypatch.setattr(in_motion, "is_of_reversals", lambda robot, rival: False)
    moving = settled(monkeypatch, (66.5, 66.0, 0.0), shown)[1]
    assert there is not None and moving is not None
    assert there[HYSTERESIS] / there[DRIFTING] == pytest.approx(np.exp(-0.5 + 0.5 / 0.6**2))
    assert moving[HYSTERESIS] / moving[DRIFTING] == pytest.approx(np.exp(-0.5 + 0.5 / (2.7**2 + 0.6**2)))


def test_what_a_name_stands_for_is_in_its_odds() -> None:
    """Its probability is that of all of them, its own odds are less; what has none left has its odds."""
    listed = probabilities({KEYS[0]: 0.0, KEYS[1]: -1.0, KEYS[2]: -2000.0})
    whole = (replace(listed[0], probability=0.9), replace(listed[1], probability=0.1))
    first, second = with_nats(whole, {KEYS[1]: 1.0})
    assert second.probability / first.probability == pytest.approx(np.e / 9.0)
    assert (first.log_odds, second.log_odds) == (0.0, 0.0)
    last = Slot(with_nats(listed, {KEYS[2]: 2010.0}))
    assert last.names[0].key == KEYS[2] and last.names[0].probability == pytest.approx(1.0, abs=1e-3)


def test_drives_hold_at_standstill_as_fitted_recordings_show_it() -> None:
    """Beside what was found in motion where that was asked, else beside nothing; else as described."""

    class Asked(Exception):
        """Which recordings and which law."""

    def validated(validation: Validation, weighed: object) -> None:
        raise Asked(validation.prepared, validation.whitening, validation.standstill)

    first = SimpleNamespace(examination=SimpleNamespace(of_noise="noise with all that does not repeat"))
    moving = SimpleNamespace(examination=SimpleNamespace(of_noise="noise"))
    course = SimpleNamespace(first=first, moving=moving, validated=validated)
    for beside_nothing, beside_found, asked in (
        ("plain", None, "plain"),
        ("plain", "found", "found"),
        (None, None, None),
    ):
        question: Any = SimpleNamespace(standstill=beside_nothing)
        loop: Any = SimpleNamespace(course=course, answer=None, standstill=beside_found)
        with pytest.raises(Asked) as raised:
            diagnosis._answer(question, loop, cast(Any, ("another recording",)))
        assert raised.value.args == (("another recording",), "noise", asked)


def test_a_rival_with_a_column_of_another_finding_has_no_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """A power of the speed beside viscous friction: the diagnosis ended in equations without an answer."""

    columns, free = np.ones((5, 2)), np.diag([np.inf, np.inf])
    examination: Any = SimpleNamespace(
        prior=SimpleNamespace(covariance=free, values=np.zeros(2)),
        data_rows=5,
        regressor=columns,
        torque=np.ones(5),
        instruments=columns,
    )

    class Step:
        @property
        def shown(self) -> Any:
            return vars(Examination)["shown"].fget(examination)

    other: Any = SimpleNamespace(step=Step())
    course: Any = SimpleNamespace(instead=lambda components, bases: other)
    rival: Any = SimpleNamespace(key=COULOMB)
    assert in_motion._taken(course, [rival], [None]) is None  # type: ignore[list-item]
    other.step = SimpleNamespace(shown=np.zeros(2))
    assert in_motion._taken(course, [rival], [None]) is other  # type: ignore[list-item]
