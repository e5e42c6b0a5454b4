"""Plain values as TOML text; Python reads TOML but does not write it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_ESCAPES = {'"': '\\"', "\\": "\\\\", "\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r"}


class TomlTextError(ValueError):
    """A value that TOML has no form for."""


def toml_text(table: Mapping[str, Any]) -> str:
    """A table as TOML: its plain values, then its tables, then its lists of tables.

    Floats keep every digit. Keys whose value is None are left out. Tables below the first level are
    written inline.

    Raises:
        TomlTextError: a value that is no text, number, truth value, list of these, or table of them.
    """
    plain = {key: value for key, value in table.items() if not _is_nested(value)}
    blocks = [_assignments(plain)]
    for key, value in table.items():
        if isinstance(value, Mapping):
            blocks.append(f"[{_key(key)}]\n{_assignments(value)}")
        elif _is_nested(value):
            blocks.extend(f"[[{_key(key)}]]\n{_assignments(entry)}" for entry in value)
    return "\n".join(block for block in blocks if block)


def _is_nested(value: Any) -> bool:
    if isinstance(value, Mapping):
        return True
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _assignments(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items() if value is not None)


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _string(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(float(value))  # nan, inf, 1.0 and 1e-07 are TOML as Python writes them
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key(key)} = {_value(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, bytes):
        return f"[{', '.join(_value(entry) for entry in value)}]"
    raise TomlTextError(f"{type(value).__name__} has no form in TOML")


def _string(text: str) -> str:
    escaped = "".join(_escaped(character) for character in text)
    return f'"{escaped}"'


def _escaped(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    if ord(character) < 0x20 or ord(character) == 0x7F:
        return f"\\u{ord(character):04X}"
    if 0xD800 <= ord(character) <= 0xDFFF:
        raise TomlTextError("a text with half a surrogate pair has no form in TOML")
    return character
