"""The pages."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files
from typing import Annotated, Any
from urllib.parse import parse_qs

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.requests import ClientDisconnect

from daq.catalogue import arms, baselines, checks, findings, models, overview, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.overview import ArmNow
from daq.catalogue.values import Arm, Baseline, CheckRecord, Course, Run
from daq.check.errors import CheckError
from daq.check.fleet import FleetFileError, fleet_words, read_fleet
from daq.check.reported import view_of
from daq.report.check_view import KINDS, WORDS, CheckView
from daq.report.pictures import icon
from daq.service.api import Label, Number, arm_of, run_of
from daq.service.guard import COOKIE, Guesses, is_read_token
from daq.service.page_templates import page_templates
from daq.service.reference import routes_of, shared_answers
from daq.service.run_figures import curves_of, gates_of
from daq.service.settings import Service
from daq.service.trends import ENOUGH, trend_of
from daq.text.numbers import mixed_unit, percent, significant, with_sigma
from ident.effects.entry import found_words
from robots.standard import EITHER_UNIT

_MARKS = {"ok": "✓ fine", "warning": "⚠ warning", "failed": "✕ failed", "unknown": "? not measurable"}
_STATIC = {
    "service.css": "text/css",
    "report.css": "text/css",
    "service.js": "text/javascript",
    "plots.js": "text/javascript",
}
_OF_REPORTS = ("report.css", "plots.js")
_MONITORING = {"alerts.yml": "text/yaml", "prometheus.yml": "text/yaml", "grafana.json": "application/json"}
_DAY = 86400

Page = Callable[..., HTMLResponse]
"""Fills a template: its name, a status, and what it shows."""


@dataclass(frozen=True)
class ArmCard:
    """One arm at a glance."""

    arm: Arm
    kind: str
    word: str
    icon: Any
    sentence: str
    checked: str
    baseline: str
    run: Run | None
    unfinished: Run | None
    """The newest check, where it ended without a verdict, so that the verdict shown is an older one's."""


def page_routes(service: Service, catalogue: Catalogue) -> APIRouter:
    """All pages and the files that they need."""
    router = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    environment = page_templates()

    def page(name: str, status: int = 200, **content: Any) -> HTMLResponse:
        template = environment.get_template(f"service/{name}.html.j2")
        common = {"drive": service.drive_token is not None, "locked": service.read_token is not None}
        return HTMLResponse(template.render(**common, **content), status)

    _overview(router, service, catalogue, page)
    _one_run(router, catalogue, page)
    _entrance(router, service, page)
    return router


def _overview(router: APIRouter, service: Service, catalogue: Catalogue, page: Page) -> None:
    @router.get("/")
    def every_arm() -> HTMLResponse:
        runs.settle_abandoned(catalogue)
        fleet, problem = _fleet(service)
        cards = [_card(one) for one in overview.every(catalogue)]
        return page("arms", cards=cards, fleet=fleet, fleet_problem=problem)

    @router.get("/docs")
    def docs(request: Request) -> HTMLResponse:
        routes = routes_of(request.app.openapi(), str(request.base_url))
        return page("docs", routes=routes, shared=shared_answers(routes))

    @router.get("/runs")
    def every_run(arm: Annotated[str, Query(max_length=80)] = "") -> HTMLResponse:
        runs.settle_abandoned(catalogue)
        known = [one.label for one in arms.every(catalogue)]
        chosen = arm if arm in known else ""
        found = runs.every(catalogue, arm=chosen or None, limit=200)
        verdicts = checks.verdicts_of(catalogue, [run.id for run in found])
        return page("runs", runs=found, arms=known, chosen=chosen, verdicts=verdicts, marks=_MARKS)

    @router.get("/arms/{label}")
    def one_arm(label: Label, parameter: Annotated[str, Query(max_length=80)] = "") -> HTMLResponse:
        arm = arm_of(catalogue, label)
        (one,) = overview.every(catalogue, arm.label, (("comparison", "parameters"),))
        baseline = one.baseline
        accepted = None if baseline is None else baseline.model_id
        by_name = {course.name: course for course in models.courses(catalogue, arm.id)}
        chosen = parameter if parameter in by_name else _first_choice(by_name, one.check)
        clean = frozenset[int]() if baseline is None else checks.clean_models(catalogue, baseline)
        return page(
            "arm",
            card=_card(one),
            baselines=baselines.of_arm(catalogue, arm.id),
            checks=checks.listed(catalogue, arm.id, limit=20),
            marks=_MARKS,
            trends=[trend_of(course, accepted, clean, small=True) for course in by_name.values()],
            chosen=trend_of(by_name[chosen], accepted, clean) if chosen else None,
            enough=ENOUGH,
        )


def _one_run(router: APIRouter, catalogue: Catalogue, page: Page) -> None:
    @router.get("/runs/{number}")
    def one_run(number: Number) -> HTMLResponse:
        run = run_of(catalogue, number)
        of_run = models.of_run(catalogue, run.id)
        verdicts = checks.of_run(catalogue, run.id)
        judged = verdicts[-1].model_id if verdicts else None  # a search keeps another model after it
        model = next((one for one in of_run if one.id == judged), of_run[-1] if of_run else None)
        return page(
            "run",
            run=run,
            model=model,
            gates=() if model is None else gates_of(model),
            curves=curves_of(run, model),
            rows=() if model is None else [_row(p) for p in model.parameters],
            findings=[
                (f, significant(f.gap_before), significant(f.gap_after))
                for f in findings.of_run(catalogue, run.id)
            ],
            torque_unit=EITHER_UNIT if model is None else mixed_unit(model.torque_units),
            check=_verdict_view(verdicts, catalogue),
            has_report=any(one.report for one in of_run),
            found="" if model is None else found_words(model.found),
            error="" if model is None else percent(model.relative_error_percent),
        )

    @router.get("/runs/{number}/live")
    def live(number: Number) -> HTMLResponse:
        return page("live", run=run_of(catalogue, number))


