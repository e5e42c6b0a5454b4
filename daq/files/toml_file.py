"""Read a TOML file into a frozen model; what is wrong with it becomes one line that a user can act on."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from robots.allowed import allowed_at
from robots.errors import ValueNotAllowed, one_line, shown
from robots.toml_lines import TomlLines, key_text

MAX_BYTES = 16_000_000

Model = TypeVar("Model", bound=BaseModel)


def read_toml(path: Path, model: type[Model], error: type[Exception], *, kind: str) -> Model:
    """Read and check one file.

    Args:
        path: the file.
        model: what it must be.
        error: the exception of the calling package.
        kind: what the file is, in words, e.g. ``a column map``.

    Raises:
        error: one line with file, line, key, value and what is allowed.
    """
    text = _text(path, error, kind)
    try:
        content = tomllib.loads(text)
        lines = TomlLines(text)
    except (ValueError, RecursionError) as problem:
        # Besides bad syntax: a number of thousands of digits, lists nested too deeply.
        raise error(one_line(f"{path}: not TOML: {problem}; allowed: {kind}")) from None
    try:
        return model.model_validate(with_tuples(content))
    except ValidationError as problem:
        raise error(validation_line(path, problem, model, lines)) from None


def with_tuples(value: Any) -> Any:
    """TOML's lists as tuples: strict models take nothing else for a frozen value."""
    if isinstance(value, list):
        return tuple(with_tuples(entry) for entry in value)
    if isinstance(value, dict):
        return {key: with_tuples(entry) for key, entry in value.items()}
    return value


def _text(path: Path, error: type[Exception], kind: str) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise error(f"{path}: no such file; allowed: {kind}") from None
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror}; allowed: {kind}") from None
    if len(content) > MAX_BYTES:
        raise error(f"{path}: larger than {MAX_BYTES} bytes; allowed: {kind}")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error(f"{path}: not UTF-8 text; allowed: {kind}") from None


def validation_line(
    path: Path | str,
    problem: ValidationError,
    model: type[BaseModel],
    lines: TomlLines | None = None,
    under: tuple[str, ...] = (),
) -> str:
    """One line on the first thing that pydantic found wrong.

    Args:
        path: the file, or what else was checked.
        problem: what pydantic says.
        model: the model it was checked against.
        lines: of the file, where there is a place to name.
        under: the keys above the model in the file.
    """
    # A misspelt key is both an unknown one and a missing one: the unknown one says more.
    found = problem.errors(include_url=False)
    first, *others = sorted(found, key=lambda entry: entry["type"] == "missing")
    key, words, allowed = _finding(first, model)
    place = f"{path}:{lines.line_of((*under, *key))}" if lines is not None else str(path)
    more = f" (and {len(others)} more)" if others else ""
    parts = [part for part in (place, key_text((*under, *key)), words + more) if part]
    return one_line(": ".join(parts) + (f"; allowed: {allowed}" if allowed else ""))


def _finding(entry: Any, model: type[BaseModel]) -> tuple[tuple[str | int, ...], str, str]:
    """The key, what is wrong with it, and what is allowed (empty where the words say it)."""
    key: tuple[str | int, ...] = tuple(entry["loc"])
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, ValueNotAllowed):
        value = "" if cause.path else f"{shown(entry['input'])} "
        key = (*key, *cause.path)
        return key, value + cause.problem, cause.allowed or allowed_at(model, key)
    if entry["type"] == "value_error":
        return key, entry["msg"].removeprefix("Value error, "), ""
    if entry["type"] == "missing":
        return key, "missing", allowed_at(model, key)
    if entry["type"] == "extra_forbidden":
        keys = allowed_at(model, key[:-1]).removeprefix("a table with ")
        return key, f"{shown(entry['input'])} is given to a key that does not exist", keys
    return key, f"{shown(entry['input'])} is not allowed", allowed_at(model, key)
