"""A clone whose Python and pip are shell scripts: the launcher is seen at work without a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

TOOLS = ["cksum", "env", "grep", "kill", "ln", "mkdir", "mv", "ps", "readlink"]
TOOLS += ["rm", "rmdir", "sed", "sh", "sleep", "tail", "touch"]
"""All that the launcher may use besides the shell itself; the fakes use no more."""

PROGRESS = re.compile(r"armhil: (setting up|installing|waiting)")

FAKE_PYTHON = """#!/bin/sh
state=@STATE@
say() { printf '%s\\n' "$*" >>"$state/calls"; }
case $3 in
    'import sys; '*) printf '%s\\n' "@VERSION@" ;;
    'import os, sys; '*) printf '%s\\n' "@SELF@" ;;
    venv)
        say "venv $4"
        if [ -e "$state/venv-says" ]; then sed '' "$state/venv-says"; exit 1; fi
        mkdir -p "$4/bin" && ln -s "@SELF@" "$4/bin/python"
        ;;
    pip)
        say "pip $*"
        env >"$state/environment"
        touch "$state/pip-started"
        if [ -e "$state/pip-hangs" ]; then exec sleep 60; fi
        if [ -e "$state/pip-says" ]; then sed '' "$state/pip-says"; exit 1; fi
        case "$*" in *--editable*) ln -sf "$state/command" "${0%/*}/armhil" ;; esac
        ;;
    *) printf 'not expected: %s\\n' "$*"; exit 99 ;;
esac
"""

FAKE_COMMAND = """#!/bin/sh
printf '<%s>' "$@"
exit 7
"""


@dataclass(frozen=True)
class Clone:
    """A clone with the launcher in it, and the only directory on PATH."""

    root: Path
    state: Path
    programs: Path

    @property
    def launcher(self) -> Path:
        return self.root / "armhil"

    @property
    def venv(self) -> Path:
        return self.root / ".venv"

    def add_python(self, name: str = "python3", version: str = "3.12") -> Path:
        path = self.programs / name
        text = FAKE_PYTHON.replace("@STATE@", str(self.state)).replace("@VERSION@", version)
        path.write_text(text.replace("@SELF@", str(path)))
        path.chmod(0o755)
        return path

    def environment(self, **more: str) -> dict[str, str]:
        return {"PATH": str(self.programs), "LANG": "C", "HOME": str(self.state), **more}

    def start(self, *arguments: str, **environment: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [str(self.launcher), *arguments],
            env=self.environment(**environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        with self.start(*arguments, **environment) as process:
            output, errors = process.communicate(timeout=60)
        return subprocess.CompletedProcess(arguments, process.returncode, output, errors)

    def refusal(self, *arguments: str, **environment: str) -> str:
        """The one line that a refused start says besides its progress; nothing goes to standard output."""
        result = self.run(*arguments, **environment)
        assert result.returncode == 2, result
        assert result.stdout == ""
        (line,) = [line for line in result.stderr.splitlines() if not PROGRESS.match(line)]
        return line

    def calls(self) -> list[str]:
        """What was asked of Python since the last look: ``venv``, or the last argument of pip by its name."""
        log = self.state / "calls"
        lines = log.read_text().splitlines() if log.exists() else []
        log.unlink(missing_ok=True)
        return [Path(line.split()[-1]).name if line.startswith("pip") else "venv" for line in lines]

    def pip_says(self, text: str) -> None:
        (self.state / "pip-says").write_text(text)

    def repair_pip(self) -> None:
        (self.state / "pip-says").unlink(missing_ok=True)
        (self.state / "pip-hangs").unlink(missing_ok=True)


def make_clone(directory: Path, repository: Path) -> Clone:
    """A clone in a directory, with a Python 3.12 on its PATH."""
    clone = Clone(directory / "a clone", directory / "state", directory / "programs")
    for made in (clone.root, clone.state, clone.programs):
        made.mkdir()
    shutil.copy2(repository / "armhil", clone.launcher)
    for name in ("requirements.txt", "requirements-test.txt", "pyproject.toml"):
        (clone.root / name).write_text(f"{name}, as it was\n")
    for tool in TOOLS:
        found = shutil.which(tool)
        if found:
            (clone.programs / tool).symlink_to(os.path.realpath(found))
    command = clone.state / "command"
    command.write_text(FAKE_COMMAND)
    command.chmod(0o755)
    clone.add_python()
    return clone


@pytest.fixture
def clone(tmp_path: Path, repository: Path) -> Clone:
    return make_clone(tmp_path, repository)


@pytest.fixture
def ready_clone(clone: Clone) -> Clone:
    """A clone that is set up already, its calls forgotten."""
    assert clone.run("demo").returncode == 7
    clone.calls()
    return clone
