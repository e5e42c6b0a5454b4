"""``armhil test``: pytest on the tests of a clone."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from robots.errors import UserError


class NoTests(UserError):
    """There are no tests to run here, or nothing to run them with; one line."""


def run_tests(start: Path, arguments: Sequence[str]) -> int:
    """Run pytest in the clone that this installation, or else the present folder, belongs to.

    What Python compiles is kept, also where the environment says not to: each worker and each process that a
    test starts would compile it all again.

    Args:
        start: the present folder.
        arguments: what follows ``armhil test``.

    Returns:
        pytest's exit code.

    Raises:
        NoTests: no clone, or no pytest.
    """
    root = _clone(start)
    if importlib.util.find_spec("pytest") is None:
        raise NoTests("pytest is not installed; ./armhil test in a clone installs it")
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    words = [sys.executable, "-m", "pytest", *pytest_arguments(root, arguments)]
    return subprocess.call(words, cwd=root, env=kept)


def pytest_arguments(root: Path, given: Sequence[str]) -> list[str]:
    """What pytest is called with: how many workers, and the tests that people wait for or the slow ones.

    Three workers keep two processors busy: a quarter of the time of a worker goes by in waiting for buses,
    clocks and processes. Whoever says how many, or wants a debugger, or names a test, decides that alone.

    Args:
        root: of the clone.
        given: options and tests of the user; ``--slow`` stands for the tests that are marked slow.
    """
    rest = [argument for argument in given if argument != "--slow"]
    chosen: list[str] = []
    if not any(
        argument.startswith(("-n", "--numprocesses")) or argument in _ONE_PROCESS for argument in rest
    ):
        chosen += ["-n", _WORKERS, "--dist", "worksteal"]
    if not any(argument.startswith(("-v", "-q", "--verbose")) for argument in rest):
        chosen += ["-q"]
    if "--slow" in given:
        chosen += ["-m", "slow"]
    elif not any(argument.startswith("-m") or _names_a_test(root, argument) for argument in rest):
        chosen += ["-m", "not slow"]
    return [*chosen, *rest]


_WORKERS = "3"
_ONE_PROCESS = {"--pdb", "--trace", "--version", "-V", "--help", "-h", "--co", "--collect-only"}


def _names_a_test(root: Path, argument: str) -> bool:
    path = (root / argument.partition("::")[0]).resolve()
    return not argument.startswith("-") and path.exists() and path.is_relative_to(root / "tests")


def _clone(start: Path) -> Path:
    installed = Path(__file__).resolve().parents[2]
    for folder in (installed, start, *start.parents):
        if (
            (folder / "tests").is_dir()
            and (folder / "pyproject.toml").is_file()
            and (folder / "daq").is_dir()
        ):
            return folder
    raise NoTests(f"no tests found: neither {installed} nor {start} is a clone of armhil")
