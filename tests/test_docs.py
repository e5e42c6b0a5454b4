"""README and docs keep their word: commands run, links lead somewhere, no address slips in.

Each line that starts with ``$ `` in a ``console`` block is executed, in the order of its page, in an empty
folder of the page's own in which ``armhil`` and ``./armhil`` are this very command line. What is not as a
reader would have it:

- ``armhil demo`` runs for real, but is made short: options that make the motion and the search for it brief
  are put behind what the text says, and a channel of the test's own. ``.ci/run`` runs it at full length.
  ``armhil check``, ``commission``, ``home``, ``jog`` and ``run`` get a channel of the test's own too.
  One that another page began with in the same words is not run again: what it left is copied.
- ``armhil test`` only collects one file: the tests are what is running already.
- Files that a reader is told to bring (a log, a column map) are made here, and ``robots/`` is a copy.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

import robots
from daq.cli.entry import app
from drivers import Channel
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from robots import Robot
from tests.daq.payload_captures import write_payload_captures
from tests.shared_folder import shared_folder

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
CONSOLE = re.compile(r"^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)

# On a busy machine drives answer late once or twice, and what is identified is a piece of two seconds.
SHORT_DEMO = ["--duration", "5", "--periods", "1", "--evaluations", "100"]
NO_TESTS = ["--collect-only", "-q", "-p", "no:cacheprovider", "tests/ident/test_emps.py"]
COLUMN_MAP = """format = 1
[time]
column = "t"
[position]
columns = ["q1", "q2", "q3", "q4", "q5", "q6"]
unit = "deg"
[control_signal]
columns = ["v1", "v2", "v3", "v4", "v5", "v6"]
"""


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def commands(page: Path) -> list[list[str]]:
    """The words of each command that a page shows, comments left out."""
    blocks = CONSOLE.findall(page.read_text(encoding="utf-8"))
    lines = [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]
    return [shlex.split(line, comments=True) for line in lines]


WITH_COMMANDS = [page for page in PAGES if commands(page)]


def test_the_pages_were_found() -> None:
    assert {name_of(page) for page in WITH_COMMANDS} >= {"README.md", "docs/reference/cli.md"}
    assert sum(len(commands(page)) for page in WITH_COMMANDS) > 10


# Commands


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder as a reader has it: the command, the arms, and files of the reader's own."""
    (tmp_path / "armhil").write_text(f'#!/bin/sh\nexec "{Path(sys.executable).with_name("armhil")}" "$@"\n')
    (tmp_path / "armhil").chmod(0o755)
    shutil.copytree(ROOT / "robots", tmp_path / "robots")
    return tmp_path


def bring(folder: Path, words: list[str], shared_data: Callable[[], Path]) -> None:
    """Put in place the files that a command names and that a reader would have."""
    if "DATA_EMPS.mat" in words and not (folder / "DATA_EMPS.mat").exists():
        shutil.copy(shared_data() / "emps" / "DATA_EMPS.mat", folder)
    if "my-arm" in words[:-1] and words[0] != "cp" and not (folder / "my-arm").exists():
        shutil.copytree(ROOT / "robots" / "tx40", folder / "my-arm")
    if "my-map.toml" in words:
        (folder / "my-map.toml").write_text(COLUMN_MAP)
    if "runs/second/capture.mcap" in words and not (folder / "runs/second").exists():
        shutil.copytree(folder / "runs/first", folder / "runs/second")
    if "loaded.mcap" in words and not (folder / "loaded.mcap").exists():
        write_payload_captures(robots.load("emps"), folder)
    if "my-log.csv" in words:
        write_log(folder / "my-log.csv", robots.load("tx40"))


