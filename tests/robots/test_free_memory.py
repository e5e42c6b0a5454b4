"""Free memory goes back to the system."""

from __future__ import annotations

import gc
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from robots import free_memory

_BLOCK, _BLOCKS = 4096, 20_000
_PROCESS = Path("/proc/self/statm")


def resident() -> int:
    """Bytes of this process that are in memory, as the system counts them."""
    return int(_PROCESS.read_text("utf-8").split()[1]) * os.sysconf("SC_PAGESIZE")


@pytest.mark.skipif(
    not _PROCESS.exists() or free_memory._c_library() is None, reason="only glibc can be asked for it"
)
def test_what_is_free_below_what_is_used_is_given_back() -> None:
    kept = [bytearray(b"1") * _BLOCK for _ in range(_BLOCKS)]
    del kept[:-1]  # the last one holds the heap up
    before = resident()
    free_memory.give_back()
    assert before - resident() > 0.5 * _BLOCK * _BLOCKS
    assert len(kept) == 1


@pytest.mark.skipif(not _PROCESS.exists(), reason="only Linux tells what a process has")
def test_what_refers_to_itself_is_given_back() -> None:
    circle: list[object] = [bytearray(b"1") * (_BLOCK * _BLOCKS)]
    circle.append(circle)
    before = resident()
    del circle
    free_memory.give_back()
    assert before - resident() > 0.5 * _BLOCK * _BLOCKS


def test_another_c_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_memory, "_c_library", lambda: None)
    free_memory.give_back()


def test_what_stays_for_good_is_looked_at_no_more() -> None:
    before = gc.get_freeze_count()
    try:
        with free_memory.for_good():
            assert not gc.isenabled()
            kept = [[] for _ in range(1000)]  # type: ignore[var-annotated]
        assert gc.isenabled()
        assert gc.get_freeze_count() - before >= len(kept)
        assert not any(one is kept for one in gc.get_objects())
    finally:
        gc.unfreeze()


def test_threads_share_one_heap_where_the_library_can(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[tuple[int, int]] = []
    library = SimpleNamespace(mallopt=lambda *given: said.append(given))
    for one in (library, SimpleNamespace(), None):
        monkeypatch.setattr(free_memory, "_c_library", lambda one=one: one)
        free_memory.one_heap()
    assert said == [(-8, 1)]
