"""A service with a filled catalogue."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service
from tests.daq.service.filled import fill

READ, DRIVE = "read-token-of-the-test", "drive-token-of-the-test"
Clients = Callable[[Service], TestClient]


@pytest.fixture
def filled(tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue() as catalogue:
        fill(catalogue, tmp_path)
        yield catalogue


@pytest.fixture
def client_of(filled: Catalogue, tmp_path: Path) -> Clients:
    def make(service: Service) -> TestClient:
        app = create_app(service, filled, tmp_path)
        return TestClient(app, base_url="http://localhost", raise_server_exceptions=False)

    return make


@pytest.fixture
def client(client_of: Clients) -> TestClient:
    return client_of(Service())
