"""Work on all processors: the answers are those of one."""

from __future__ import annotations

from threading import Event, current_thread

import pytest

from ident.closed_loop import at_once as module
from ident.closed_loop.at_once import at_once, beside

PATIENCE = 60.0
"""s, for what would wait for ever."""


@pytest.fixture(params=[1, 2])
def processors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(module, "processors", lambda: request.param)
    return int(request.param)


@pytest.mark.usefixtures("processors")
def test_answers_stand_in_the_order_of_what_was_asked() -> None:
    assert at_once(lambda k: k * k, range(9)) == [k * k for k in range(9)]
    assert at_once(lambda k: k * k, ()) == []
    assert beside(lambda: "here", lambda: 2) == ("here", 2)


def test_the_one_goes_on_while_the_other_waits_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "processors", lambda: 2)
    done = Event()
    here, there = beside(
        lambda: (done.wait(PATIENCE), current_thread()), lambda: (done.set(), current_thread())
    )
    assert here == (True, current_thread())
    assert there[1] is not current_thread()


def test_what_is_raised_here_comes_first(processors: int) -> None:
    def fail(word: str) -> None:
        raise ValueError(word)

    with pytest.raises(ValueError, match="here"):
        beside(lambda: fail("here"), lambda: fail("there"))
    with pytest.raises(ValueError, match="there"):
        beside(lambda: processors, lambda: fail("there"))
