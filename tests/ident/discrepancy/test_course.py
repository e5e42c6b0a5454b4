"""What becomes of findings that data that was not fitted contradicts."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy import course as module
from ident.discrepancy.accepted import Accepted
from ident.discrepancy.confirmation import Confirmation, Shown
from ident.discrepancy.course import Course
from ident.errors import IdentificationError


def step(effects: int) -> Any:
    return SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(effects=(None,) * effects)))


def accepted(name: str, doubt: str = "", **more: float) -> Any:
    return SimpleNamespace(name=name, basis=SimpleNamespace(doubt=doubt), **more)


class _Course(Course):
    """A course without a model.

    Attributes:
        fits: how often findings were fitted together.
    """

    fits = 0

    def _fit_together(self, accepted: Sequence[Accepted]) -> None:
        self.fits += 1
        self.findings = list(accepted)
        self.step = self.moving = step(1 + len(accepted))

    def _without(self, position: int) -> Any:
        return step(0)


class _Validation:
    """Says of each finding how much of it is there.

    Attributes:
        asked: of which loop, the last time.
    """

    asked: Any = None

    def by_likelier_law(self, step: Any) -> SimpleNamespace:
        effects = len(step.base.model.effects)
        return SimpleNamespace(loop_run=lambda _: (None, f"by the law of {effects} effects"))

    def loop_run(self, step: object) -> tuple[None, str]:
        return None, "as recordings show it"

    def finding(self, accepted: Any, without: object, whole: object, loops: object) -> Any:
        self.asked = loops
        confirmation = Confirmation(Shown(accepted.share, accepted.sigma), None)
        return SimpleNamespace(name=accepted.name, confirmation=confirmation)


def validated(in_motion: str, at_reversals: str = "") -> tuple[str, str]:
    """Names of what stays and of what is left out; small letters are not there, of ``?`` nobody knows, and
    where ``*`` acts nothing moves."""
    found: Any = [
        accepted(
            name,
            share={"?": 0.4, "*": 0.0}.get(name, 1.0 if name.isupper() else -0.1 * k),
            sigma={"?": 0.3, "*": 0.0}.get(name, 0.01),
        )
        for k, name in enumerate(in_motion + at_reversals)
    ]
    course = _Course((), step(1), step(1 + len(found)), step(1 + len(in_motion)), None, found)
    if not at_reversals:
        course.step = course.moving
    validation: Any = _Validation()
    kept, rejected, _ = course.validated(validation)
    return "".join(one.name for one in kept), "".join(one.name for one in rejected)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("in_motion", "at_reversals", "kept", "rejected"),
    [
        ("AB", "", "AB", ""),
        ("Ab", "", "A", "b"),
        ("AbCd", "", "AC", "db"),
        ("ab", "", "a", "b"),
        ("a?b", "", "a?", "b"),
        ("ab", "?", "ab?", ""),
        ("A", "r", "A", "r"),
        ("Ab", "R", "AbR", ""),
        ("Ab", "r", "A", "rb"),
        ("", "r", "", "r"),
        ("a", "r", "a", "r"),
        ("", "?", "?", ""),
        ("A*b", "", "A*", "b"),
        ("*b", "", "*", "b"),
        ("*?", "", "*?", ""),
        ("A*", "r", "A*", "r"),
        ("A", "*", "A*", ""),
    ],
)
def test_what_is_contradicted_beside_what_is_confirmed_is_taken_out(
    in_motion: str, at_reversals: str, kept: str, rejected: str
) -> None:
    assert validated(in_motion, at_reversals) == (kept, rejected)


@pytest.mark.parametrize(
    ("at_reversals", "asked"), [("", "as recordings show it"), ("R", "by the law of 3 effects")]
)
def test_what_reversals_showed_is_asked_by_the_likelier_law_of_the_model_with_it(
    at_reversals: str, asked: str
) -> None:
    found: Any = [accepted(name, share=1.0, sigma=0.01) for name in "A" + at_reversals]
    course = _Course((), step(1), step(1 + len(found)), step(2), None, found)
    validation: Any = _Validation()
    course.validated(validation)
    assert validation.asked == ((None, asked), (None, asked))


class _BesideWhatIsDoubted(_Validation):
    """A loop does otherwise with friction as long as a delay that may as well be nothing is in the model."""

    def finding(self, accepted: Any, without: object, whole: Any, loops: object) -> Any:
        doubted = accepted.name == "delay"
        disturbed = len(whole.base.model.effects) == 4
        loop = Shown(0.0, 0.1) if disturbed and not doubted else Shown(1.0, 0.1)
        share = {"delay": 1.2, "friction": 1.0, "play": 1.1}[accepted.name]
        confirmation = Confirmation(
            Shown(share, 0.01),
            None if accepted.name == "play" else loop,
            "may be nothing" if doubted else "",
        )
        return SimpleNamespace(name=accepted.name, confirmation=confirmation)


def test_what_is_doubted_goes_before_what_only_the_loop_beside_it_contradicts() -> None:
    found: Any = [accepted(name) for name in ("friction", "delay", "play")]
    course = _Course((), step(1), step(4), step(4), None, found)
    course.step = course.moving
    validation: Any = _BesideWhatIsDoubted()
    left, rejected, _ = course.validated(validation)
    assert [one.name for one in left] == ["friction", "play"]  # type: ignore[attr-defined]
    assert [one.name for one in rejected] == ["delay"]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("names", "kept", "rejected", "fits"), [("A?b?", "A", "?b?", 1), ("???", "???", "", 0)]
)
def test_what_the_search_itself_doubts_goes_at_once(names: str, kept: str, rejected: str, fits: int) -> None:
    """Other motion does not change the doubt, so no fit without one of them at a time is needed."""
    found: Any = [accepted(name, "" if name == "A" else "no name", share=1.0, sigma=0.01) for name in names]
    course = _Course((), step(1), step(1 + len(found)), step(1 + len(found)), None, found)
    course.step = course.moving
    validation: Any = _Doubting()
    left, gone, _ = course.validated(validation)
    assert "".join(one.name for one in left) == kept  # type: ignore[attr-defined]
    assert "".join(one.name for one in gone) == rejected  # type: ignore[attr-defined]
    assert course.fits == fits


class _Doubting(_Validation):
    """Other motion shows all of it, and the search has its doubts."""

    def finding(self, accepted: Any, without: object, whole: object, loops: object) -> Any:
        confirmation = Confirmation(Shown(accepted.share, accepted.sigma), None, accepted.basis.doubt)
        return SimpleNamespace(name=accepted.name, confirmation=confirmation)


class _BesideEachOther(_Validation):
    """Other motion shows a spring whole, once no base that gives way is in the model."""

    def finding(self, accepted: Any, without: object, whole: Any, loops: object) -> Any:
        alone = len(whole.base.model.effects) == 2
        share = {"spring": 0.8 if alone else 0.5, "base": -19.0 if alone else 0.9, "delay": 0.6}[
            accepted.name
        ]
        sigma = 0.1 if alone and accepted.name == "spring" else 10.0
        return SimpleNamespace(name=accepted.name, confirmation=Confirmation(Shown(share, sigma), None))


class _TooMuch(_Validation):
    """A delay of which other motion shows 21 times as much leaves little of the gear beside it."""

    def finding(self, accepted: Any, without: object, whole: Any, loops: object) -> Any:
        alone = len(whole.base.model.effects) == 2
        share = {"gear": 1.0 if alone else 0.2, "delay": 21.0}[accepted.name]
        return SimpleNamespace(name=accepted.name, confirmation=Confirmation(Shown(share, 0.01), None))


def test_what_is_contradicted_is_not_confirmed_for_the_first_and_the_first_may_be_without_it() -> None:
    """Alone the other is no more confirmed; so it goes, and what explains most is asked for again."""
    found: Any = [accepted(name) for name in ("gear", "delay")]
    course = _Course((), step(1), step(3), step(3), None, found)
    course.step = course.moving
    validation: Any = _TooMuch()
    left, gone, _ = course.validated(validation)
    assert [one.name for one in left] == ["gear"]  # type: ignore[attr-defined]
    assert [one.name for one in gone] == ["delay"]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("names", "kept", "rejected"),
    [
        (("spring", "base", "delay"), ["spring"], ["delay", "base"]),
        (("base", "delay"), ["base", "delay"], []),
    ],
)
def test_where_nothing_is_confirmed_beside_the_rest_the_rest_goes_or_all_of_it_stays(
    names: Sequence[str], kept: list[str], rejected: list[str]
) -> None:
    count = 1 + len(names)
    found: Any = [accepted(name) for name in names]
    course = _Course((), step(1), step(count), step(count), None, found)
    course.step = course.moving
    validation: Any = _BesideEachOther()
    left, gone, _ = course.validated(validation)
    assert [one.name for one in left] == kept  # type: ignore[attr-defined]
    assert [one.name for one in gone] == rejected  # type: ignore[attr-defined]
    assert [one.name for one in course.findings] == kept  # type: ignore[attr-defined]
    assert len(course.step.base.model.effects) == 1 + len(kept)


class _Undetermined:
    """Rows of a loop in which something of the model has none."""

    @property
    def covariance(self) -> object:
        raise IdentificationError("rows that are fitted do not determine every parameter")


@pytest.mark.parametrize("again", [False, True])
def test_sizes_are_fitted_beside_the_model_that_has_them(
    monkeypatch: pytest.MonkeyPatch, again: bool
) -> None:
    """As the evidence has it; and what is fitted again without a finding, as it was with it."""
    fitted: list[Any] = []

    def refit(examination: Any, components: Any, present: Any, about: Any) -> Any:
        fitted.append(about)
        raise ArithmeticError

    monkeypatch.setattr(module, "refit", refit)
    monkeypatch.setattr(module, "with_effects", lambda examination, components, alone, *values: values)
    first: Any = SimpleNamespace(examination=None, present=SimpleNamespace(standard=np.zeros(2)))
    first.beside = lambda effects, sizes: first
    moving: Any = SimpleNamespace(present=SimpleNamespace(standard=np.array([1.0, 2.0, 30.0])))
    course = Course((), first, first, moving)
    one: Any = SimpleNamespace(effect=lambda *given: None)
    found: Any = [accepted("A", linear="size", component=one)]
    with pytest.raises(ArithmeticError):
        course._fit_together(found) if again else course.take(
            [one], [], found[0].linear, np.array([1.0, 2.0])
        )
    ((standard, sizes),) = fitted
    assert standard.tolist() == [1.0, 2.0]
    assert sizes == (["size"] if again else "size")


def test_the_fit_of_other_findings_begins_where_this_one_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """A delay of another drive, 0 beside a dead zone and 31 µs beside an offset, told the loop these two."""
    base = SimpleNamespace(model=SimpleNamespace(robot=None))
    first: Any = SimpleNamespace(examination="rows", present="without", base=base)
    moving: Any = SimpleNamespace(present="with a dead zone")

    class Begun(Course):
        def _extended(self, before: Any, refined: Any) -> Any:
            return SimpleNamespace(before=before, refined=refined)

    monkeypatch.setattr(module, "refit", lambda *given: given)
    monkeypatch.setattr(module, "Course", Begun)
    named: Any = SimpleNamespace(of=lambda robot, one, basis, refined, k: accepted(f"{one} for {basis}"))
    monkeypatch.setattr(module, "Accepted", named)
    course = Course((), first, first, moving, None, [accepted("dead zone")])
    other = course.instead(["offset"], ["a reason"])  # type: ignore[list-item]
    assert other.step is other.moving and vars(other.step) == {
        "before": first,
        "refined": ("rows", ["offset"], "without", "with a dead zone"),
    }
    assert [one.name for one in other.findings] == ["offset for a reason"]  # type: ignore[attr-defined]
    assert course.moving is moving and [one.name for one in course.findings] == ["dead zone"]  # type: ignore[attr-defined]


def test_what_leaves_a_parameter_of_the_loop_undetermined_is_not_added(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A drive that saturates has no row in such a loop; beside a hysteresis there was no answer at all."""
    found: Any = [SimpleNamespace(name="saturation")]
    course = _Course((), step(1), step(2), step(2), None, found)
    before = course.step
    monkeypatch.setattr(module, "refit", lambda *rows: None)
    monkeypatch.setattr(module, "sized_in_loop", lambda *rows: None)
    monkeypatch.setattr(course, "_extended", lambda *rows: SimpleNamespace(examination=_Undetermined()))
    in_loop: Any = SimpleNamespace(examination=None, present=None)
    nobody: Any = None
    with pytest.raises(IdentificationError):
        course.add_in_loop(in_loop, nobody, nobody)
    assert course.step is before and course.findings == found and course.reversing is None
