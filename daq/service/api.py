"""The REST interface: everything that the pages show, as JSON; live runs; checks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Query, Request
from fastapi import Path as PathParameter
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, Response, StreamingResponse

from daq.catalogue import arms, checks, findings, models, overview, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.overview import ArmNow
from daq.catalogue.values import Arm, CatalogueError, CheckRecord, Model, Run
from daq.check.baseline import baseline_json
from daq.check.errors import CheckError
from daq.check.fleet import FleetFileError
from daq.report.traces import POLICY
from daq.service.driving import Driving, NotDrivenError
from daq.service.guard import may_drive
from daq.service.live import Broadcaster, EventStream, TooManyError
from daq.service.metrics import metrics_text
from daq.service.settings import Service
from daq.session.spool import spool_path
from daq.text.numbers import json_value
from daq.text.parameter_rows import parameter_rows

LARGEST = 2**31 - 1
Number = Annotated[int, PathParameter(ge=1, le=LARGEST)]
Label = Annotated[str, PathParameter(pattern=r"^[A-Za-z0-9._-]{1,80}$")]
Limit = Annotated[int, Query(ge=1, le=1000)]
_REFUSALS: dict[int | str, dict[str, Any]] = {
    401: {"description": "a token is needed"},
    403: {"description": "the token does not allow it, or driving is off"},
    404: {"description": "there is none"},
    413: {"description": "the body is too large"},
    421: {"description": "another name in the Host header"},
    503: {
        "description": "the database does not answer, or too many look on; Retry-After says when to ask again"
    },
}


def api_routes(
    service: Service, catalogue: Catalogue, broadcaster: Broadcaster, driving: Driving
) -> APIRouter:
    """All routes below /api, and /metrics."""
    router = APIRouter(responses=_REFUSALS)
    _reading(router, catalogue)
    _live(router, catalogue, broadcaster)
    _driving(router, service, driving)
    return router


def _reading(router: APIRouter, catalogue: Catalogue) -> None:
    @router.get("/api/arms", summary="All arms with the last verdict, without its details, and the baseline")
    def every_arm() -> list[dict[str, Any]]:
        return [arm_json(one) for one in overview.every(catalogue)]

    @router.get("/api/arms/{label}", summary="One arm")
    def one_arm(label: Label) -> dict[str, Any]:
        (one,) = overview.every(catalogue, arm_of(catalogue, label).label, None)
        return arm_json(one)

    @router.get("/api/arms/{label}/checks", summary="Verdicts on an arm, newest first")
    def checks_of(label: Label, limit: Limit = 100) -> list[dict[str, Any]]:
        arm = arm_of(catalogue, label)
        return [check_json(record) for record in checks.of_arm(catalogue, arm.id, limit=limit)]

    @router.get("/api/arms/{label}/trend/{parameter}", summary="Course of one base parameter")
    def trend(label: Label, parameter: Label) -> list[dict[str, Any]]:
        found = models.courses(catalogue, arm_of(catalogue, label).id, parameter)
        return [
            {
                "run": run,
                "at": at.isoformat(),
                "value": json_value(value),
                "sigma": json_value(sigma),
                "unit": course.unit,
            }
            for course in found
            for run, at, value, sigma in zip(
                course.runs.tolist(), course.at, course.values.tolist(), course.sigmas.tolist(), strict=True
            )
        ]

    @router.get("/api/runs", summary="Runs, newest first")
    def every_run(
        arm: Annotated[str | None, Query(pattern=r"^[A-Za-z0-9._-]{1,80}$")] = None, limit: Limit = 100
    ) -> list[dict[str, Any]]:
        return [run_json(run) for run in runs.every(catalogue, arm=arm, limit=limit)]

    @router.get("/api/runs/{number}", summary="One run with its models, findings and verdicts")
    def one_run(number: Number) -> dict[str, Any]:
        run = run_of(catalogue, number)
        return {
            **run_json(run),
            "models": [model_json(model) for model in models.of_run(catalogue, run.id)],
            "findings": [
                {
                    "effect": f.effect,
                    "joints": list(f.joints),
                    "sentence": f.sentence,
                    "p_value": json_value(f.p_value),
                }
                for f in findings.of_run(catalogue, run.id)
            ],
            "checks": [check_json(record) for record in checks.of_run(catalogue, run.id)],
        }

    @router.get(
        "/api/runs/{number}/report", summary="The report of a run's newest model", response_class=FileResponse
    )
    def report(number: Number) -> FileResponse:
        found = [m.report for m in models.of_run(catalogue, run_of(catalogue, number).id) if m.report]
        path = Path(found[-1]) if found else None
        if path is None or path.suffix != ".html" or not path.is_file():
            raise HTTPException(404, f"run {number} has no report, or it was deleted")
        # A page of its own: it may style and run itself, and reaches nothing here.
        policy = f"sandbox allow-scripts; {POLICY}"
        return FileResponse(
            path,
            media_type="text/html",
            filename=f"armhil-run-{number}.html",
            content_disposition_type="inline",
            headers={"Content-Security-Policy": policy},
        )

    @router.get("/metrics", summary="For Prometheus", response_class=Response)
    def metrics() -> Response:
        return Response(metrics_text(catalogue), media_type="text/plain; version=0.0.4; charset=utf-8")


def _live(router: APIRouter, catalogue: Catalogue, broadcaster: Broadcaster) -> None:
    @router.get(
        "/api/runs/{number}/live",
        summary="Server-sent events of a run under way",
        response_class=StreamingResponse,
    )
    async def live(number: Number) -> EventStream:
        try:
            broadcaster.require_room()  # who has none costs no query
            # Not in this thread: while a database keeps it waiting, nobody else is served, or cut.
            run = await run_in_threadpool(run_of, catalogue, number)
            if run.capture is None:
                raise HTTPException(404, f"run {number} records nothing")

            def is_over() -> bool:
                return runs.get(catalogue, number).state != "running"

            return EventStream(broadcaster.events(spool_path(Path(run.capture)), is_over))
        except TooManyError as error:
            raise HTTPException(503, str(error), {"Retry-After": "10"}) from None


def _driving(router: APIRouter, service: Service, driving: Driving) -> None:
    def require(request: Request) -> None:
        if service.drive_token is None:
            raise HTTPException(403, "driving is off; drive = true in service.toml turns it on")
        if not may_drive(request.headers, service):
            raise HTTPException(403, "driving needs the token to drive in the Authorization header")

    @router.get("/api/jobs", summary="Checks that were started here")
    def jobs() -> list[dict[str, Any]]:
        return [job.as_dict() for job in driving.every()]

    @router.post(
        "/api/fleet/{place}/check",
        status_code=202,
        summary="Check an arm of the fleet",
        responses={409: {"description": "it cannot be started"}},
    )
    def start(place: Number, request: Request) -> dict[str, Any]:
        require(request)
        try:
            return driving.start(place).as_dict()
        except (NotDrivenError, FleetFileError, CheckError) as error:
            raise HTTPException(409, str(error)) from None

    @router.post(
        "/api/jobs/{number}/stop",
        status_code=202,
        summary="Bring a check to rest",
        responses={409: {"description": "it is not under way"}},
    )
    def stop(number: Number, request: Request) -> dict[str, Any]:
        require(request)
        try:
            return driving.stop(number).as_dict()
        except NotDrivenError as error:
            raise HTTPException(409, str(error)) from None


def arm_of(catalogue: Catalogue, label: str) -> Arm:
    """The arm of a label, or 404."""
    try:
        return arms.by_label(catalogue, label)
    except CatalogueError as error:
        if error.__cause__ is not None:  # the database does not answer: nobody knows
            raise
        raise HTTPException(404, str(error)) from None


def run_of(catalogue: Catalogue, number: int) -> Run:
    """The run of a number, or 404."""
    try:
        return runs.get(catalogue, number)
    except CatalogueError as error:
        if error.__cause__ is not None:  # the database does not answer: nobody knows
            raise
        raise HTTPException(404, str(error)) from None


def arm_json(one: ArmNow) -> dict[str, Any]:
    """One arm with what is newest of it."""
    return {
        "label": one.arm.label,
        "name": one.arm.name,
        "simulated": one.arm.simulated,
        "serials": list(one.arm.serials),
        "last_check": None if one.check is None else check_json(one.check),
        "baseline": None if one.baseline is None else baseline_json(one.baseline),
    }


def run_json(run: Run) -> dict[str, Any]:
    """One run; paths stay inside."""
    return {
        "number": run.id,
        "arm": run.arm,
        "kind": run.kind,
        "stage": run.stage,
        "started": run.started.isoformat(),
        "finished": None if run.finished is None else run.finished.isoformat(),
        "state": run.state,
        "outcome": run.outcome,
        "reason": run.reason,
        "trajectory": run.trajectory,
        "note": run.note,
        "who": run.who,
    }


def model_json(model: Model) -> dict[str, Any]:
    """One model with its parameters."""
    return {
        "number": model.id,
        "method": model.method,
        "verdict": model.verdict,
        "relative_error_percent": json_value(model.relative_error_percent),
        "effects": list(model.effects),
        "found": [entry.as_json() for entry in model.found],
        "parameters": parameter_rows(model.parameters),
        "gates": json_value(dict(model.gates)),
    }


def check_json(record: CheckRecord) -> dict[str, Any]:
    """One verdict."""
    return {
        "number": record.id,
        "run": record.run_id,
        "at": record.created.isoformat(),
        "verdict": record.verdict,
        "sentence": record.sentence,
        "details": json_value(dict(record.details)),
    }
