"""Free memory, given back to the system.

A long search works on one set of rows after the other, hundreds of megabytes each. The C library keeps what
is freed in the heap of the thread that asked for it, so that the largest needs of all steps add up.
"""

from __future__ import annotations

import ctypes
import gc
from functools import cache
from typing import Any


def give_back() -> None:
    """Give free memory back where the C library can; a tenth of a second.

    What refers to itself goes first: a model keeps torques of motions, and these what is made of the model.
    """
    gc.collect()
    library = _c_library()
    if library is not None:
        library.malloc_trim(0)


@cache
def _c_library() -> Any | None:
    """That of this process where it is glibc; None else."""
    try:
        library = ctypes.CDLL(None)
    except (OSError, TypeError):  # a system where a process is no library
        return None
    return library if hasattr(library, "malloc_trim") else None
