"""The base of all errors that a user can cause, and the one that a robot description can."""

from __future__ import annotations

from pathlib import Path

MAX_VALUE_LENGTH = 60


class UserError(Exception):
    """Something that a user can cause and mend; ``str()`` says in one line what is wrong and what is allowed.

    Every exception that the five packages raise for their user stands on this one, so the command line
    catches it alone. Anything else that reaches it, or one arm of a night, is a mistake of armhil's own.
    """

    def __reduce__(self) -> tuple[object, ...]:
        """Out of another process as it was, whatever its ``__init__`` asks for."""
        return _again, (type(self), self.args), self.__dict__


def _again(kind: type[UserError], words: tuple[object, ...]) -> UserError:
    return kind.__new__(kind, *words)


class RobotFileError(UserError):
    """A robot cannot be loaded. ``str()`` is one line: ``file:line: key: value …; allowed: …``."""

    def __init__(
        self,
        file: Path | str,
        problem: str,
        *,
        line: int | None = None,
        key: str = "",
        allowed: str = "",
    ) -> None:
        self.file = str(file)
        self.line = line
        self.key = key
        self.allowed = allowed
        where = self.file if line is None else f"{self.file}:{line}"
        parts = [where, key, problem] if key else [where, problem]
        text = ": ".join(parts) + (f"; allowed: {allowed}" if allowed else "")
        super().__init__(one_line(text))


class ValueNotAllowed(ValueError):
    """Raised inside a model's validator: which key below the model is wrong, how, and what is allowed."""

    def __init__(self, path: tuple[str | int, ...], problem: str, allowed: str = "") -> None:
        self.path = path
        self.problem = problem
        self.allowed = allowed
        super().__init__(f"{path}: {problem}; allowed: {allowed}")


def one_line(text: str) -> str:
    """The text with every run of white space and unprintable characters made one space."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(printable.split())


LONGEST_LINE = 400
"""Characters of what is quoted from elsewhere: a hostile file makes messages of its own length."""


def shortened(error: object) -> str:
    """What another library says, in one line of bearable length."""
    text = one_line(str(error)[: 2 * LONGEST_LINE])
    return text if len(text) <= LONGEST_LINE else text[: LONGEST_LINE - 1] + "…"


def bearable(text: str) -> str:
    """One line of bearable length: of a longer one its beginning, and its end, where the remedy stands."""
    text = one_line(text)
    if len(text) <= LONGEST_LINE:
        return text
    begin, gap = 2 * LONGEST_LINE // 3, " … "
    return text[:begin] + gap + text[begin + len(gap) - LONGEST_LINE :]


def shown(value: object, depth: int = 0) -> str:
    """A value as TOML would write it, shortened so that it fits in a line."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) >= 10**20:
        text = hex(value)  # Python refuses to write out a number of thousands of decimal digits
    elif isinstance(value, dict):
        text = "a table"
    elif isinstance(value, list | tuple):
        text = "[…]" if depth > 2 else f"[{', '.join(shown(item, depth + 1) for item in value[:20])}]"
    elif isinstance(value, str):
        text = f'"{value}"'
    else:
        text = str(value)
    return text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 1] + "…"
