"""What the fit of sizes takes up whole gets no name, and the diagnosis goes on."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from ident.discrepancy.by_evidence import in_motion
from ident.discrepancy.by_evidence.decide.names import Named


def test_an_effect_that_the_model_takes_up_whole_ends_no_diagnosis(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Met on a drawn log after a refit: the evidence had names, the fit of their sizes had no columns."""

    def take(components: object, bases: object, sizes: object, standard: object) -> None:
        raise ArithmeticError("the effects have no columns beyond the present model")

    monkeypatch.setattr(in_motion, "component_of", lambda robot, placed: None)
    monkeypatch.setattr(in_motion, "basis_of", lambda *given: None)
    monkeypatch.setattr(in_motion, "_has_size", lambda course, finding: True)
    answer: Any = SimpleNamespace(findings=[named("offset (joint 1)")], standard=None)
    step = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=None)))
    course: Any = SimpleNamespace(step=step, take=take)
    nobody: Any = None
    with caplog.at_level(logging.WARNING):
        assert in_motion.found_in_motion(course, answer, nobody) is course
    assert "offset (joint 1): the effects have no columns" in caplog.text


def named(words: str, something: float = 1.0) -> SimpleNamespace:
    """A finding, of which something is there for sure."""
    names = (Named(words, (), something),)
    return SimpleNamespace(
        something=something,
        placed=words,
        words=lambda: words,
        key=(words, ()),
        names=names,
        unsure="",
        doubt="",
        linear=f"size of {words}",
    )


def test_an_effect_without_rows_takes_no_name_from_the_others(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What the present model takes up whole would leave the others without sizes."""
    taken: list[str] = []
    monkeypatch.setattr(in_motion, "component_of", lambda _, words: SimpleNamespace(effect=lambda *_: words))
    monkeypatch.setattr(in_motion, "basis_of", lambda *given: None)
    monkeypatch.setattr(in_motion, "rivals_in_loop", lambda robot, finding: [])
    monkeypatch.setattr(in_motion, "partialled", lambda _, words: None if words == "offset" else words)
    model = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=None)))
    first = SimpleNamespace(base=model.base, examination=None, present=None)

    def take(components: list[Any], bases: object, sizes: list[str], standard: object) -> None:
        taken.extend(one.effect() for one in components)
        taken.extend(sizes)

    answer: Any = SimpleNamespace(
        findings=[named("offset"), named("lag"), named("play", 0.85)], standard=None
    )
    course: Any = SimpleNamespace(take=take, first=first, step=model, findings=[])
    nobody: Any = None
    with caplog.at_level(logging.WARNING):
        in_motion.found_in_motion(course, answer, nobody)
    assert taken == ["lag", "size of lag"]
    assert "offset: the rows" in caplog.text
