"""Which quick tests run what a mutant breaks: recorded once, so that it is shown to the nearest alone.

    python -m benchmarks.mutants_nearest FILE [pytest's arguments]   # records, with the quick tests of ident

For each test that passes the record has the functions of ``ident/`` that it enters, those of its fixtures
among them, and its processor time. What tests of one file keep in a ``functools.cache`` is thrown away before
each, so that every test is on record with everything that it needs. A broken function is shown to the tests
that enter it, a broken constant to those that enter a function that reads it; the quickest first, up to
``BUDGET``.
"""

from __future__ import annotations

import ast
import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "ident"
TESTS = ("tests/ident",)

BUDGET = 100.0
"""s of processor time, of the tests that one mutant is shown to; a survivor lives through all of them."""

_STAGES = (2.0, 10.0, 40.0, BUDGET)
"""s; so that the files of long tests are not even imported where a short test has noticed."""


@dataclass(frozen=True)
class Nearest:
    """The record.

    Attributes:
        tests: of each test its seconds and the functions that it enters, ``path:qualified name``.
    """

    tests: dict[str, tuple[float, frozenset[str]]]

    @staticmethod
    def read(paths: Sequence[Path]) -> Nearest:
        """From one record or several, of tests of their own each."""
        tests = {}
        for path in paths:
            kept = json.loads(path.read_text(encoding="utf-8"))
            for test, (seconds, entered) in kept["tests"].items():
                tests[test] = seconds, frozenset(kept["functions"][number] for number in entered)
        return Nearest(tests)

    def stages(self, broken: set[str]) -> Iterator[tuple[str, ...]]:
        """Tests that enter one of these functions, the quickest first, in parts that take ever longer."""
        near = sorted((seconds, test) for test, (seconds, entered) in self.tests.items() if entered & broken)
        spent, part, limits = 0.0, list[str](), iter(_STAGES)
        limit = next(limits)
        for seconds, test in near:
            spent += seconds
            if spent > BUDGET and part:
                break
            if spent > limit and part:
                yield tuple(part)
                part, limit = [], next((one for one in limits if one >= spent), BUDGET)
            part.append(test)
        if part:
            yield tuple(part)


def broken_functions(module: str, before: str, after: str) -> set[str]:
    """Functions that a change of a module's text changes, as ``path:qualified name``.

    Of a constant of a module those that read it, in every module; where nothing of this finds anything (the
    body of a class), all functions of the module.
    """
    old, new = ast.parse(before), ast.parse(after)
    was, now = (_functions(tree) for tree in (old, new))
    changed = {name for name, node in was.items() if name not in now or ast.dump(node) != ast.dump(now[name])}
    inner = {name for name in changed if not any(other.startswith(f"{name}.") for other in changed)}
    found = {f"{module}:{name}" for name in inner}
    held, holds = (_assigned(tree) for tree in (old, new))
    for name, value in held.items():
        if holds.get(name) != value:
            found |= readers(module, name)
    return found or {f"{module}:{name}" for name in was}