def write_log(path: Path, robot: Robot) -> None:
    """A log as somebody else might have it: time, degrees and control signals of the simulated arm."""
    t = np.arange(0.0, 4.0, robot.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(t, t[-1] - t)) ** 2
    home = np.array(robot.home)
    phases = [np.sin(2 * np.pi * (0.35 + 0.13 * j) * t + j) for j in range(robot.n)]
    run = simulate_offline(robot, draw_truth(robot, 1), home + 0.4 * (window * np.array(phases)).T)
    table = np.column_stack([run.time, np.rad2deg(run.position), run.control_signal])
    header = ",".join(["t", *(f"q{j}" for j in range(1, 7)), *(f"v{j}" for j in range(1, 7))])
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.12g")


def as_run(words: list[str], channel: Channel) -> list[str]:
    """The command that is really executed; see the module's text."""
    if words[0] == "cp":
        return words
    words = ["./armhil", *words[1:]]
    if words[1] == "demo" and "--help" not in words:
        return [*words, *SHORT_DEMO, "--channel", channel.name]
    if words[1] in {"check", "commission", "home", "jog", "run"}:
        return [*words, "--channel", channel.name]
    if words[1] == "test":
        return [*words[:2], *NO_TESTS, *words[2:]]
    return words


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("page", WITH_COMMANDS, ids=name_of)
def test_every_command_of_a_page_runs(
    page: Path,
    folder: Path,
    new_channel: Callable[[], Channel],
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    no_leftovers: None,
) -> None:
    for number, words in enumerate(commands(page)):
        assert words[0] in {"armhil", "./armhil", "cp"}, (
            f"{name_of(page)} shows {words[0]}; teach this test to run it"
        )
        bring(folder, words, lambda: request.getfixturevalue("shared_data"))
        if number == 0 and words[1:3] == ["demo", "--out"]:
            name = re.sub(r"\W+", "-", "begun " + " ".join(words[1:]))

            def begin(begun: Path, words: list[str] = words) -> None:
                run(words, folder, new_channel())
                shutil.copytree(folder / "runs", begun / "runs")

            begun = shared_folder(tmp_path_factory, name, begin)
            shutil.copytree(begun / "runs", folder / "runs", dirs_exist_ok=True)
        else:
            run(words, folder, new_channel())


