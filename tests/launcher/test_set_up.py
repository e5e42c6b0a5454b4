"""./armhil makes its environment once, again when it is stale, and is out of the way otherwise."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.launcher.conftest import Clone

FRESH = ["venv", "requirements.txt", "clone"]
SHELLS = {"sh": [], "dash": [], "bash": ["--posix"], "busybox": ["sh"], "ksh": [], "zsh": ["--emulate", "sh"]}
AWKWARD = ["a b", "", "*", "$HOME", "it's", 'say "so"', "back\\slash", "two\nlines", "--", "-x=ü"]


def test_first_start_installs_then_becomes_the_command(clone: Clone) -> None:
    result = clone.run("demo", *AWKWARD)
    assert clone.calls() == FRESH
    assert result.stdout == "<demo>" + "".join(f"<{argument}>" for argument in AWKWARD)
    assert result.returncode == 7, "the command's own exit code"
    assert all(line.startswith("armhil: ") for line in result.stderr.splitlines())


def test_a_second_start_asks_no_python(ready_clone: Clone) -> None:
    result = ready_clone.run(*AWKWARD)
    assert ready_clone.calls() == []
    assert result.stdout == "".join(f"<{argument}>" for argument in AWKWARD)
    assert result.stderr == ""


def test_test_installs_the_larger_set_at_once(clone: Clone) -> None:
    clone.run("test", "-k", "one or two")
    assert clone.calls() == ["venv", "requirements-test.txt", "clone"]
    clone.run("demo")
    assert clone.calls() == []


def test_test_adds_to_what_is_there(ready_clone: Clone) -> None:
    for expected in (["requirements-test.txt"], []):
        ready_clone.run("test")
        assert ready_clone.calls() == expected


@pytest.mark.parametrize(
    ("changed", "arguments", "expected"),
    [
        ("requirements.txt", ["demo"], FRESH),
        ("requirements.txt", ["test"], ["venv", "requirements-test.txt", "clone"]),
        ("requirements-test.txt", ["demo"], []),
        ("requirements-test.txt", ["test"], ["requirements-test.txt"]),
        ("pyproject.toml", ["demo"], ["clone"]),
    ],
)
def test_what_changed_is_installed_again(
    clone: Clone, changed: str, arguments: list[str], expected: list[str]
) -> None:
    clone.run("test")
    clone.calls()
    (clone.root / changed).write_text("something else\n")
    clone.run(*arguments)
    assert clone.calls() == expected
    clone.run(*arguments)
    assert clone.calls() == []


def test_a_moved_clone_is_set_up_again(ready_clone: Clone) -> None:
    moved = ready_clone.root.rename(ready_clone.root.with_name("moved clone"))
    result = subprocess.run(
        [moved / "armhil", "x"], env=ready_clone.environment(), capture_output=True, text=True, check=False
    )
    assert result.stdout == "<x>"
    assert ready_clone.calls() == FRESH


def test_an_interpreter_that_went_away_is_replaced(ready_clone: Clone) -> None:
    (ready_clone.programs / "python3").unlink()
    ready_clone.add_python("python3.13", "3.13")
    ready_clone.run("demo")
    assert ready_clone.calls() == FRESH


def test_an_interpreter_that_became_another_is_replaced(ready_clone: Clone) -> None:
    """.venv/bin/python leads to whatever the system calls python3 now, with the packages of the old one."""
    (ready_clone.venv / "bin/python").unlink()
    (ready_clone.venv / "bin/python").symlink_to(ready_clone.add_python("python3.13", "3.13"))
    ready_clone.run("demo")
    assert ready_clone.calls() == FRESH


def test_the_python_asked_for_is_used(ready_clone: Clone) -> None:
    other = str(ready_clone.add_python("another", "3.11"))
    ready_clone.run("demo", ARMHIL_PYTHON=other)
    assert ready_clone.calls() == FRESH
    for environment in ({"ARMHIL_PYTHON": other}, {}):
        ready_clone.run("demo", **environment)
        assert ready_clone.calls() == [], "asking for no other keeps the one that is there"


def test_an_old_python3_is_passed_over(clone: Clone) -> None:
    clone.add_python("python3", "3.9")
    newer = clone.add_python("python3.12", "3.12")
    clone.run("demo")
    assert os.path.realpath(clone.venv / "bin/python") == str(newer)


@pytest.mark.parametrize("link", ["absolute", "relative", "chain"])
def test_start_through_a_symbolic_link_from_elsewhere(clone: Clone, tmp_path: Path, link: str) -> None:
    elsewhere = tmp_path / "else where"
    elsewhere.mkdir()
    started = elsewhere / "armhil"
    started.symlink_to(clone.launcher if link == "absolute" else Path("..", clone.root.name, "armhil"))
    if link == "chain":
        started = elsewhere / "again"
        started.symlink_to("armhil")
    result = subprocess.run(
        [f"./{started.name}", "x"],
        cwd=elsewhere,
        env=clone.environment(CDPATH=str(tmp_path)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.stdout == "<x>"
    assert (clone.venv / "bin/python").exists()
    assert sorted(path.name for path in elsewhere.iterdir()) == sorted({"armhil", started.name})


def test_settings_of_pip_and_python_that_would_break_it_are_put_aside(clone: Clone) -> None:
    kept = {
        "PIP_INDEX_URL": "file:///mirror",
        "PIP_CERT": "/certificates.pem",
        "PIP_FIND_LINKS": "/wheels",
        "PIP_PROXY": "proxy:1",
        "PIP_DEFAULT_TIMEOUT": "9",
    }
    dropped = {
        "PIP_USER": "1",
        "PIP_TARGET": "/elsewhere",
        "PIP_REQUIRE_VIRTUALENV": "1",
        "PIP_CONSTRAINT": "/no/such/file",
        "PIP_NO_DEPS": "1",
        "PYTHONPATH": "/opt/ros/lib",
        "PYTHONHOME": "/nowhere",
    }
    clone.run("demo", **kept, **dropped)
    seen = (clone.state / "environment").read_text().splitlines()
    assert {f"{name}={value}" for name, value in kept.items()} <= set(seen)
    assert not [line for line in seen if line.split("=")[0] in dropped]


def test_the_command_does_not_see_another_pythons_packages(ready_clone: Clone) -> None:
    (ready_clone.state / "command").write_text("#!/bin/sh\nenv\n")
    seen = ready_clone.run("demo", PYTHONPATH="/opt/ros/lib", PIP_USER="1").stdout
    assert "PYTHONPATH" not in seen
    assert "PIP_USER=1" in seen, "pip's settings are the user's again"


def test_a_foreign_environment_is_kept(clone: Clone) -> None:
    clone.venv.mkdir()
    (clone.venv / "precious").write_text("mine")
    clone.run("demo")
    (kept,) = clone.root.glob(".venv.kept-*")
    assert (kept / "precious").read_text() == "mine"
    assert clone.calls() == FRESH


@pytest.mark.parametrize("shell", [shell for shell in SHELLS if shutil.which(shell)])
def test_every_shell_of_this_machine_can_run_it(clone: Clone, shell: str) -> None:
    for expected in (FRESH, []):
        result = subprocess.run(
            [shutil.which(shell) or shell, *SHELLS[shell], str(clone.launcher), *AWKWARD],
            env=clone.environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.stdout == "".join(f"<{argument}>" for argument in AWKWARD), result.stderr
        assert clone.calls() == expected
