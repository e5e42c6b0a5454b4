"""Another package of the same name is told in one line: PyPI has an ident and a robots of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


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
