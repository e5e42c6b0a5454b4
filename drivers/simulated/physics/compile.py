"""Machine code for the plant: which functions are compiled, and when compiled code on disk is stale.

Numba looks at the age of one file when it decides whether its code on disk still holds. The plant's
physics stands in several files, so entry points carry the digest of all of them: they are made inside a
function that closes over it, and numba tells closures apart by what they hold.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Compiled as a part of the entry points that call it; strict IEEE arithmetic."""
    compiled: Callable[P, R] = numba.njit(nogil=True, error_model="numpy")(function)
    return compiled


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """As :func:`inner`, written out where it is called: handing over many arrays costs more than the work."""
    compiled: Callable[P, R] = numba.njit(nogil=True, error_model="numpy", inline="always")(function)
    return compiled


def entry(function: Callable[P, R]) -> Callable[P, R]:
    """Compiled code that Python calls; kept on disk where there is a writable place for it."""
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no place for a cache
        return numba.njit(nogil=True, error_model="numpy")(function)


def on_disk(function: Callable[..., Any]) -> bool:
    """Whether machine code of an entry point is kept on disk: its first call compiles otherwise."""
    cache = getattr(function, "_cache", None)
    kept = getattr(cache, "_cache_file", None)  # none where numba found no place for one
    return kept is not None and bool(kept._load_index())


def source_digest() -> int:
    """A number that changes with any file of this package."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return int.from_bytes(digest.digest()[:6], "big")
