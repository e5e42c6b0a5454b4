"""The heavy part of a check, from a recording to a model: for any process that sees the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import robots
from daq.importing.load import loaded_capture
from daq.recording.reader import read_capture
from ident import Fitted, identify


@dataclass(frozen=True)
class AnalysisOrder:
    """What to identify.

    Attributes:
        source: name or path of the arm.
        capture: the recording.
        method: of the baseline, ``ls`` or ``iv``; what the revised test recommends where None.
    """

    source: str
    capture: Path
    method: str | None = None


def analyse(order: AnalysisOrder) -> Fitted:
    """Identify; the same order gives the same numbers bit for bit wherever it is done.

    Raises:
        CaptureError, RobotFileError, IdentificationError: one line each.
    """
    robot = robots.load(order.source)
    loaded = loaded_capture(read_capture(order.capture), robot)
    fitted = identify(robot, loaded.recordings)
    result = replace(fitted.result, warnings=(*loaded.warnings, *fitted.result.warnings))
    if any(estimate.method == order.method for estimate in result.estimates):
        # Tonight's estimate is compared with one of its own kind; the verdict of the test stays what it is.
        result = replace(result, method=order.method)  # type: ignore[arg-type]
    return replace(fitted, result=result)


def analyse_all(orders: Sequence[AnalysisOrder], backend: str, jobs: int) -> list[Fitted]:
    """Identify several recordings at once.

    Args:
        orders: one per arm.
        backend: of joblib: ``loky`` (processes), ``sequential``, or one that the caller has registered, e.g.
            ``dask`` under an open client.
        jobs: processes.
    """
    if backend == "sequential" or len(orders) < 2:
        return [analyse(order) for order in orders]
    from joblib import Parallel, delayed, parallel_config

    with parallel_config(backend=backend, n_jobs=jobs):
        found = list(Parallel()(delayed(analyse)(order) for order in orders))
    if backend == "loky":
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor().shutdown(wait=True)  # else its processes outlive the check
    return found
