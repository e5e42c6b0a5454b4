"""Another package of the same name is told in one line: PyPI has an ident and a robots of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from daq.cli.start import ONE_THREAD


def armhil_robots(folder: Path, repository: Path) -> subprocess.CompletedProcess[str]:
    """``armhil robots`` as somebody who stands in a folder calls it."""
    return subprocess.run(
        [sys.executable, "-m", "daq", "robots"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(repository)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


@pytest.mark.parametrize("name", ["robots", "ident"])
def test_a_package_in_the_way_is_one_line(name: str, tmp_path: Path, repository: Path) -> None:
    stranger = tmp_path / name / "__init__.py"
    stranger.parent.mkdir()
    stranger.write_text("")
    done = armhil_robots(tmp_path, repository)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith(f"armhil: another package is in the way: {name} from {stranger.resolve()}")
    assert "python3 -m venv" in done.stderr


def test_nothing_in_the_way(tmp_path: Path, repository: Path) -> None:
    done = armhil_robots(tmp_path, repository)
    assert done.returncode == 0
    assert "tx40" in done.stdout


@pytest.mark.parametrize(("said", "threads"), [(None, "1"), ("2", "2")])
def test_linear_algebra_has_one_thread_where_nobody_says_otherwise(
    said: str | None, threads: str, tmp_path: Path, repository: Path
) -> None:
    program = (
        "import os, sys; from daq.cli import start; assert 'numpy' not in sys.modules\n"
        "sys.argv = ['armhil', 'robots']\n"
        "try: start.main()\n"
        "finally: print(*(os.environ[one] for one in start.ONE_THREAD), file=sys.stderr)"
    )
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    environment |= {"PYTHONPATH": str(repository)} | dict.fromkeys(ONE_THREAD if said else (), said or "")
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.stderr.split() == [threads] * len(ONE_THREAD)
