"""What the fit of sizes takes up whole gets no name, and the diagnosis goes on."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from ident.discrepancy.by_evidence import diagnosis


def test_an_effect_that_the_model_takes_up_whole_ends_no_diagnosis(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Met on a drawn log after a refit: the evidence had names, the fit of their sizes had no columns."""

    def take(components: object, bases: object) -> None:
        raise ArithmeticError("the effects have no columns beyond the present model")

    monkeypatch.setattr(diagnosis, "component_of", lambda robot, placed: None)
    monkeypatch.setattr(diagnosis, "basis_of", lambda *given: None)
    led: Any = SimpleNamespace(
        answer=SimpleNamespace(findings=[named("offset (joint 1)")]),
        step=SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=None))),
        course=SimpleNamespace(take=take),
        _has_size=lambda finding: True,
    )
    with caplog.at_level(logging.WARNING):
        diagnosis._Led._search_in_motion(led)
    assert "offset (joint 1): the effects have no columns" in caplog.text


def named(words: str) -> SimpleNamespace:
    """A finding that is sure."""
    return SimpleNamespace(
        something=1.0, placed=words, words=lambda: words, key=(words, ()), names=(), unsure="", doubt=""
    )


def test_an_effect_without_rows_takes_no_name_from_the_others(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Where no motion repeats a measured torque would explain itself, and saturation has no rows."""
    taken: list[str] = []
    monkeypatch.setattr(diagnosis, "component_of", lambda _, words: SimpleNamespace(effect=lambda *_: words))
    monkeypatch.setattr(diagnosis, "basis_of", lambda *given: None)
    monkeypatch.setattr(diagnosis, "at_reversals", lambda robot, finding: [])
    monkeypatch.setattr(diagnosis, "partialled", lambda _, words: None if words == "saturation" else words)
    model = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=None)))
    first = SimpleNamespace(base=model.base, examination=None, present=None)
    take = lambda components, bases: taken.extend(one.effect() for one in components)  # noqa: E731
    led: Any = diagnosis._Led.__new__(diagnosis._Led)
    led.answer = SimpleNamespace(findings=[named("saturation"), named("lag")])
    led.course = SimpleNamespace(take=take, first=first, step=model, findings=[])
    with caplog.at_level(logging.WARNING):
        led._search_in_motion()
    assert taken == ["lag"]
    assert "saturation: the rows" in caplog.text
