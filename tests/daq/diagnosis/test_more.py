"""Terms and smallest sizes beside a diagnosis: where they are asked for, in words, and as JSON."""

from __future__ import annotations

from io import StringIO
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from daq.diagnosis import more as module
from daq.diagnosis.more import More, more_of, print_more
from daq.diagnosis.term_words import term_words
from daq.text.progress import Silent
from ident import IdentificationError
from ident.discrepancy.by_evidence.terms.proposal import Proposal

TERM = Proposal(
    3, "q̇₃·|cos 2q₃|", "N·m·s/rad", 0.31, 0.021, ("q3", "v3"), 0.9, 0.12, 0.01, "an eccentric rotor"
)
QUESTION: Any = SimpleNamespace()


def found(verdict: str, *, power: bool = False) -> More:
    diagnosis: Any = SimpleNamespace(verdict=verdict)
    return more_of(diagnosis, QUESTION, Silent(), power=power)


def test_a_term_is_looked_for_where_nothing_has_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "proposed_terms", lambda question: (TERM,))
    monkeypatch.setattr(module, "with_terms", lambda question, diagnosis, terms: (diagnosis, terms))
    more: Any = found("unnamed")
    assert more.terms == (TERM,)
    assert more.model == (SimpleNamespace(verdict="unnamed"), (TERM,))
    for verdict in ("clean", "named", "ambiguous", "not_confirmed"):
        assert found(verdict) == More()


def test_recordings_that_no_term_can_be_asked_of_cost_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(question: object) -> tuple[Proposal, ...]:
        raise IdentificationError("too short")

    monkeypatch.setattr(module, "proposed_terms", refused)
    assert found("unnamed").terms == ()


def test_sizes_are_said_where_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "recorded_sizes", lambda question: ())
    assert found("clean").power is None and "power" not in found("clean").as_json()
    assert found("clean", power=True).as_json()["power"] == {"chance": 0.8, "smallest": []}


def test_a_term_in_words_and_as_json() -> None:
    words = term_words(TERM)
    assert "joint 3 has (0.310 ± 0.021) N·m·s/rad · q̇₃·|cos 2q₃|" in words
    assert "an eccentric rotor" in words
    console = Console(width=200, record=True, file=StringIO())
    print_more(console, More(None, (TERM,)))
    assert "q̇₃·|cos 2q₃|" in console.export_text()
    (term,) = More(None, (TERM,)).as_json()["terms"]
    assert term["unexplained"] == {"before": 0.12, "after": 0.01} and term["variables"] == ["q3", "v3"]
