"""Who imports whom, file by file, read from the source: also within functions and for type hints alone."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path


def modules(root: Path, packages: tuple[str, ...]) -> dict[str, Path]:
    """Dotted name of every file of the packages; a package's own name stands for its ``__init__.py``."""
    named = {}
    for file in (found for package in packages for found in (root / package).rglob("*.py")):
        parts = file.relative_to(root).with_suffix("").parts
        named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return named


def import_graph(files: Mapping[str, Path]) -> dict[str, set[str]]:
    """The files that each file names in an import."""
    return {name: _imported(file, set(files)) - {name} for name, file in files.items()}


def _imported(file: Path, known: set[str]) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{file}: a relative import"
            module = node.module or ""
            found |= {f"{module}.{a.name}" if f"{module}.{a.name}" in known else module for a in node.names}
    return found & known


def within(graph: Mapping[str, set[str]], package: str) -> dict[str, set[str]]:
    """The same between the rooms (files and folders) right inside a package; '' for the packages."""
    inside = f"{package}." if package else ""
    depth = inside.count(".") + 1

    def room(name: str) -> str:
        return ".".join(name.split(".")[:depth])

    rooms: dict[str, set[str]] = {}
    for name, imported in graph.items():
        if name.startswith(inside):
            others = {room(other) for other in imported if other.startswith(inside)}
            rooms.setdefault(room(name), set()).update(others - {room(name)})
    return rooms


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """One circle, first and last the same; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []
