"""The heavy part of a check, from a recording to a model: for any process that sees the file."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import robots
from daq.check.errors import CheckError
from daq.importing.captures import loaded_capture
from daq.recording.reader import read_capture
from daq.session.session_error import RunInterrupted
from ident import Fitted, Options, identify
from ident.identification.found_effects import FoundModel
from robots.errors import UserError, shortened

log = logging.getLogger(__name__)
T = TypeVar("T")


@dataclass(frozen=True)
class AnalysisOrder:
    """What to identify.

    Attributes:
        source: name or path of the arm.
        capture: the recording.
        method: of the baseline, ``ls`` or ``iv``; what the revised test recommends where None.
        found: the model of the baseline where it has found effects, which are part of this one then.
    """

    source: str
    capture: Path
    method: str | None = None
    found: FoundModel | None = None


Identify = Callable[[Sequence[AnalysisOrder]], list[Fitted | Exception | None]]
"""Identifies several recordings at once; None for what the death of a process took along."""


def analyse(order: AnalysisOrder) -> Fitted:
    """Identify; the same order gives the same numbers bit for bit wherever it is done.

    Raises:
        CaptureError, RobotFileError, IdentificationError: one line each.
    """
    robot = robots.load(order.source)
    loaded = loaded_capture(read_capture(order.capture), robot)
    fitted = identify(robot, loaded.recordings, options=Options(found=order.found))
    result = replace(fitted.result, warnings=(*loaded.warnings, *fitted.result.warnings))
    if any(estimate.method == order.method for estimate in result.estimates):
        # Tonight's estimate is compared with one of its own kind; the verdict of the test stays what it is.
        result = replace(result, method=order.method)  # type: ignore[arg-type]
    return replace(fitted, result=result)


def tried(order: AnalysisOrder) -> Fitted | Exception:
    """As :func:`analyse`, or why not; a process that is handed an order can find it by its name."""
    return attempted(partial(analyse, order))


def attempted(make: Callable[[], T]) -> T | Exception:
    """What is made for one arm, or why not, so that the others go on."""
    try:
        return make()
    except Exception as error:  # noqa: BLE001 (whatever it is, the others' night goes on)
        return _explained(error)


def _explained(error: Exception) -> Exception:
    """What went wrong with one arm; what no user can cause is one line too, and its trace is in the log."""
    if isinstance(error, UserError | OSError | RunInterrupted):
        return error
    log.error("a mistake of armhil's own", exc_info=error)
    return CheckError(
        f"{type(error).__name__}: {shortened(error)} (a mistake of armhil's own; its log has the trace)"
    )


def require_backend(backend: str) -> None:
    """Can identifications be handed to that backend? Asked before anything moves.

    Raises:
        CheckError: joblib does not know it, or what it needs is not installed.
    """
    from joblib.parallel import BACKENDS, EXTERNAL_BACKENDS

    known = sorted({*BACKENDS, *EXTERNAL_BACKENDS})
    if backend not in known:
        raise CheckError(f"--backend {backend}: joblib does not know it; allowed: {', '.join(known)}")
    if backend == "dask" and find_spec("distributed") is None:
        raise CheckError(
            "--backend dask: dask is not installed; allowed: with dask[distributed] beside armhil"
        )


@contextmanager
def _client(jobs: int) -> Iterator[Any]:
    """The caller's client of dask; else one on this machine, or of $DASK_SCHEDULER_ADDRESS."""
    import dask
    from distributed import Client, get_client

    try:
        known = get_client()
    except ValueError:
        known = None
    if known is not None:
        yield known
        return
    once = dask.config.set({"distributed.scheduler.allowed-failures": 0})
    with once, Client(n_workers=jobs, threads_per_worker=1, dashboard_address=None) as client:  # type: ignore[no-untyped-call]
        yield client


@contextmanager
def _dask(jobs: int) -> Iterator[Identify]:
    from distributed.scheduler import KilledWorker

    def one(future: Any) -> Fitted | Exception | None:
        try:
            found: Fitted | Exception = future.result()
        except KilledWorker:
            return None
        except Exception as error:  # noqa: BLE001 (what became of its result; the others have theirs)
            return _explained(error)
        return found

    with _client(jobs) as client:
        yield lambda orders: [one(future) for future in client.map(tried, orders, pure=False)]


@contextmanager
def _joblib(backend: str, jobs: int) -> Iterator[Identify]:
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky import get_reusable_executor

    from trajectories.search.workers import of_this_process

    ends_with_us = of_this_process() if backend == "loky" else {}

    def identified(orders: Sequence[AnalysisOrder]) -> list[Fitted | Exception | None]:
        found: list[Fitted | Exception | None] = []
        with parallel_config(backend=backend, n_jobs=jobs, **ends_with_us), suppress(BrokenExecutor):
            # One after the other as they are done: a death takes along what is still to come, nothing else.
            found.extend(Parallel(return_as="generator")(delayed(tried)(order) for order in orders))
        return [*found, *[None] * (len(orders) - len(found))]

    try:
        yield identified
    finally:
        if backend == "loky":
            get_reusable_executor().shutdown(wait=True)  # else its processes outlive the check


def analyse_all(orders: Sequence[AnalysisOrder], backend: str, jobs: int) -> list[Fitted | Exception]:
    """Identify several recordings at once.

    Args:
        orders: one per arm.
        backend: of joblib: ``loky`` (processes), ``sequential``, ``dask`` (the caller's client, else that of
            $DASK_SCHEDULER_ADDRESS, else a cluster on this machine), or one that the caller has registered.
        jobs: processes.

    Returns:
        for each its model, or the error that a user can understand.

    Raises:
        CheckError: there is no such backend.
    """
    require_backend(backend)
    if backend == "sequential" or len(orders) < 2:
        return [tried(order) for order in orders]
    with _dask(jobs) if backend == "dask" else _joblib(backend, jobs) as identified:
        found = identified(orders)
        if any(one is None for one in found):
            log.warning("a process of --backend %s has died; what it left is done one by one", backend)
        return [
            one or identified((order,))[0] or CheckError(_died(order))
            for order, one in zip(orders, found, strict=True)
        ]


def _died(order: AnalysisOrder) -> str:
    return (
        f"{order.capture}: the process that identified it has died, twice (no memory left? `dmesg` says so);"
        " --jobs 1 needs less, and armhil identify does it by itself"
    )
