"""What `pip install armhil` brings: the packages with their data files, the command, nothing else."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from robots.extras import install_command

PACKAGES = {"robots", "drivers", "trajectories", "ident", "daq"}


@pytest.fixture(scope="module")
def wheel(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> zipfile.Path:
    directory = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(directory)]
    result = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    (path,) = directory.glob("armhil-*.whl")
    return zipfile.Path(path)


def test_the_wheel_has_every_tracked_file_of_the_packages(wheel: zipfile.Path, repository: Path) -> None:
    with zipfile.ZipFile(str(wheel.root.filename)) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
    written = {
        path.relative_to(repository).as_posix()
        for package in PACKAGES
        for path in (repository / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert packed == written
    assert {Path(name).suffix for name in packed} >= {".py", ".toml", ".urdf"}


def test_the_wheel_installs_the_command_and_its_licence(wheel: zipfile.Path) -> None:
    (information,) = (entry for entry in wheel.iterdir() if entry.name.endswith(".dist-info"))
    assert "armhil = daq.cli.start:main" in (information / "entry_points.txt").read_text()
    assert (information / "licenses" / "LICENSE").is_file()


def test_each_printed_install_is_one_that_pip_takes_into_this_environment(repository: Path) -> None:
    """Without any index: here all parts are installed, so pip has nothing to fetch, nor to complain of."""
    named = {
        extra
        for path in repository.glob("*/**/*.py")
        if path.relative_to(repository).parts[0] in PACKAGES
        for extra in re.findall(r"""install_command\(["']([a-z0-9-]+)["']\)""", path.read_text("utf-8"))
    }
    assert named >= {"consistent", "parquet", "postgresql", "hdf5", "pdf", "ros1"}
    command = shlex.split(install_command(",".join(sorted(named))))
    assert command[0] == sys.executable
    dry = [*command, "--dry-run", "--no-index", "--disable-pip-version-check"]
    done = subprocess.run(dry, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Would install" not in done.stdout and "does not provide the extra" not in done.stderr
