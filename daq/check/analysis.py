"""The heavy part of a check, from a recording to a model: for any process that sees the file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import robots
from daq.check.errors import CheckError
from daq.importing.captures import loaded_capture
from daq.recording.reader import read_capture
from ident import Fitted, Options, identify
from ident.identification.found_effects import FoundModel
from robots.errors import UserError


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
    """As :func:`analyse`; an error that a user can understand is given back, so that others go on."""
    try:
        return analyse(order)
    except (UserError, OSError) as error:
        return error


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
def _cluster(backend: str, jobs: int) -> Iterator[None]:
    """A client of dask where one is needed and the caller has none."""
    if backend != "dask":
        yield
        return
    from distributed import Client, get_client

    try:
        known = get_client()
    except ValueError:
        known = None
    if known is not None:
        yield
        return
    with Client(n_workers=jobs, threads_per_worker=1, dashboard_address=None):  # type: ignore[no-untyped-call]
        yield


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
    from joblib import Parallel, delayed, parallel_config

    with _cluster(backend, jobs), parallel_config(backend=backend, n_jobs=jobs):
        found = list(Parallel()(delayed(tried)(order) for order in orders))
    if backend == "loky":
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor().shutdown(wait=True)  # else its processes outlive the check
    return found