def readers(module: str, name: str) -> set[str]:
    """Functions of the package that read a constant of a module, by way of other constants, too."""
    dotted = module.removesuffix(".py").replace("/", ".")
    found: set[str] = set()
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        own, tree = str(path.relative_to(ROOT)), _tree(path)
        names = {name} if own == module else _imported(tree, dotted, name)
        if not names:
            continue
        functions = _functions(tree)
        reading = {f"{own}:{key}" for key, node in functions.items() if _reads(node, names)}
        for statement in tree.body:
            if isinstance(statement, ast.ClassDef) and _reads(statement, names):
                reading |= {f"{own}:{key}" for key in functions if key.startswith(f"{statement.name}.")}
        found |= reading
        derived = {key for key, node in _assignments(tree) if key not in names and _reads(node, names)}
        for other in derived:
            found |= readers(own, other)
    return found


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _imported(tree: ast.Module, dotted: str, name: str) -> set[str]:
    """What a module calls a constant of another one: its name there, or that of an attribute."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            if node.module == dotted:
                found |= {one.asname or one.name for one in node.names if one.name == name}
            if any(f"{node.module}.{one.name}" == dotted for one in node.names):
                found.add(name)
    return found


def _reads(node: ast.AST, names: set[str]) -> bool:
    inside = ast.walk(node)
    return any(getattr(one, "id", None) in names or getattr(one, "attr", None) in names for one in inside)


def _assignments(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                for one in ast.walk(target):
                    if isinstance(one, ast.Name):
                        yield one.id, node.value


def _assigned(tree: ast.Module) -> dict[str, str]:
    return {name: ast.dump(value) for name, value in _assignments(tree)}


def _functions(tree: ast.Module) -> dict[str, ast.AST]:
    """Of a module, by the qualified names that their code has."""
    found: dict[str, ast.AST] = {}

    def look(node: ast.AST, prefix: str) -> None:
        for child in ast.iter_child_nodes(node):
            match child:
                case ast.ClassDef(name=name):
                    look(child, f"{prefix}{name}.")
                case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                    found[f"{prefix}{name}"] = child
                    look(child, f"{prefix}{name}.<locals>.")
                case _:
                    look(child, prefix)

    look(tree, "")
    return found


class Recorder:
    """A plugin of pytest that notes what each test enters."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._entered: dict[int, CodeType] = {}
        self._fixtures: dict[tuple[str, str], tuple[float, dict[int, CodeType]]] = {}
        self._called = 0.0
        self._passed = False
        self._tests: dict[str, tuple[float, dict[int, CodeType]]] = {}

    def _note(self, frame: FrameType, event: str, argument: object) -> None:
        self._entered[id(frame.f_code)] = frame.f_code

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[object]:
        _forget(item)
        self._entered, self._called, self._passed = {}, 0.0, False
        threading.settrace(self._note)
        sys.settrace(self._note)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type]
            if self._passed:
                self._tests[item.nodeid] = self._whole(item)

    def _whole(self, item: pytest.Item) -> tuple[float, dict[int, CodeType]]:
        seconds, entered = self._called, dict(self._entered)
        for (base, name), (cost, inside) in self._fixtures.items():
            if name in getattr(item, "fixturenames", ()) and item.nodeid.startswith(base):
                seconds += cost
                entered.update(inside)
        return seconds, entered

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Iterator[object]:
        around, self._entered = self._entered, {}
        start = time.process_time()
        try:
            return (yield)
        finally:
            cost = time.process_time() - start
            self._fixtures[fixturedef.baseid, fixturedef.argname] = cost, self._entered
            self._entered = {**around, **self._entered}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Iterator[None]:
        start = time.process_time()
        try:
            return (yield)
        finally:
            self._called = time.process_time() - start

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self._passed = report.passed and not hasattr(report, "wasxfail")

    def pytest_sessionfinish(self) -> None:
        folder = f"{ROOT / PACKAGE}/"
        numbers: dict[str, int] = {}
        tests = {}
        for test, (seconds, entered) in self._tests.items():
            ours = (code for code in entered.values() if code.co_filename.startswith(folder))
            names = {f"{Path(code.co_filename).relative_to(ROOT)}:{_qualified(code)}" for code in ours}
            tests[test] = round(seconds, 3), sorted(numbers.setdefault(name, len(numbers)) for name in names)
        self._path.write_text(json.dumps({"functions": list(numbers), "tests": tests}), encoding="utf-8")


def _qualified(code: CodeType) -> str:
    """Of a lambda, a comprehension or a generator the function that it stands in."""
    name = str(getattr(code, "co_qualname", code.co_name))  # Python 3.11 and newer
    while name.endswith(">"):
        name = name.rpartition(".<locals>.")[0] or "<module>"
        if name == "<module>":
            break
    return name


def _forget(item: pytest.Item) -> None:
    for value in vars(getattr(item, "module", None) or object).values():
        forget: Callable[[], None] | None = getattr(value, "cache_clear", None)
        if callable(forget) and not isinstance(value, type):
            forget()


if __name__ == "__main__":
    out, *given = sys.argv[1:]
    chosen = ["-q", "-n", "0", "-p", "no:cacheprovider", "-m", "not slow", *(given or TESTS)]
    sys.exit(pytest.main(chosen, plugins=[Recorder(Path(out).resolve())]))
