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

    monkeypatch.setattr(diagnosis, "_component", lambda robot, placed: None)
    monkeypatch.setattr(diagnosis, "basis_of", lambda *given: None)
    finding = SimpleNamespace(
        something=1.0, placed=None, key=("offset", (0,)), names=(), doubt="", words=lambda: "offset (joint 1)"
    )
    led: Any = SimpleNamespace(
        answer=SimpleNamespace(findings=[finding]),
        step=SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=None))),
        course=SimpleNamespace(take=take),
    )
    with caplog.at_level(logging.WARNING):
        diagnosis._Led._search_in_motion(led)
    assert "offset (joint 1): the effects have no columns" in caplog.text
