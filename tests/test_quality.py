"""The checks that every commit passes, as tests: style, types, and who may import whom."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks.mutants_guards import GUARDS
from benchmarks.mutants_nearest import Nearest, broken_functions
from benchmarks.mutants_search import FIGURES, broken
from benchmarks.mutants_search_rules import RULES
from tests.imports import circle, import_graph, modules, within

IMPORT_LINTER = "from importlinter.cli import lint_imports_command; lint_imports_command()"
PACKAGES = ("robots", "drivers", "trajectories", "ident", "daq")


@pytest.mark.parametrize(
    ("tool", "arguments"),
    [
        pytest.param("ruff", ["-m", "ruff", "check"], id="ruff check"),
        pytest.param("ruff", ["-m", "ruff", "format", "--check"], id="ruff format"),
        pytest.param("mypy", ["-m", "mypy"], id="mypy", marks=pytest.mark.slow),
        pytest.param("importlinter", ["-c", IMPORT_LINTER], id="import-linter"),
    ],
)
def test_the_repository_passes(tool: str, arguments: list[str], repository: Path) -> None:
    if find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed; ./armhil test installs it")
    result = subprocess.run(
        [sys.executable, *arguments], cwd=repository, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, f"\n{result.stdout}{result.stderr}"


LONGEST = 300
"""Lines of a file of the packages: one idea each, read at a sitting."""


def test_no_file_is_too_long(repository: Path) -> None:
    files = [file for package in PACKAGES for file in (repository / package).rglob("*.py")]
    lines = {str(file.relative_to(repository)): len(file.read_text("utf-8").splitlines()) for file in files}
    too_long = {name: count for name, count in lines.items() if count > LONGEST}
    assert len(lines) > len(PACKAGES)
    assert not too_long


def test_imports_go_one_way_on_every_level(repository: Path) -> None:
    files = modules(repository, PACKAGES)
    graph = import_graph(files)
    folders = {name for name, file in files.items() if file.name == "__init__.py"}
    circles = {folder: circle(within(graph, folder)) for folder in ("", *sorted(folders))}
    assert sum(map(len, graph.values())) > len(graph)  # it has read the imports
    assert not circle(graph)
    assert not {folder: found for folder, found in circles.items() if found}


def test_every_guard_that_is_broken_by_hand_still_stands(repository: Path) -> None:
    """A list of mutants that do not match the code any more would test nothing; the page has every figure."""
    texts = {one.module: (repository / one.module).read_text("utf-8") for one in GUARDS}
    assert [one.guard for one in GUARDS if texts[one.module].count(one.before) != 1] == []
    texts |= {one.module: (repository / one.module).read_text("utf-8") for one in RULES}
    assert [one.guard for one in RULES if texts[one.module].count(one.before) != 1] == []
    for one in FIGURES:
        text = (repository / one.path).read_text("utf-8")
        assert len({after for _, after in broken(text, one.name)} - {text}) == 2, one.name
    page = " ".join((repository / "docs" / "explanation" / "naming.md").read_text("utf-8").split())
    assert [one.name for one in FIGURES if one.words not in page] == []


def test_a_mutant_is_shown_to_the_tests_that_enter_it() -> None:
    """Of a function its own, of a constant those of every function that reads it; the quickest first."""
    path = "ident/discrepancy/by_evidence/confirm/held_out.py"
    text = (Path(__file__).parents[1] / path).read_text("utf-8")
    (changed,) = broken_functions(path, text, text.replace("2.0 * float(change", "float(change"))
    assert changed == f"{path}:HeldOut._confirmation"
    names = "ident/discrepancy/by_evidence/decide/no_name.py"
    text = (Path(__file__).parents[1] / names).read_text("utf-8")
    readers = broken_functions(names, text, text.replace("OUTSIDE = 0.1", "OUTSIDE = 1.0"))
    law = "ident/discrepancy/by_evidence/decide/free_law.py"
    loop = "ident/discrepancy/by_evidence/where_it_acts.py"
    own = [f"{names}:odds_beforehand", f"{names}:odds_of_no_name"]
    assert sorted(readers) == [f"{law}:free_law", *own, f"{loop}:odds_of_no_name"]
    tests = {"slow": (30.0, {changed}), "other": (0.1, {"x"}), "quick": (0.2, {changed, "x"})}
    near = Nearest({name: (seconds, frozenset(entered)) for name, (seconds, entered) in tests.items()})
    assert list(near.stages({changed})) == [("quick",), ("slow",)]
