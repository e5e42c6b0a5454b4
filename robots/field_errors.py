"""From what pydantic found wrong to the one line that a user can act on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from robots.allowed import allowed_at, keys_of, table_at
from robots.description import Robot
from robots.errors import RobotFileError, ValueNotAllowed, shown
from robots.nearest import did_you_mean
from robots.toml_lines import Path, TomlLines, key_text

_TYPE_WORDS = {
    "float_type": "is not a number",
    "finite_number": "is not a finite number",
    "int_type": "is not a whole number",
    "string_type": "is not a text in quotes",
    "bool_type": "is neither true nor false",
    "tuple_type": "is not a list",
    "model_type": "is not a table",
    "too_long": "has too many entries",
    "too_short": "has too few entries",
    "greater_than": "is too small",
    "greater_than_equal": "is too small",
    "less_than": "is too large",
    "less_than_equal": "is too large",
    "literal_error": "is not one of the choices",
    "string_pattern_mismatch": "is not spelled as it must be",
    "string_too_short": "is too short",
}


@dataclass(frozen=True)
class _Finding:
    path: Path
    line: int
    problem: str
    allowed: str
    missing: bool = False


def first_error(
    error: ValidationError, data: dict[str, Any], lines: TomlLines, file: FilePath
) -> RobotFileError:
    """The first thing wrong in the file, in the order of its lines; missing keys come last.

    A misspelt key is both an unknown key and a missing one: the unknown one says more.
    """
    every = [_finding(entry, data, lines) for entry in error.errors(include_url=False)]
    # A list whose entries are wrong counts as too short as well: the entries say more.
    findings = [f for f in every if not any(_lies_below(other.path, f.path) for other in every)]
    first, *others = sorted(findings, key=lambda finding: (finding.missing, finding.line))
    more = f" (and {len(others)} more)" if others else ""
    return RobotFileError(
        file, first.problem + more, line=first.line, key=key_text(first.path), allowed=first.allowed
    )


def _lies_below(path: Path, above: Path) -> bool:
    return len(path) > len(above) and path[: len(above)] == above


def unknown_key(path: Path, value: object, lines: TomlLines, file: FilePath) -> RobotFileError:
    """The error for a key that no file may give."""
    finding = _unknown_key(path, value, lines)
    return RobotFileError(
        file, finding.problem, line=finding.line, key=key_text(path), allowed=finding.allowed
    )


def not_allowed(
    problem: ValueNotAllowed, data: dict[str, Any], lines: TomlLines, file: FilePath
) -> RobotFileError:
    """The error for a value that does not go with the others."""
    path = problem.path
    text = f"{shown(_value_at(data, path))} {problem.problem}"
    return RobotFileError(file, text, line=lines.line_of(path), key=key_text(path), allowed=problem.allowed)


def _finding(entry: Any, data: dict[str, Any], lines: TomlLines) -> _Finding:
    path: Path = tuple(entry["loc"])
    kind = entry["type"]
    cause = entry.get("ctx", {}).get("error")
    if kind == "missing":
        return _Finding(path, lines.line_of(path), _missing(path), allowed_at(Robot, path), missing=True)
    if kind == "extra_forbidden":
        return _unknown_key(path, entry["input"], lines)
    if isinstance(cause, ValueNotAllowed):
        path = (*path, *cause.path)
        problem = f"{shown(_value_at(data, path))} {cause.problem}"
        return _Finding(path, lines.line_of(path), problem, cause.allowed or allowed_at(Robot, path))
    words = _TYPE_WORDS.get(kind, f"is not allowed ({entry['msg']})")
    return _Finding(path, lines.line_of(path), f"{shown(entry['input'])} {words}", allowed_at(Robot, path))


def _missing(path: Path) -> str:
    table = path[:-1]
    return f"missing from {key_text(table)}" if table else "missing"


def _unknown_key(path: Path, value: object, lines: TomlLines) -> _Finding:
    table = table_at(Robot, path[:-1]) or Robot
    keys = keys_of(table)
    return _Finding(
        path,
        lines.line_of(path),
        f"{shown(value)} is given to a key that does not exist{did_you_mean(str(path[-1]), keys)}",
        ", ".join(keys),
    )


def _value_at(data: Any, path: Path) -> object:
    """What the file gives at ``path``; a key that is left to its default has no value to show."""
    for part in path:
        if isinstance(data, dict) and part not in data:
            return "(default)"
        data = data[part]
    return data
