"""Run the service until it is told to end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import uvicorn

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service

_GRACE = 3
"""s that open connections are given at the end."""


def serve(service: Service, folder: Path, tell: Callable[[str], None]) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        service: who may reach, read and drive.
        folder: that checks started over HTTP write below.
        tell: gets the address once.

    Raises:
        CatalogueError: the catalogue cannot be opened.
        OSError: the address is taken.
    """
    with Catalogue() as catalogue:
        config = uvicorn.Config(
            create_app(service, catalogue, folder),
            host=service.host,
            port=service.port,
            log_level="warning",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=_GRACE,
            h11_max_incomplete_event_size=32_768,
        )
        socket = config.bind_socket()
        socket.listen(config.backlog)  # whoever reads the address may call at once
        host, port = socket.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        tell(f"http://{shown}:{port}/")
        uvicorn.Server(config).run(sockets=[socket])
