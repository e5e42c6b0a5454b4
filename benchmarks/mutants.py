"""Does a test notice? Break one thing after the other in a module, and run the tests that should see it.

    python -m benchmarks.mutants                        # all targets, 12 mutants each
    python -m benchmarks.mutants dwh --count 40         # one of them
    python -m benchmarks.mutants --list
    python -m benchmarks.mutants --guards               # the guards of mutants_guards.py, each broken by hand
    python -m benchmarks.mutants_nearest nearest.json   # which tests enter what, once (minutes)
    python -m benchmarks.mutants --search --nearest nearest.json    # figures and rules of the search

The clone is copied to a temporary folder; each mutant is one change of the syntax tree of one module there
(a comparison turned, a sign or an operation changed, a number moved by one, `abs`, `min`, `max` or `not`
taken away, a condition held true, a call for its effect left out). A mutant is killed where the tests of its
target fail or do not end. What is drawn is drawn with a seed. Survivors are printed with file, line, change.
"""

from __future__ import annotations

import argparse
import ast
import compileall
import copy
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from benchmarks.mutants_guards import GUARDS, Broken
from benchmarks.mutants_nearest import Nearest, broken_functions
from benchmarks.mutants_runner import Tests
from benchmarks.mutants_search import FIGURES, broken
from benchmarks.mutants_search_rules import RULES
from benchmarks.mutants_targets import TARGETS

ROOT = Path(__file__).resolve().parent.parent

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.Pow: ast.Mult,
}
_DROPPED = {"abs", "min", "max", "sorted"}


def mutants(tree: ast.Module) -> Iterator[tuple[int, Callable[[ast.Module], None]]]:
    """Every change of a module: its line, and what makes it in a copy of the tree."""
    no_code = {id(inside) for node in ast.walk(tree) for part in _no_code(node) for inside in ast.walk(part)}
    for place, node in enumerate(ast.walk(tree)):
        change = None if id(node) in no_code else _change(node)
        if change is not None:
            yield getattr(node, "lineno", 0), _at(place, change)


def _no_code(node: ast.AST) -> list[ast.AST]:
    """Decorators and annotations: nothing that runs."""
    annotations = [getattr(node, name, None) for name in ("annotation", "returns")]
    return [*getattr(node, "decorator_list", []), *(part for part in annotations if part is not None)]


def _at(place: int, change: Callable[[ast.AST], None]) -> Callable[[ast.Module], None]:
    def apply(tree: ast.Module) -> None:
        for index, node in enumerate(ast.walk(tree)):
            if index == place:
                change(node)
                return

    return apply


def _change(node: ast.AST) -> Callable[[ast.AST], None] | None:
    match node:
        case ast.Compare(ops=[operator]) if type(operator) in _COMPARISONS:
            return lambda found: setattr(found, "ops", [_COMPARISONS[type(found.ops[0])]()])  # type: ignore[attr-defined]
        case ast.BinOp(op=operator) if type(operator) in _OPERATIONS:
            return lambda found: setattr(found, "op", _OPERATIONS[type(found.op)]())  # type: ignore[attr-defined]
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            return lambda found: setattr(found, "op", ast.UAdd())
        case ast.Constant(value=bool()):
            return lambda found: setattr(found, "value", not found.value)  # type: ignore[attr-defined]
        case ast.Constant(value=int() | float()):
            return lambda found: setattr(found, "value", found.value + 1)  # type: ignore[attr-defined]
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=[_, *_]) if name in _DROPPED:
            return _first_argument
        case ast.If() | ast.IfExp():
            return lambda found: setattr(found, "test", ast.Constant(True))
        case ast.Expr(value=ast.Call()):
            return lambda found: setattr(found, "value", ast.Constant(None))
        case ast.BoolOp(op=operator):
            return lambda found: setattr(
                found,
                "op",
                ast.Or() if isinstance(found.op, ast.And) else ast.And(),  # type: ignore[attr-defined]
            )
    return None


def _first_argument(node: ast.AST) -> None:
    """The call without what it does: the first argument as it is."""
    assert isinstance(node, ast.Call)
    identity = ast.parse("lambda first, *others, **named: first", mode="eval").body
    node.func = identity


def run(name: str, count: int, seed: int, copy_of: Path, tests: Tests) -> tuple[int, list[str]]:
    """Killed mutants of a target and its survivors in words."""
    target = TARGETS[name]
    drawn = []
    for module in target.modules:
        tree = ast.parse((ROOT / module).read_text(encoding="utf-8"))
        drawn += [(module, tree, line, change) for line, change in mutants(tree)]
    random.Random(f"{seed} {name}").shuffle(drawn)
    if not tests.pass_(target.arguments):
        raise SystemExit(f"{name}: its tests fail on the module as it is")
    killed, survivors = 0, []
    for module, tree, line, change in drawn[:count]:
        broken = copy.deepcopy(tree)
        change(broken)
        before, after = ast.unparse(tree), ast.unparse(ast.fix_missing_locations(broken))
        if before == after:
            continue
        path = copy_of / module
        path.write_text(after, encoding="utf-8")
        alive = tests.pass_(target.arguments)
        shutil.copy(ROOT / module, path)
        if alive:
            survivors.append(f"{module}:{line}: {_difference(before, after)}")
            print(f"alive: {survivors[-1]}", file=sys.stderr, flush=True)
        killed += not alive
    return killed, survivors


