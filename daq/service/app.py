"""The service: pages for people, a REST interface for programs, metrics for Prometheus."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from importlib.metadata import version
from pathlib import Path

import uvicorn
from anyio.to_thread import current_default_thread_limiter
from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse

from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError
from daq.service.api import api_routes
from daq.service.connections import listening, server_config
from daq.service.driving import Driving
from daq.service.guard import Guard
from daq.service.live import Broadcaster
from daq.service.pages import page_routes
from daq.service.settings import Service

log = logging.getLogger(__name__)

ANSWERING = 8
"""Threads that make answers. Python computes in one at a time, so more only wait and hold memory each.
Several, since one waits while its database does; an answer takes one connection to it at a time, so fewer
than a pool has (15; a test counts them) never wait for each other's."""


def create_app(service: Service, catalogue: Catalogue, folder: Path) -> FastAPI:
    """The application.

    Args:
        service: who may reach, read and drive.
        catalogue: what is shown.
        folder: that checks started over HTTP write below.
    """
    driving = Driving(service.fleet, folder)

    @asynccontextmanager
    async def lifetime(app: FastAPI) -> AsyncIterator[None]:
        current_default_thread_limiter().total_tokens = ANSWERING
        yield
        driving.close()

    app = FastAPI(
        title="armhil",
        version=version("armhil"),
        summary="Arms, runs, models and verdicts; live runs; checks.",
        lifespan=lifetime,
        docs_url=None,  # those pages load scripts from elsewhere
        redoc_url=None,
    )
    broadcaster = Broadcaster()
    app.include_router(api_routes(service, catalogue, broadcaster, driving))
    app.include_router(page_routes(service, catalogue))
    app.add_exception_handler(CatalogueError, _unavailable)
    app.add_middleware(Guard, service=service)
    return app


def _unavailable(request: Request, error: Exception) -> JSONResponse:
    """The database does not answer, or its file is damaged: for now, whoever asks."""
    log.warning("%s: %s", request.url.path, error)
    return JSONResponse({"detail": str(error)}, 503, {"Retry-After": "10"})


def serve(service: Service, folder: Path, tell: Callable[[str], None]) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        service: who may reach, read and drive.
        folder: that checks started over HTTP write below.
        tell: gets the address once.

    Raises:
        CatalogueError: the catalogue cannot be opened.
        ServiceError: the address is taken.
    """
    with Catalogue() as catalogue, listening(service.host, service.port) as socket:
        host, port = socket.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        tell(f"http://{shown}:{port}/")
        uvicorn.Server(server_config(create_app(service, catalogue, folder))).run(sockets=[socket])
