"""Several searches side by side, watched and stopped while they run."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Protocol, TypeVar

from joblib import Parallel, delayed

from trajectories.motions.motion import Motion
from trajectories.search.workers import of_this_process

Progress = Callable[[float, float], None]
"""Called with the share that is done, in [0, 1], and the best score so far."""

ROUND = 250
"""Trials between two looks at progress and stop."""


class Search(Protocol):
    """One search from one seed; what it knows travels between processes."""

    @property
    def evaluations(self) -> int:
        """Trials it may do."""
        ...

    @property
    def done(self) -> int:
        """Trials it has done."""
        ...

    @property
    def best_score(self) -> float: ...

    def advance(self, trials: int) -> None:
        """Do about that many more trials."""
        ...

    def finished(self) -> Motion:
        """The best motion so far, ready to be driven."""
        ...


AnySearch = TypeVar("AnySearch", bound=Search)


def best_of(
    searches: Sequence[AnySearch],
    workers: int,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> tuple[AnySearch, int]:
    """Advance all searches in turns until they are done, or until ``stop`` says so.

    Args:
        searches: independent of each other.
        workers: processes; their number does not change the result.
        progress: told how far it is, and the best score.
        stop: asked between two rounds.

    Returns:
        The search with the best score, and how many trials all of them did.
    """
    running = list(searches)
    if workers > 1:
        _start_workers(workers)
    total = sum(search.evaluations for search in running)
    while True:
        done = sum(search.done for search in running)
        if progress is not None:
            progress(done / total, min(search.best_score for search in running))
        if done >= total or (stop is not None and stop()):
            return min(running, key=lambda search: search.best_score), done
        running = _advanced(running, workers)


def _start_workers(workers: int) -> None:
    """Start the processes deaf to Ctrl-C: it goes to all of them, but only the first has to answer it."""
    # The tracker is started before the first worker and lets interrupts through again, held or not.
    resource_tracker.ensure_running()
    with _interrupts_held():
        _processes(workers)(delayed(_nothing)() for _ in range(workers))


def _processes(workers: int) -> Parallel:
    return Parallel(n_jobs=workers, **of_this_process())


def _nothing() -> None:
    """What a process does to be there."""


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits until the block ends; processes started inside never get it."""
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _advanced(running: list[AnySearch], workers: int) -> list[AnySearch]:
    if workers == 1:
        return [_advance(search, ROUND) for search in running]
    # A round that crosses processes carries the search there and back, so it is made worth the way.
    return list(_processes(workers)(delayed(_advance)(search, 4 * ROUND) for search in running))


def _advance(search: AnySearch, trials: int) -> AnySearch:
    search.advance(trials)
    return search