def _entrance(router: APIRouter, service: Service, page: Page) -> None:
    @router.get("/login")
    def ask(after: Annotated[str, Query(max_length=200)] = "/") -> HTMLResponse:
        return page("login", after=_inside(after), wrong=False)

    guesses = Guesses()

    @router.post("/login")
    async def enter(request: Request) -> Response:
        try:
            form = parse_qs((await request.body()).decode("utf-8", "replace"))
        except ClientDisconnect:  # gone or cut before it had said all
            return Response(status_code=400)
        after = _inside(form.get("after", ["/"])[0])
        given = form.get("token", [""])[0]
        host = request.client.host if request.client is not None else ""
        if (wait := guesses.wait(host)) > 0:
            answer: Response = page("login", 429, after=after, wrong=True)
            answer.headers["Retry-After"] = str(wait)
            return answer
        if not is_read_token(given, service):
            guesses.wrong(host)
            return page("login", 401, after=after, wrong=True)
        answer = RedirectResponse(after, 303)
        answer.set_cookie(
            COOKIE,
            given,
            max_age=30 * _DAY,
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )
        return answer

    @router.get("/static/{name}")
    def static(name: str) -> Response:
        if name not in _STATIC:
            return Response(status_code=404)
        place = files("daq").joinpath("templates", *(() if name in _OF_REPORTS else ("service",)), name)
        return Response(
            place.read_bytes(), media_type=_STATIC[name], headers={"Cache-Control": "max-age=300"}
        )

    @router.get("/monitoring/{name}")
    def monitoring(name: str) -> Response:
        """Files for Prometheus and Grafana, to be fetched by whoever sets them up."""
        if name not in _MONITORING:
            return Response(status_code=404)
        place = files("daq").joinpath("templates", "monitoring", name)
        return Response(place.read_bytes(), media_type=_MONITORING[name])


def _inside(path: str) -> str:
    """A path of this service: nobody is sent elsewhere."""
    return path if path.startswith("/") and not path.startswith(("//", "/\\")) and "\\" not in path else "/"


def _card(one: ArmNow) -> ArmCard:
    last = one.check
    verdict = "unknown" if last is None else last.verdict
    return ArmCard(
        one.arm,
        KINDS[verdict],
        "never checked" if last is None else WORDS[verdict],
        icon(KINDS[verdict]),  # type: ignore[arg-type]
        "no check has been made" if last is None else last.sentence,
        "" if last is None else f"{last.created:%Y-%m-%d %H:%M} UTC, {_age(last.created)}",
        _baseline_words(one.baseline),
        one.run,
        one.unfinished,
    )


def _fleet(service: Service) -> tuple[tuple[str, ...], str]:
    """The arms that may be driven, in words, or why there are none."""
    if service.drive_token is None:
        return (), ""
    try:
        listed = read_fleet(service.fleet).arm
    except (FleetFileError, CheckError) as error:
        return (), str(error)
    return tuple(fleet_words(arm) for arm in listed), ""


def _age(then: datetime) -> str:
    hours = (datetime.now(tz=UTC) - then).total_seconds() / 3600
    if hours < 1:
        return "less than an hour ago"
    if hours < 48:
        return f"{hours:.0f} h ago"
    return f"{hours / 24:.0f} days ago"


def _baseline_words(baseline: Baseline | None) -> str:
    if baseline is None:
        return "none"
    doubt = " – SUSPECT" if baseline.state == "suspect" else ""
    return f"run {baseline.run_id}, accepted {_age(baseline.accepted)} by {baseline.events[0].author}{doubt}"


def _row(parameter: Any) -> tuple[str, str, str, str, str, str]:
    value, sigma = with_sigma(parameter.value, parameter.sigma)[:2]
    share = 100 * parameter.sigma / abs(parameter.value) if parameter.value else float("inf")
    return parameter.name, value, sigma, percent(share), parameter.unit, parameter.expression


def _verdict_view(found: Sequence[CheckRecord], catalogue: Catalogue) -> CheckView | None:
    if not found:
        return None
    last = found[-1]
    if last.baseline_id is None:
        return view_of(last, None)
    with catalogue.reading() as connection:
        return view_of(last, baselines.get_in(connection, last.baseline_id))


def _first_choice(by_name: Mapping[str, Course], last: CheckRecord | None) -> str:
    """What moved most in the last check; where nothing did, what lies farthest from its first value, in σ."""
    moved = [] if last is None else last.details["comparison"]["parameters"]
    for parameter in moved if isinstance(moved, list) else ():
        if isinstance(parameter, dict) and parameter.get("name") in by_name:
            return str(parameter["name"])
    return max(by_name, key=lambda name: _moved(by_name[name]), default="")


def _moved(course: Course) -> float:
    """|last − first| over the σ of that difference; 0 where there is no σ."""
    sigma = math.hypot(course.sigmas[0], course.sigmas[-1])
    return float(abs(course.values[-1] - course.values[0])) / sigma if sigma > 0 else 0.0
