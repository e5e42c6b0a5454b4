"""What all tests share: one thread each, a bus of their own, the recorded data, a check for leftovers."""

from __future__ import annotations

import os

# Many small solves run faster on one thread, and the tests run side by side. Before anything imports numpy.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import gc
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from uuid import uuid4

import hypothesis
import pytest

from drivers import Channel
from tests.processes import processes_marked

ROOT = Path(__file__).resolve().parent.parent

# A shell that starts the tests in the background has them ignore Ctrl-C, nohup the hang-up, and the commands
# under test would inherit that. A handler is not inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda number, frame: None)

# The same examples in every run, and no clock: how fast the machine is proves nothing. To look further:
# ./armhil test --hypothesis-profile=explore
hypothesis.settings.register_profile("armhil", deadline=None, derandomize=True)
hypothesis.settings.register_profile("explore", deadline=None, max_examples=2000)
hypothesis.settings.load_profile("armhil")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Workers on a fresh clone would each compile the same simulations, a minute of a processor."""
    if session.config.getoption("numprocesses", default=None) and not hasattr(session.config, "workerinput"):
        words = [sys.executable, "-m", "tests.compile_first"]
        for compiling in [subprocess.Popen([*words, arm], cwd=ROOT) for arm in ("emps", "tx40")]:
            compiling.wait()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests that ask for more time than others begin first: none of them keeps one worker busy at the end."""

    def asked(item: pytest.Item) -> float:
        mark = item.get_closest_marker("timeout")
        return float(mark.args[0]) if mark is not None else 0.0

    items.sort(key=asked, reverse=True)


def pytest_collection_finish() -> None:
    """What was collected stays: each search gives memory back, and would look through millions of objects."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the clone."""
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The directory of published recordings: $ARMHIL_DATA, or shared/data beside the clone."""
    named = os.environ.get("ARMHIL_DATA")
    directory = Path(named) if named else ROOT.parent / "shared" / "data"
    if not directory.is_dir():
        pytest.skip(f"no published recordings in {directory}; name their directory in ARMHIL_DATA")
    return directory


@pytest.fixture(autouse=True)
def own_catalogue(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """No test and no process that it starts touches the user's catalogue; it has one of its own."""
    path = tmp_path_factory.mktemp("catalogue") / "catalogue.db"
    monkeypatch.setenv("ARMHIL_CATALOGUE", str(path))
    return path


@pytest.fixture(autouse=True)
def own_state(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nor does it find locks and lock-outs of the machine; it has a state folder of its own."""
    path = tmp_path_factory.mktemp("state")
    monkeypatch.setenv("ARMHIL_STATE", str(path))
    return path


_CHANNELS = count()


@pytest.fixture
def new_channel(worker_id: str) -> Callable[[], Channel]:
    """Makes multicast channels: the group by worker and number, the port by run of the whole suite."""
    worker = int(worker_id.removeprefix("gw")) + 1 if worker_id.startswith("gw") else 0
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid()))
    port = 20000 + zlib.crc32(run.encode()) % 12000  # below the ports that systems hand out on their own

    def make() -> Channel:
        return Channel("udp_multicast", f"239.74.{worker % 256}.{1 + next(_CHANNELS) % 254}:{port}")

    return make


@pytest.fixture
def channel(new_channel: Callable[[], Channel]) -> Channel:
    """A multicast channel that no other test, worker or run on this machine uses."""
    return new_channel()


@pytest.fixture
def no_leftovers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fails a test after which a process is left that it started, orphans included."""
    if not Path("/proc/self/environ").exists():
        pytest.skip("looking for processes left behind needs /proc")
    mark = f"ARMHIL_TEST={uuid4().hex}"
    monkeypatch.setenv(*mark.split("="))
    yield
    deadline = time.monotonic() + 5.0
    while (left := _processes_marked(mark)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not left, f"processes left behind: {left}"


def _processes_marked(mark: str) -> list[str]:
    """Command lines of the other processes that inherited the mark.

    Python's own resource tracker is none of them: it lives as long as the interpreter that started it.
    """
    return [
        f"{number}: {command}"
        for number, command in processes_marked(mark)
        if number != str(os.getpid()) and "resource_tracker" not in command
    ]
