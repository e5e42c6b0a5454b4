"""Does a test notice? Break one thing after the other in a module, and run the tests that should see it.

    python -m benchmarks.mutants                        # all targets, 12 mutants each
    python -m benchmarks.mutants exogeneity --count 40  # one of them
    python -m benchmarks.mutants --list

The clone is copied to a temporary folder; each mutant is one change of the syntax tree of one module there
(a comparison turned, a sign or an operation changed, a number moved by one, `abs`, `min`, `max` or `not`
taken away, a condition held true, a call for its effect left out). A mutant is killed where the tests of its
target fail or do not end. What is drawn is drawn with a seed. Survivors are printed with file, line, change.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIMIT = 300.0
"""s; tests that take longer on a mutant have noticed it."""


@dataclass(frozen=True)
class Target:
    """Modules, and the tests that should notice what breaks in them."""

    modules: tuple[str, ...]
    tests: tuple[str, ...]


TARGETS = {
    "exogeneity": Target(
        (
            "ident/exogeneity/textbook.py",
            "ident/exogeneity/augmented.py",
            "ident/exogeneity/relevance.py",
            "ident/exogeneity/hypothesis.py",
        ),
        ("tests/ident/test_exogeneity.py", "tests/ident/test_instrument_tests.py"),
    ),
    "gates": Target(
        ("ident/exogeneity/instruments.py", "ident/exogeneity/rank.py", "ident/exogeneity/revised.py"),
        ("tests/ident/test_exogeneity.py", "tests/ident/test_gate_one.py"),
    ),
    "estimators": Target(
        (
            "ident/estimators/least_squares.py",
            "ident/estimators/instrumental.py",
            "ident/estimators/robust.py",
            "ident/estimators/biweight.py",
            "ident/estimators/huber.py",
        ),
        ("tests/ident/test_estimators.py", "tests/ident/test_robust.py"),
    ),
    "covariances": Target(
        (
            "ident/covariances/hac.py",
            "ident/covariances/cluster.py",
            "ident/covariances/independent.py",
            "ident/statistics/covariance.py",
            "ident/statistics/whitening.py",
        ),
        ("tests/ident/test_covariances.py", "tests/ident/test_whitening.py"),
    ),
    "base": Target(("ident/parameters/base.py",), ("tests/ident/test_base.py",)),
    "decimation": Target(("ident/signals.py",), ("tests/ident/test_signals.py",)),
    "units": Target(("drivers/frames/units.py",), ("tests/drivers/test_units.py",)),
    "states": Target(("drivers/cia402/states.py",), ("tests/drivers/test_states.py",)),
    "ramps": Target(("drivers/cyclic/ramp.py",), ("tests/drivers/motion",)),
    "drift": Target(
        ("ident/drift/wald.py", "ident/drift/geometry.py", "ident/drift/run_to_run.py"),
        ("tests/ident/drift",),
    ),
}

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
    decorators = {
        id(inside)
        for node in ast.walk(tree)
        for decorator in getattr(node, "decorator_list", [])
        for inside in ast.walk(decorator)
    }
    for place, node in enumerate(ast.walk(tree)):
        change = None if id(node) in decorators else _change(node)
        if change is not None:
            yield getattr(node, "lineno", 0), _at(place, change)


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


def run(name: str, target: Target, count: int, seed: int, copy_of: Path) -> tuple[int, list[str]]:
    """Killed mutants of a target and its survivors in words."""
    drawn = []
    for module in target.modules:
        tree = ast.parse((ROOT / module).read_text(encoding="utf-8"))
        drawn += [(module, tree, line, change) for line, change in mutants(tree)]
    random.Random(f"{seed} {name}").shuffle(drawn)
    if not passes(target, copy_of):
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
        alive = passes(target, copy_of)
        shutil.copy(ROOT / module, path)
        if alive:
            survivors.append(f"{module}:{line}: {_difference(before, after)}")
            print(f"alive: {survivors[-1]}", file=sys.stderr, flush=True)
        killed += not alive
    return killed, survivors


def _difference(before: str, after: str) -> str:
    pairs = zip(before.splitlines(), after.splitlines(), strict=False)
    return next((f"{one.strip()}  →  {other.strip()}" for one, other in pairs if one != other), "a line less")


def passes(target: Target, folder: Path) -> bool:
    """Do the tests of a target pass in that copy of the clone?"""
    command = [
        sys.executable,
        "-P",
        "-m",
        "pytest",
        "-x",
        "-q",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        *target.tests,
    ]
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
    }
    environment.setdefault("ARMHIL_DATA", str(ROOT.parent / "shared" / "data"))
    try:
        ended = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return ended.returncode == 0


def main() -> None:
    """Draw, break, run, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", choices=[*TARGETS, []], help="all where none is named")
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--list", action="store_true")
    asked = parser.parse_args()
    if asked.list:
        print(json.dumps({name: target.modules for name, target in TARGETS.items()}, indent=2))
        return
    with tempfile.TemporaryDirectory(prefix="armhil-mutants-") as folder:
        place = Path(folder) / "clone"
        shutil.copytree(
            ROOT, place, ignore=shutil.ignore_patterns(".venv*", ".git", "__pycache__", ".*_cache")
        )
        for name in asked.targets or TARGETS:
            killed, survivors = run(name, TARGETS[name], asked.count, asked.seed, place)
            print(f"{name}: {killed} of {killed + len(survivors)} killed", flush=True)
            for survivor in survivors:
                print(f"  alive: {survivor}", flush=True)


if __name__ == "__main__":
    main()
