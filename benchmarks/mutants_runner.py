"""Runs tests on a copy of the clone, one forked process each: libraries are imported once, modules each time.

Started in the copy it reads a JSON list of pytest's arguments a line, and answers with exit codes.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

LIMIT = 120.0
"""s; tests that take longer on a mutant have noticed it."""

_LIBRARIES = (
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
    """The process that forks; a context."""

    __test__ = False

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
        return self._process.stdout.readline().strip() == "0"


def _serve() -> None:
    for name in _LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        print(_forked(json.loads(line)), flush=True)


def _forked(tests: list[str]) -> int:
    child = os.fork()
    if child == 0:
        os.setsid()
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        code = 1
        try:
            code = int(pytest.main(["-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]))
        finally:
            os._exit(code)
    handle = os.pidfd_open(child)
    ended = select.select([handle], [], [], LIMIT)[0]
    os.close(handle)
    if not ended:
        os.killpg(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status)


if __name__ == "__main__":
    _serve()
