"""Schemathesis over the OpenAPI description: whatever is sent, the service never breaks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service
from tests.daq.service.filled import fill

TOKEN = "drive-token-of-the-test"


def _sender(codes: set[int]) -> Callable[[schemathesis.Case], None]:
    def send(case: schemathesis.Case) -> None:
        headers = {"Authorization": f"Bearer {TOKEN}", "Host": "localhost"}
        codes.add(case.call(headers=headers).status_code)

    return send


def test_whatever_is_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ARMHIL_FLEET", str(tmp_path / "none.toml"))
    seen: dict[str, set[int]] = {}
    with Catalogue() as catalogue:
        fill(catalogue, tmp_path, nights=3)
        app = create_app(Service(drive_token=TOKEN), catalogue, tmp_path)
        schema = schemathesis.openapi.from_asgi("/openapi.json", app, headers={"Host": "localhost"})
        for operation in (found.ok() for found in schema.get_all_operations()):
            codes = seen.setdefault(f"{operation.method.upper()} {operation.path}", set())

            settled = settings(
                max_examples=15, deadline=None, database=None, suppress_health_check=list(HealthCheck)
            )
            settled(given(operation.as_strategy())(_sender(codes)))()
    assert len(seen) == 12
    broken = {path: codes for path, codes in seen.items() if max(codes) >= 500}
    assert not broken
    assert 200 in seen["GET /api/arms"] and {404, 409} & seen["POST /api/jobs/{number}/stop"]
