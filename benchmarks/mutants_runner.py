"""Runs tests on a copy of the clone, one forked process each: libraries are imported once, modules each time.

Started in the copy it reads a JSON list of pytest's arguments a line, and answers with a JSON list of the
exit code and the test that failed.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import resource
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

LIMIT = 120
"""s of processor time; tests that take longer on a mutant have noticed it."""

_WAITING = 600.0
"""s; the same where they wait for something."""

_LIBRARIES = (
    "numba",
    "numpy",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "pydantic",
    "linearmodels.iv",
    "statsmodels.api",
    "pinocchio",
    "can",
    "canopen",
    "sqlalchemy",
)


class Tests:
    """The process that forks; a context.

    Attributes:
        noticed: the test that failed last, or that the time was up.
    """

    __test__ = False
    noticed = ""

    def __init__(self, folder: Path, data: Path) -> None:
        environment = {
            **os.environ,
            "PYTHONPATH": str(folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        environment.setdefault("ARMHIL_DATA", str(data))
        command = [sys.executable, "-P", "-m", "benchmarks.mutants_runner"]
        self._process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def __enter__(self) -> Tests:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def pass_(self, tests: tuple[str, ...]) -> bool:
        """Whether these arguments of pytest end with all tests passed, within the limit."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(tests) + "\n")
        self._process.stdin.flush()
        code, self.noticed = json.loads(self._process.stdout.readline())
        return bool(code == 0)


def _serve() -> None:
    for name in _LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        print(json.dumps(_forked(json.loads(line))), flush=True)


class _First:
    """A plugin of pytest that tells which test failed."""

    def __init__(self, pipe: int) -> None:
        self._pipe = pipe

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            os.write(self._pipe, f"{report.nodeid}\n".encode())


def _forked(tests: list[str]) -> tuple[int, str]:
    told, pipe = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 5))
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        code = 1
        try:
            options = ["-x", "-q", "-n", "0", "-p", "no:cacheprovider"]
            code = int(pytest.main([*options, *tests], plugins=[_First(pipe)]))
        finally:
            os._exit(code)
    os.close(pipe)
    handle = os.pidfd_open(child)
    ended = select.select([handle], [], [], _WAITING)[0]
    os.close(handle)
    if not ended:
        os.killpg(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    with os.fdopen(told, encoding="utf-8") as names:
        first = names.readline().strip()
    code = os.waitstatus_to_exitcode(status)
    return code, first or ("an import or the time" if code else "")


if __name__ == "__main__":
    _serve()
