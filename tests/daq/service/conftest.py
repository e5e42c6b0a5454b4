"""A service with a filled catalogue."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service
from tests.daq.service.browser import Browser, browsing, chromium
from tests.daq.service.filled import fill
from tests.daq.service.serving import running

READ, DRIVE = "read-token-of-the-test", "drive-token-of-the-test"
Clients = Callable[[Service], TestClient]


@pytest.fixture(scope="session")
def filled_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Filled once: twelve nights are some sixty transactions."""
    folder = tmp_path_factory.mktemp("filled")
    with Catalogue(str(folder / "catalogue.db")) as catalogue:
        fill(catalogue, folder)
    return folder / "catalogue.db"


@pytest.fixture
def filled(filled_file: Path, own_catalogue: Path) -> Iterator[Catalogue]:
    """A copy for each test."""
    shutil.copyfile(filled_file, own_catalogue)
    with Catalogue() as catalogue:
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


@pytest.fixture
def page(filled: Catalogue, tmp_path: Path, no_leftovers: None) -> Iterator[Browser]:
    """A page of a service that may drive the arms of a fleet."""
    program = chromium()
    assert program is not None
    service = Service(drive_token=DRIVE, fleet=tmp_path / "fleet.toml")
    with (
        running(service, filled, tmp_path / "http") as port,
        browsing(program, tmp_path / "profile", f"http://127.0.0.1:{port}") as browser,
    ):
        yield browser
