"""Free memory goes back to the system."""

from __future__ import annotations

import os
from pathlib import Path

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
