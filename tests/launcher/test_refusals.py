"""What stops ./armhil is said in one line, and leaves nothing that a later start trips over."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.launcher.conftest import Clone, make_clone

FRESH = ["venv", "requirements.txt", "clone"]

NO_NETWORK = """\
WARNING: Retrying (Retry(total=0)) after connection broken by 'NewConnectionError(': \
Failed to establish a new connection: [Errno -3] Temporary failure in name resolution')'
ERROR: Could not find a version that satisfies the requirement annotated-doc==0.0.7 (from versions: none)
ERROR: No matching distribution found for annotated-doc==0.0.7
"""
NO_ENSUREPIP = """\
The virtual environment was not created successfully because ensurepip is not
available.  On Debian/Ubuntu systems, you need to install the python3-venv
package using the following command.
"""


def test_no_python_at_all(clone: Clone) -> None:
    (clone.programs / "python3").unlink()
    line = clone.refusal("demo")
    assert "needs Python 3.11 or newer" in line
    assert "ARMHIL_PYTHON" in line
    assert not clone.venv.exists()


def test_only_an_old_python(clone: Clone) -> None:
    clone.add_python("python3", "3.9")
    line = clone.refusal("demo")
    assert "needs Python 3.11 or newer" in line
    assert "python3 is 3.9" in line


@pytest.mark.parametrize(("version", "said"), [("3.10", "it is 3.10"), (None, "/no/such/python")])
def test_the_python_asked_for_does_not_do(clone: Clone, version: str | None, said: str) -> None:
    asked = str(clone.add_python("older", version)) if version else "/no/such/python"
    line = clone.refusal("demo", ARMHIL_PYTHON=asked)
    assert f"ARMHIL_PYTHON={asked} is not a Python 3.11 or newer" in line
    assert said in line


@pytest.mark.parametrize("says", [NO_ENSUREPIP, "/usr/bin/python3: No module named venv\n"])
def test_no_venv_module(clone: Clone, says: str) -> None:
    (clone.state / "venv-says").write_text(says)
    line = clone.refusal("demo")
    assert "apt install python3.12-venv" in line
    (clone.state / "venv-says").unlink()
    clone.calls()
    assert clone.run("demo").stdout == "<demo>"
    assert clone.calls() == FRESH


def test_no_network(clone: Clone) -> None:
    clone.pip_says(NO_NETWORK)
    line = clone.refusal("demo")
    assert "cannot reach the package index" in line
    assert "PIP_INDEX_URL" in line


def test_the_cause_is_not_read_from_an_earlier_command(ready_clone: Clone) -> None:
    (ready_clone.venv / "set-up.log").write_text(NO_NETWORK)
    ready_clone.pip_says("ERROR: another cause\n")
    result = ready_clone.run("test")
    assert result.stderr.endswith(
        f"the last lines of {ready_clone.venv}/set-up.log:\n  ERROR: another cause\n"
    )


def test_a_package_that_is_not_the_pinned_one(clone: Clone) -> None:
    clone.pip_says(NO_NETWORK + "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE.\n")
    result = clone.run("demo")
    assert result.returncode == 2
    assert "a downloaded package is not the pinned one" in result.stderr


def test_no_space(clone: Clone) -> None:
    clone.pip_says("ERROR: Could not install packages: [Errno 28] No space left on device\n")
    assert "no space left" in clone.refusal("test")


def test_a_failing_pip_shows_its_last_lines_and_leaves_no_stamp(clone: Clone) -> None:
    clone.pip_says("".join(f"line {number}\n" for number in range(100)))
    result = clone.run("demo")
    assert result.returncode == 2
    assert result.stdout == ""
    assert "installing requirements.txt failed" in result.stderr
    assert result.stderr.endswith("  line 98\n  line 99\n")
    assert "line 50\n" not in result.stderr
    assert not list(clone.venv.glob("*.stamp"))
    assert clone.calls() == ["venv", "requirements.txt"]

    clone.repair_pip()
    assert clone.run("demo").stdout == "<demo>"
    assert clone.calls() == FRESH


def test_a_failing_test_set_leaves_the_command_working(ready_clone: Clone) -> None:
    ready_clone.pip_says("ERROR: hashes do not match\n")
    assert ready_clone.run("test").returncode == 2
    ready_clone.calls()
    assert ready_clone.run("demo").stdout == "<demo>"
    assert ready_clone.calls() == []


def test_half_a_clone(clone: Clone) -> None:
    (clone.root / "requirements.txt").unlink()
    line = clone.refusal("demo")
    assert f"{clone.root} is not a whole clone" in line
    assert "requirements.txt" in line


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.usefixtures("no_leftovers")
def test_an_interrupted_set_up_ends_at_once_and_is_done_again(clone: Clone, number: signal.Signals) -> None:
    (clone.state / "pip-hangs").touch()
    with clone.start("demo", ARMHIL_TEST=os.environ["ARMHIL_TEST"]) as process:
        wait_for(clone.state / "pip-started")
        process.send_signal(number)
        output, _ = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    assert output == ""
    assert not (clone.root / ".venv.lock").is_symlink()
    clone.calls()

    clone.repair_pip()
    assert clone.run("demo").stdout == "<demo>"
    assert clone.calls() == FRESH


def test_the_lock_of_a_killed_set_up_is_no_obstacle(clone: Clone) -> None:
    with subprocess.Popen(["sh", "-c", "exit"]) as gone:
        pass
    (clone.root / ".venv.lock").symlink_to(f"pid-{gone.pid}")
    assert clone.run("demo").stdout == "<demo>"
    assert not (clone.root / ".venv.lock").is_symlink()


@pytest.mark.parametrize("killed", [False, True], ids=["free", "lock of a killed one"])
def test_starts_at_the_same_time_set_up_once(clone: Clone, killed: bool) -> None:
    if killed:
        with subprocess.Popen(["sh", "-c", "exit"]) as gone:
            pass
        (clone.root / ".venv.lock").symlink_to(f"pid-{gone.pid}")
    started = [clone.start(f"start {number}") for number in range(4)]
    for number, process in enumerate(started):
        with process:
            output, errors = process.communicate(timeout=60)
        assert output == f"<start {number}>", errors
    assert clone.calls() == FRESH
    assert not list(clone.root.glob(".venv.*"))


@pytest.fixture
def public_clone(repository: Path) -> Iterator[Clone]:
    """A clone where any user may look: the directory of pytest is closed to others."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        clone = make_clone(Path(name), repository)
        clone.state.chmod(0o777)
        yield clone
        clone.root.chmod(0o755)


def start_without_write_permission(clone: Clone) -> subprocess.CompletedProcess[str]:
    clone.root.chmod(0o555)
    return subprocess.run(
        [str(clone.launcher), "demo"],
        env=clone.environment(),
        user=65534 if os.geteuid() == 0 else None,  # root may write everywhere
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_directory_without_write_permission(public_clone: Clone) -> None:
    result = start_without_write_permission(public_clone)
    assert result.returncode == 2
    assert result.stderr == f"armhil: cannot set up: {public_clone.root} is not writable\n"


def test_write_permission_is_not_needed_once_set_up(public_clone: Clone) -> None:
    public_clone.run("demo")
    result = start_without_write_permission(public_clone)
    assert result.stdout == "<demo>"
    assert result.stderr == ""


def wait_for(path: Path) -> None:
    deadline = time.monotonic() + 30
    while not path.exists():
        assert time.monotonic() < deadline, f"{path} did not appear"
        time.sleep(0.02)
