"""A service that really listens, for the length of a block."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.connections import listening, server_config
from daq.service.settings import Service


@contextmanager
def running(service: Service, catalogue: Catalogue, folder: Path) -> Iterator[int]:
    """Serve on a free port of this machine; gives the port."""
    app = create_app(service, catalogue, folder)
    server = uvicorn.Server(server_config(app))
    socket = listening("127.0.0.1", 0)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [socket]}, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.02)
    try:
        yield int(socket.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join(30)
        socket.close()
