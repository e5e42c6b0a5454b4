"""Free memory, given back to the system.

A long search works on one set of rows after the other, hundreds of megabytes each. The C library keeps what
is freed in the heap of the thread that asked for it, so that the largest needs of all steps add up.
"""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

_MOST_HEAPS = -8
"""``M_ARENA_MAX`` of glibc's ``malloc.h``."""


def give_back() -> None:
    """Give free memory back where the C library can; a tenth of a second.

    What refers to itself goes first: a model keeps torques of motions, and these what is made of the model.
    """
    gc.collect()
    library = _c_library()
    if library is not None:
        library.malloc_trim(0)


def one_heap() -> None:
    """Let all threads that begin later share one heap, where the C library can.

    It gives each its own, where what one has freed serves no other: a tenth of all memory in a long search.
    """
    library = _c_library()
    if library is not None and hasattr(library, "mallopt"):
        library.mallopt(_MOST_HEAPS, 1)


@contextmanager
def for_good() -> Iterator[None]:
    """What is made inside stays until the end, as modules do: nobody looks whether it has become garbage.

    Two hundred thousand objects of modules are a tenth of a second each time that somebody looks.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


@cache
def _c_library() -> Any | None:
    """That of this process where it is glibc; None else."""
    try:
        library = ctypes.CDLL(None)
    except (OSError, TypeError):  # a system where a process is no library
        return None
    return library if hasattr(library, "malloc_trim") else None
