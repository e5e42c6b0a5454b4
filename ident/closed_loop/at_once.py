"""Work whose parts do not depend on each other, on all processors: machine code holds no lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Other = TypeVar("Other")


def at_once(
    function: Callable[[Asked], Answer], items: Sequence[Asked], threads: int | None = None
) -> list[Answer]:
    """The answers in the order of what was asked; they do not depend on the number of threads.

    Args:
        function: of one item; what it keeps must bear being asked twice.
        items: what is asked.
        threads: by default one per processor.
    """
    workers = min(len(items), threads or processors())
    if workers <= 1:
        return [function(item) for item in items]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, items))


def beside(here: Callable[[], Answer], there: Callable[[], Other]) -> tuple[Answer, Other]:
    """The answers of two that do not depend on each other; an interrupt reaches the one that is asked here.

    Args:
        here: asked in the calling thread; what it raises counts, whatever the other one does.
        there: asked meanwhile, where there is a processor for it.
    """
    if processors() <= 1:
        return here(), there()
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(there)
        return here(), other.result()


def processors() -> int:
    """How many there are."""
    return os.cpu_count() or 1