def run(words: list[str], folder: Path, channel: Channel) -> None:
    """A command of a page, which ends as its page would have it."""
    done = subprocess.run(
        as_run(words, channel),
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    # 1 is a verdict that warns: the short motion shows less than the one of the text would.
    warns = {"demo", "diagnose", "export-model", "identify", "plan", "recover"}
    allowed = {0, 1} if words[1] in warns else {0}
    if words[1] == "check":
        allowed = {3}  # an arm's first check has no baseline to be compared with
    assert done.returncode in allowed, f"$ {shlex.join(words)}\n{done.stdout}{done.stderr}"


# Links


def links() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        text = CODE.sub("", page.read_text(encoding="utf-8"))
        for target in LINK.findall(text):
            if not re.match(r"[a-z]+:", target):
                yield name_of(page), target


@pytest.mark.parametrize(("page", "target"), sorted(set(links())))
def test_a_link_leads_to_a_file_of_the_clone(page: str, target: str) -> None:
    path, _, heading = target.partition("#")
    file = (ROOT / page).parent / path if path else ROOT / page
    assert file.resolve().is_relative_to(ROOT), "a clone has nothing outside of itself"
    assert file.exists()
    if heading:
        titles = re.findall(r"^#+ +(.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
        assert heading in {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


# Environment variables


def test_the_reference_has_every_environment_variable() -> None:
    read = r"""(?:environ\.get\(|environ\[|getenv\()"(ARMHIL_\w+)"|\$\{?(ARMHIL_\w+)"""
    folders = ("robots", "drivers", "trajectories", "ident", "daq", "tests")
    sources = [ROOT / "armhil", *(path for folder in folders for path in (ROOT / folder).rglob("*.py"))]
    found = {name for path in sources for name in re.findall(read, path.read_text(encoding="utf-8"))}
    # What the tests mark their processes with is nobody's setting.
    names = {python or shell for python, shell in found} - {"ARMHIL_TEST"}
    assert names >= {"ARMHIL_DEBUG", "ARMHIL_PYTHON"}
    text = (ROOT / "docs" / "reference" / "cli.md").read_text(encoding="utf-8")
    assert {name for name in names if f"| `{name}` |" not in text} == set()


# What no file may hold

# Split, so that this file itself names none of them.
INDEXES = "py~pi python~hosted registry.n~pmjs proxy.go~lang ana~conda index.cra~tes".replace("~", "").split()
MACHINES = r"(?<![\w.<>}\])~*-])/(?:work|home|root|Users)/\w"
FORBIDDEN = re.compile("|".join([*(rf"\b{re.escape(name)}\.\w" for name in INDEXES), MACHINES]))


def tracked_text() -> Iterator[tuple[str, str]]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git clone")
    for name in filter(None, listed.stdout.decode().split("\0")):
        path = ROOT / name
        if not path.is_file():
            continue
        data = path.read_bytes()
        if b"\0" not in data:
            # A device file may be in the encoding of its maker.
            yield name, data.decode("utf-8", errors="replace")


def test_no_tracked_file_names_a_package_index_or_a_path_of_some_machine() -> None:
    found = [
        f"{name}:{number}: {line.strip()[:120]}"
        for name, text in tracked_text()
        for number, line in enumerate(text.splitlines(), start=1)
        if FORBIDDEN.search(line)
    ]
    assert not found, "\n".join(found)


def test_every_section_that_code_cites_is_there() -> None:
    page = (ROOT / "docs" / "explanation" / "method.md").read_text(encoding="utf-8")
    sections = set(re.findall(r"^#{2,3} (\d(?:\.\d)?)\b", page, re.MULTILINE))
    cited = {
        (path.relative_to(ROOT).as_posix(), number)
        for package in ("robots", "drivers", "trajectories", "ident", "daq")
        for path in (ROOT / package).rglob("*.py")
        for numbers in re.findall(r"method\.md ((?:\d(?:\.\d)?(?:, )?)+)", path.read_text(encoding="utf-8"))
        for number in numbers.split(", ")
        if number
    }
    assert len(cited) > 10
    assert not {(path, number) for path, number in cited if number not in sections}


# What is shown and not run: a person, hardware or minutes are needed

SHOWN = re.compile(r"^(?:\$ |    )(?:\./)?armhil (.+)$|`(?:\./)?armhil ([a-z][^`]*)`", re.MULTILINE)


def command_lines() -> Iterator[tuple[str, str]]:
    """Page and words of every call of armhil that a page has, in a block or within a sentence."""
    for page in PAGES:
        for in_block, in_sentence in SHOWN.findall(page.read_text(encoding="utf-8")):
            yield name_of(page), in_block or " ".join(in_sentence.split())


def test_every_command_and_option_that_a_page_names_is_there() -> None:
    """A sentence may leave out what an option takes; `armhil test` hands its options on to pytest."""
    group: Any = typer.main.get_command(app)
    # What stands behind a bare -- is another command's.
    lines = [(page, shlex.split(line.split(" -- ")[0], comments=True)) for page, line in command_lines()]
    assert len(lines) > 200
    unknown = []
    for page, words in lines:
        command, rest = group, list(words)
        while rest and rest[0] in getattr(command, "commands", {}):
            command = command.commands[rest.pop(0)]
        if hasattr(command, "commands"):
            unknown += [(page, words)] if rest and not rest[0].startswith("-") else []
        elif words[0] != "test":
            known = {name for one in command.params for name in (*one.opts, *one.secondary_opts, "--help")}
            given = [word.split("=")[0] for word in rest if re.match(r"--?[a-z]", word)]
            unknown += [(page, words) for word in given if word not in known]
    assert unknown == []
