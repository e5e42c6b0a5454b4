"""``armhil check``: one arm from preflight to verdict, or a fleet on buses of their own."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from daq.catalogue import models
from daq.check.analysis import AnalysisOrder, analyse, analyse_all, attempted, require_backend
from daq.check.judged import judge_check
from daq.check.recorded import Recorded, record_check
from daq.check.request import CheckRequest, CheckResult
from daq.keeping.accepted_effects import effects_of
from daq.session.recorded_runs import Conducting, unconducted
from daq.session.streaming import Nobody, Watcher
from daq.text.progress import Silent, Steps
from ident import Fitted


def run_check(
    request: CheckRequest,
    steps: Steps,
    watcher: Watcher | None = None,
    conducting: Conducting = unconducted,
) -> CheckResult:
    """Preflight, drive, record, identify, test, compare, verdict.

    Raises:
        ArmMismatch, LeaseHeld: the arm is another one, or somebody else drives it.
        CheckError, BusError, DriveError, CaptureError, PlanError, SessionError, IdentificationError,
        CatalogueError: one line each.
        RunInterrupted, RunFailed: the run did not come to its end.
    """
    recorded = record_check(request, steps, watcher or Nobody(), conducting)
    with steps.step("Identify and test"):
        fitted = analyse(_order(request, recorded))
    return judge_check(request, recorded, fitted, steps)


def run_fleet(
    requests: Sequence[CheckRequest], *, at_once: int = 1, backend: str = "loky", jobs: int = 2
) -> list[CheckResult | Exception]:
    """Check several arms; what goes wrong with one does not stop the others.

    Args:
        requests: of arms on separate buses.
        at_once: streams that run at the same time.
        backend, jobs: of joblib, for the identifications.

    Returns:
        for each request its result, or the error that a user can understand.

    Raises:
        CheckError: there is no such backend; nothing has moved.
    """
    require_backend(backend)
    with ThreadPoolExecutor(max_workers=at_once) as pool:
        recorded = list(pool.map(_recorded, requests))
    orders = [
        attempted(partial(_order, request, found)) if isinstance(found, Recorded) else found
        for request, found in zip(requests, recorded, strict=True)
    ]
    fitted = iter(analyse_all([one for one in orders if isinstance(one, AnalysisOrder)], backend, jobs))

    def outcome(request: CheckRequest, found: Recorded | Exception, order: object) -> CheckResult | Exception:
        if isinstance(order, Exception):
            return order
        assert isinstance(found, Recorded)
        return _judged(request, found, next(fitted))

    return [outcome(*one) for one in zip(requests, recorded, orders, strict=True)]


def _recorded(request: CheckRequest) -> Recorded | Exception:
    return attempted(partial(record_check, request, Silent(), Nobody(), unconducted))


def _judged(request: CheckRequest, recorded: Recorded, fitted: Fitted | Exception) -> CheckResult | Exception:
    if isinstance(fitted, Exception):
        return fitted
    return attempted(partial(judge_check, request, recorded, fitted, Silent()))


def _order(request: CheckRequest, recorded: Recorded) -> AnalysisOrder:
    baseline = recorded.compared_with(request.catalogue)
    if baseline is None:
        return AnalysisOrder(request.arm.source, recorded.capture)
    accepted = models.get(request.catalogue, baseline.model_id)
    return AnalysisOrder(request.arm.source, recorded.capture, accepted.method, effects_of(accepted))