def run_by_hand(kind: str, guards: Sequence[Broken], wanted: str, copy_of: Path, tests: Tests) -> None:
    """Break each of some guards or rules whose words hold ``wanted``, and print what its tests said."""
    chosen = [one for one in guards if wanted in one.guard]
    _has_to_pass(tests, [one.tests for one in chosen])
    killed = 0
    for one in chosen:
        text = (copy_of / one.module).read_text(encoding="utf-8")
        if text.count(one.before) != 1:
            raise SystemExit(f"{one.module}: not once: {one.before!r}")
        alive = _alive(copy_of / one.module, text.replace(one.before, one.after), one.tests, tests)
        killed += not alive
        print(f"{'alive' if alive else 'killed'}: {one.guard} ({one.module})", flush=True)
    print(f"{kind}: {killed} of {len(chosen)} killed", flush=True)


def run_search(wanted: Sequence[str], copy_of: Path, tests: Tests, nearest: Nearest) -> None:
    """Halve and double the figures of the search, break its rules; those whose words hold one ``wanted``."""
    counted = {"figures": [0, 0], "rules": [0, 0]}
    for kind, words, module, after in _of_search(wanted, copy_of):
        path = copy_of / module
        start = time.monotonic()
        parts = tuple(nearest.stages(broken_functions(module, path.read_text(encoding="utf-8"), after)))
        if parts and not sum(map(sum, counted.values())):
            _has_to_pass(tests, parts[:1])  # of the first mutant only: those on record have passed
        alive = all(_alive(path, after, part, tests) for part in parts)
        told = "alive" if alive else "killed"
        noticed = "" if alive else f" by {tests.noticed}"
        print(f"{told}: {words} ({module}){noticed} [{time.monotonic() - start:.0f} s]", flush=True)
        counted[kind][0] += not alive
        counted[kind][1] += 1
    for kind, (killed, total) in counted.items():
        print(f"{kind}: {killed} of {total} killed", flush=True)


def _of_search(wanted: Sequence[str], folder: Path) -> Iterator[tuple[str, str, str, str]]:
    """Kind, words, module and changed text of each mutant of the search."""

    def chosen(words: str) -> bool:
        return not wanted or any(one in words for one in wanted)

    for rule in RULES:
        text = (folder / rule.module).read_text(encoding="utf-8")
        if text.count(rule.before) != 1:
            raise SystemExit(f"{rule.module}: not once: {rule.before!r}")
        if chosen(f"{rule.module} {rule.guard}"):
            yield "rules", rule.guard, rule.module, text.replace(rule.before, rule.after)
    for one in FIGURES:
        text = (folder / one.path).read_text(encoding="utf-8")
        if chosen(f"{one.path} {one.name} {one.words}"):
            for how, after in broken(text, one.name):
                yield "figures", f"{one.name} {how}", one.path, after


def _has_to_pass(tests: Tests, wanted: Iterable[tuple[str, ...]]) -> None:
    for arguments in dict.fromkeys(wanted):
        if not tests.pass_(arguments):
            raise SystemExit(f"{' '.join(arguments)}: fails on the clone as it is")


def _alive(path: Path, text: str, arguments: tuple[str, ...], tests: Tests) -> bool:
    before, since = path.read_text(encoding="utf-8"), path.stat().st_mtime_ns
    path.write_text(text, encoding="utf-8")
    alive = tests.pass_(arguments)
    path.write_text(before, encoding="utf-8")
    os.utime(path, ns=(since, since))  # what was compiled of it is good again
    return alive


def _difference(before: str, after: str) -> str:
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    return next((f"{one.strip()}  →  {other.strip()}" for one, other in pairs if one != other), "a line less")


def main() -> None:
    """Draw, break, run, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", choices=[*TARGETS, []], help="all where none is named")
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--list", action="store_true")
    parser.add_argument(
        "--guards", nargs="?", const="", help="broken by hand, those with this in their words"
    )
    parser.add_argument("--search", nargs="*", help="figures and rules of the search, the same")
    parser.add_argument(
        "--nearest", type=Path, nargs="+", help="what benchmarks.mutants_nearest has recorded"
    )
    asked = parser.parse_args()
    if asked.search is not None and asked.nearest is None:
        parser.error("--search needs --nearest: python -m benchmarks.mutants_nearest nearest.json writes it")
    if asked.list:
        print(json.dumps({name: target.modules for name, target in TARGETS.items()}, indent=2))
        return
    with tempfile.TemporaryDirectory(prefix="armhil-mutants-") as folder:
        place = Path(folder) / "clone"
        shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns(".venv*", ".git", "*.pyc", ".*_cache"))
        compileall.compile_dir(place, quiet=2)
        with Tests(place, ROOT.parent / "shared" / "data") as tests:
            if asked.guards is not None:
                run_by_hand("guards", GUARDS, asked.guards, place, tests)
                return
            if asked.search is not None:
                run_search(asked.search, place, tests, Nearest.read(asked.nearest))
                return
            for name in asked.targets or TARGETS:
                killed, survivors = run(name, asked.count, asked.seed, place, tests)
                print(f"{name}: {killed} of {killed + len(survivors)} killed", flush=True)
                for survivor in survivors:
                    print(f"  alive: {survivor}", flush=True)


if __name__ == "__main__":
    main()
