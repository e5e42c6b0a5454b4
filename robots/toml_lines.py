"""The line of every key in a TOML text, which ``tomllib`` does not tell.

The text has already been read by ``tomllib``: the scanner below only keeps track of places and trusts the
syntax. A place is a path of keys and list indices, e.g. ``("drive", 2, "node_id")``.
"""

from __future__ import annotations

import re
import tomllib

Path = tuple[str | int, ...]

_BLANK = re.compile(r"[ \t]*")
_BETWEEN = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}(?!")|' r"'''.*?'{3,5}(?!')|" r'"(?:[^"\\\n]|\\.)*"|' r"'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


class TomlLines:
    """Where each key path of a TOML text begins (1-based lines)."""

    def __init__(self, text: str) -> None:
        """Scan a text that ``tomllib`` accepts."""
        self._text = text.replace("\r\n", "\n")
        self._position = 0
        self._counted_to = 0
        self._line = 1
        self._lines: dict[Path, int] = {}
        self._array_lengths: dict[Path, int] = {}
        self._scan()

    def line_of(self, path: Path) -> int:
        """The line of ``path``, or of the innermost table or list around it that is written down."""
        for length in range(len(path), 0, -1):
            if path[:length] in self._lines:
                return self._lines[path[:length]]
        return 1

    def _scan(self) -> None:
        table: Path = ()
        while self._skip(_BETWEEN) < len(self._text):
            if self._text.startswith("[[", self._position):
                table = self._header(2)
            elif self._text.startswith("[", self._position):
                table = self._header(1)
            else:
                self._assignment(table)

    def _header(self, brackets: int) -> Path:
        line = self._current_line()
        self._position += brackets
        keys = self._dotted_key()
        self._position += brackets
        table: Path = ()
        for depth, key in enumerate(keys, start=1):
            table += (key,)
            self._lines.setdefault(table, line)
            if depth == len(keys) and brackets == 2:
                self._array_lengths[table] = self._array_lengths.get(table, 0) + 1
            if table in self._array_lengths:
                table += (self._array_lengths[table] - 1,)
                self._lines.setdefault(table, line)
        # [a.b] may come before [a]: the table's own header is the better place.
        self._lines[table] = line
        return table

    def _assignment(self, table: Path) -> None:
        line = self._current_line()
        path = table
        for key in self._dotted_key():
            path += (key,)
            self._lines.setdefault(path, line)
        self._position += 1  # the equals sign
        self._skip(_BLANK)
        self._value(path)

    def _value(self, path: Path) -> None:
        if self._text.startswith("[", self._position):
            self._array(path)
        elif self._text.startswith("{", self._position):
            self._inline_table(path)
        elif (string := _STRING.match(self._text, self._position)) is not None:
            self._position = string.end()
        else:
            self._skip(_SCALAR)

    def _array(self, path: Path) -> None:
        self._position += 1
        index = 0
        while self._text[self._skip(_BETWEEN)] != "]":
            self._lines[(*path, index)] = self._current_line()
            self._value((*path, index))
            if self._text[self._skip(_BETWEEN)] == ",":
                self._position += 1
            index += 1
        self._position += 1

    def _inline_table(self, path: Path) -> None:
        self._position += 1
        while self._text[self._skip(_BETWEEN)] != "}":
            self._assignment(path)
            if self._text[self._skip(_BETWEEN)] == ",":
                self._position += 1
        self._position += 1

    def _dotted_key(self) -> list[str]:
        keys = []
        while True:
            self._skip(_BLANK)
            if (quoted := _STRING.match(self._text, self._position)) is not None:
                keys.append(str(tomllib.loads(f"key = {quoted.group()}")["key"]))
                self._position = quoted.end()
            else:
                start = self._position
                keys.append(self._text[start : self._skip(_BARE_KEY)])
            self._skip(_BLANK)
            if not self._text.startswith(".", self._position):
                return keys
            self._position += 1

    def _skip(self, pattern: re.Pattern[str]) -> int:
        """Move past what the pattern matches here (maybe nothing) and return the new position."""
        match = pattern.match(self._text, self._position)
        if match is not None:
            self._position = match.end()
        return self._position

    def _current_line(self) -> int:
        self._line += self._text.count("\n", self._counted_to, self._position)
        self._counted_to = self._position
        return self._line


def key_text(path: Path) -> str:
    """A path as people write it, entries of lists counted from 1: ``drive[3].node_id``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part + 1}]"
        else:
            text += f".{part}" if text else part
    return text
