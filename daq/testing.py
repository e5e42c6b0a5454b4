"""``armhil test``: pytest on the tests of a clone."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import daq


class NoTests(Exception):
    """There are no tests to run here, or nothing to run them with; one line."""


def run_tests(start: Path, arguments: Sequence[str]) -> int:
    """Run pytest in the clone that this installation, or else the present folder, belongs to.

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
    return subprocess.call([sys.executable, "-m", "pytest", *(arguments or _DEFAULT)], cwd=root)


_DEFAULT = ("-n", "2", "--dist", "worksteal", "-q")
"""Two workers: the suite's tests wait on buses and clocks more than they compute."""


def _clone(start: Path) -> Path:
    installed = Path(daq.__file__).resolve().parent.parent
    for folder in (installed, start, *start.parents):
        if (
            (folder / "tests").is_dir()
            and (folder / "pyproject.toml").is_file()
            and (folder / "daq").is_dir()
        ):
            return folder
    raise NoTests(f"no tests found: neither {installed} nor {start} is a clone of armhil")
