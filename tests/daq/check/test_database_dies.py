"""PostgreSQL dies in the middle of a check: nothing is lost, nobody is told twice, the next check goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from daq.catalogue import baselines, checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError
from daq.check import check as check_module
from daq.check.analysis import AnalysisOrder, analyse
from daq.check.check import run_check
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.files.checksum import file_sha256
from daq.keeping.again import rerun
from daq.notify.notify import notify_of
from daq.notify.told import note_told
from daq.service.app import create_app
from daq.service.settings import Service
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from ident import Fitted
from robots import Robot
from tests.daq.catalogue.postgres import NoPostgres, Server, mortal_server
from tests.daq.check.offline_arms import record_offline, write_motion
from tests.daq.notify.test_sending import hook, settings_file

GONE = "format = 1\n[[drive_gain_error]]\ndrive = 1\nchange = -0.2\n"
Check = Callable[..., CheckResult]


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    """With the user's catalogue on it."""
    try:
        with mortal_server() as found:
            monkeypatch.setenv("ARMHIL_CATALOGUE", found.url.format("postgres"))
            yield found
    except NoPostgres as reason:
        pytest.skip(str(reason))


@pytest.fixture
def check(emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Check:
    """One night of the simulated axis after the other."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(GONE)

    def one(catalogue: Catalogue, lost: bool = False) -> CheckResult:
        folder = tmp_path / f"night{len(list(tmp_path.glob('night*')))}"
        folder.mkdir()
        hidden = scenario if lost else None
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
        return run_check(CheckRequest(order, folder, catalogue, motion), Silent())

    return one


def require_one_line(error: CatalogueError) -> None:
    text = str(error)
    assert text.startswith("catalogue postgresql+psycopg://") and "\n" not in text
    assert "start that server" in text, text


@pytest.mark.slow
def test_it_dies_while_a_recording_is_identified_and_before_and_after_somebody_is_told(
    check: Check, server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dying(order: AnalysisOrder) -> Fitted:
        server.die()
        return analyse(order)

    with hook(200, 200, 200) as told, Catalogue() as catalogue:
        url = f"http://127.0.0.1:{told.server_port}/x"
        settings = settings_file(tmp_path, f'attempts = 1\n[[webhook]]\nurl = "{url}"\n')
        page = TestClient(create_app(Service(), catalogue, tmp_path), base_url="http://localhost")

        def tell(result: CheckResult) -> bool:
            sender = notify_of(result, catalogue, settings)
            return sender is not None and sender.wait(240) == 0

        first = check(catalogue)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        monkeypatch.setattr(check_module, "analyse", dying)
        with pytest.raises(CatalogueError) as error:
            check(catalogue)
        monkeypatch.setattr(check_module, "analyse", analyse)
        require_one_line(error.value)
        for path in ("/", "/api/arms", "/runs/1", "/arms/emps-sim", "/metrics"):
            answer = page.get(path)
            assert (answer.status_code, answer.headers["Retry-After"]) == (503, "10"), path
        server.start()

        # The same catalogue object goes on, and the recording is there, whole, to be identified.
        assert page.get("/").status_code == 200
        lost = runs.every(catalogue, limit=1)[0]
        assert lost.id == 2 and lost.capture is not None and checks.of_run(catalogue, lost.id) == ()
        assert file_sha256(Path(lost.capture)) == lost.capture_sha256
        assert rerun(catalogue, lost.id, Silent()).result.fitted.result.trusted

        failed = check(catalogue, lost=True)
        assert failed.verdict is Verdict.FAILED and failed.previous == "unknown"
        server.die()
        assert not tell(failed) and told.seen == []  # type: ignore[attr-defined]
        server.start()
        again = check(catalogue, lost=True)
        assert tell(again), "what nobody was told of is told by the next"
        assert len(told.seen) == 1  # type: ignore[attr-defined]

        fine = check(catalogue)
        assert fine.verdict is Verdict.OK
        server.die()
        note_told(fine.check, settings)  # the sender has told, and then finds no database
        server.start()
        assert not tell(check(catalogue))
        assert checks.last_told(catalogue, runs.get(catalogue, fine.run).arm_id) == "ok"
        assert len(told.seen) == 1  # type: ignore[attr-defined]
        assert {run.state for run in runs.every(catalogue)} == {"finished"}
