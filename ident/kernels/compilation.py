"""How functions of the closed loop become machine code that is kept on disk.

Compiled code contains the code of the functions that it calls, but numba takes code from its cache as long
as the one file of the calling function is unchanged. Here the stamp of every cached function is that of all
files of this package together, so a change in any of them compiles anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")


def stamp_of(folder: Path) -> bytes:
    """A digest of all Python files in a folder."""
    digest = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.digest()


_STAMP = stamp_of(Path(__file__).parent)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Machine code, kept on disk where there is a writable place for it; strict IEEE arithmetic, no GIL.

    It makes no arrays: so it need not count who has which, which took half the time of a step.
    """
    return compiled_with_stamp(function, _STAMP, _nrt=False)


def making_arrays(function: Callable[P, R]) -> Callable[P, R]:
    """The same of what makes arrays."""
    return compiled_with_stamp(function, _STAMP)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Part of the machine code of each function that calls it."""
    return numba.njit(inline="always", error_model="numpy")(function)


def compiled_with_stamp(function: Callable[P, R], stamp: bytes, **options: bool) -> Callable[P, R]:
    """The same, where code from the disk counts only if it was kept under the same stamp."""
    njit: Any = partial(numba.njit, nogil=True, error_model="numpy", **options)
    try:
        dispatcher: Any = njit(cache=True)(function)
    except RuntimeError:  # no place for a cache
        machine_code: Callable[P, R] = njit()(function)
        return machine_code
    # numba has no setting for this; a test sees to it that the attribute does what is said here.
    dispatcher._cache._cache_file._source_stamp = stamp
    kept: Callable[P, R] = dispatcher
    return kept


def is_kept(function: Callable[..., Any], first: object) -> bool:
    """Whether machine code for such a first argument is on disk: the first call compiles otherwise."""
    cache = getattr(function, "_cache", None)
    kept = getattr(cache, "_cache_file", None)  # none where numba found no place for one
    wanted: Any = numba.typeof(first)  # type: ignore[no-untyped-call]
    return kept is not None and any(key[0][0] == wanted for key in kept._load_index())
