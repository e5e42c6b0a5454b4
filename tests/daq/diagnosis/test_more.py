"""Terms and smallest sizes beside a diagnosis: where they are asked for, in words, and as JSON."""

from __future__ import annotations

from io import StringIO
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from daq.diagnosis import more as module
from daq.diagnosis.more import More, more_of, print_more
from daq.diagnosis.term_words import term_words
from daq.text.progress import Silent
from ident import IdentificationError
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.discrepancy.onset import Onset

TERM = Proposal(
    3, "q̇₃·|cos 2q₃|", "N·m·s/rad", 0.31, 0.021, ("q3", "v3"), 0.9, 0.12, 0.01, "an eccentric rotor"
)
QUESTION: Any = SimpleNamespace(fit=(SimpleNamespace(name="night.mcap"),))


def found(verdict: str, *, power: bool = False) -> More:
    diagnosis: Any = SimpleNamespace(verdict=verdict, examinations=(), findings=())
    return more_of(diagnosis, QUESTION, Silent(), power=power)


def test_a_term_is_looked_for_where_nothing_has_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "proposed_terms", lambda question: (TERM,))
    monkeypatch.setattr(module, "with_terms", lambda question, diagnosis, terms: (diagnosis, terms))
    more: Any = found("unnamed")
    assert more.terms == (TERM,)
    assert more.model is not None and more.model[1] == (TERM,)
    for verdict in ("clean", "named", "ambiguous", "not_confirmed"):
        assert found(verdict) == More(names=("night.mcap",))


def test_recordings_that_no_term_can_be_asked_of_cost_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(question: object) -> tuple[Proposal, ...]:
        raise IdentificationError("too short")

    monkeypatch.setattr(module, "proposed_terms", refused)
    assert found("unnamed").terms == ()


def test_sizes_are_said_where_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "recorded_sizes", lambda question: ())
    assert found("clean").power is None and "power" not in found("clean").as_json()
    assert found("clean", power=True).as_json()["power"] == {"chance": 0.8, "smallest": []}


def test_when_a_finding_began_is_told_in_words_and_as_json() -> None:
    began = Onset(1, "begins", 0.998, 7.317, (7.312, 7.324), 1, 0.02, 1.4, 0.05, 0.06)
    drifts = Onset(2, "drifts", 0.95, np.nan, (np.nan, np.nan), 1, 0.5, 1.5, 0.1, 0.1)
    more = More(onsets=(began, drifts), names=("night.mcap",))
    first, second = more.when
    assert "Finding 1 begins at 7.32 s of night.mcap, with 95 % between 7.31 and 7.32 s" in first
    assert "0.02 ± 0.05, after it 1.40 ± 0.06" in first
    assert second.startswith("Finding 2 drifts over the recordings, from 0.50 ± 0.10 to 1.50 ± 0.10")
    console = Console(width=400, record=True, file=StringIO())
    print_more(console, more)
    assert first in console.export_text()
    one, other = more.as_json()["onsets"]
    assert (one["kind"], one["time"], one["interval"]) == ("begins", 7.317, [7.312, 7.324])
    assert (other["kind"], other["time"], other["interval"]) == ("drifts", None, [None, None])


def test_a_term_in_words_and_as_json() -> None:
    words = term_words(TERM)
    assert "joint 3 has (0.310 ± 0.021) N·m·s/rad · q̇₃·|cos 2q₃|" in words
    assert "an eccentric rotor" in words
    console = Console(width=200, record=True, file=StringIO())
    print_more(console, More(None, (TERM,)))
    assert "q̇₃·|cos 2q₃|" in console.export_text()
    (term,) = More(None, (TERM,)).as_json()["terms"]
    assert term["unexplained"] == {"before": 0.12, "after": 0.01} and term["variables"] == ["q3", "v3"]
