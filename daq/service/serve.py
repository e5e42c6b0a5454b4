"""Run the service until it is told to end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import uvicorn

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.connections import listening, server_config
from daq.service.settings import Service


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
