"""Load an arm: a name that ships, the path of a robot.toml, or the folder that holds one."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from robots.allowed import keys_of
from robots.description import Robot
from robots.errors import RobotFileError, ValueNotAllowed
from robots.field_errors import first_error, not_allowed, unknown_key
from robots.finding import find
from robots.identity import description_parts
from robots.plausibility import check_plausible
from robots.toml_lines import TomlLines
from robots.urdf_check import check_urdf

MAX_BYTES = 1_000_000
"""No description comes near this size; a capture or a core dump given by mistake does."""

_PLACE = re.compile(r"(?s)(.*) \(at (?:line (\d+), column (\d+)|end of document)\)\Z")


def load(name_or_path: str | Path, *, known_meshes: dict[str, str] | None = None) -> Robot:
    """Read and check one arm.

    Args:
        name_or_path: a shipped name (``tx40``), the path of a robot.toml, or the folder that holds it.
        known_meshes: where the URDF's meshes are not at hand, as in a capture: name → checksum.

    Raises:
        RobotFileError: one line with file, line, key, value and what is allowed.
    """
    file = find(name_or_path)
    return robot_from_text(_read(file), file, known_meshes=known_meshes)


def robot_from_text(text: str, file: Path, *, known_meshes: dict[str, str] | None = None) -> Robot:
    """The arm that the text of a robot.toml describes; ``file`` places its URDF and names it in errors.

    Raises:
        RobotFileError: as :func:`load`.
    """
    data, given, lines = _parse(text, file)
    for key in sorted(data.keys() & (Robot.model_fields.keys() - set(keys_of(Robot)))):
        # Fields of the model, but for the loader alone to set.
        raise unknown_key((key,), data[key], lines, file)
    try:
        robot = Robot.model_validate(
            given | {"folder": file.parent, "source_text": text, "known_meshes": known_meshes}
        )
    except ValidationError as error:
        raise first_error(error, data, lines, file) from None
    check_urdf(robot, file, lines)
    try:
        check_plausible(robot)
    except ValueNotAllowed as problem:
        raise not_allowed(problem, data, lines, file) from None
    return robot.model_copy(update={"parts": description_parts(robot)})


def _read(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise RobotFileError(file, f"cannot be read: {error.strerror}") from None
    if len(content) > MAX_BYTES:
        raise RobotFileError(file, f"larger than {MAX_BYTES} bytes", allowed="a robot description in TOML")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = f"byte 0x{content[error.start]:02x} is not UTF-8 text"
        raise RobotFileError(file, problem, line=line, allowed="a robot description in TOML") from None


def _parse(text: str, file: Path) -> tuple[dict[str, Any], dict[str, Any], TomlLines]:
    """What the file says, the same with tuples for lists, and where it says it."""
    try:
        data = tomllib.loads(text)
        return data, {key: _with_tuples(value) for key, value in data.items()}, TomlLines(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(str(error), text, file) from None
    except RecursionError:
        raise RobotFileError(file, "not TOML: lists nested too deeply") from None
    except ValueError as error:
        # Python refuses to convert a number of thousands of digits.
        raise RobotFileError(file, f"not TOML: {error}") from None


def _syntax_error(message: str, text: str, file: Path) -> RobotFileError:
    rows = text.split("\n")
    place = _PLACE.match(message)
    if place is None:
        return RobotFileError(file, f"not TOML: {message}")
    line = int(place[2]) if place[2] else len(rows)
    column = f" at column {place[3]}" if place[3] else " at the end of the file"
    written = rows[line - 1].strip()
    quoted = f" in: {written[:60]}" if written else ""
    return RobotFileError(file, f"not TOML: {place[1]}{column}{quoted}", line=line)


def _with_tuples(value: Any) -> Any:
    """TOML's lists as tuples: the models are strict and take nothing else for a frozen value."""
    if isinstance(value, list):
        return tuple(_with_tuples(entry) for entry in value)
    if isinstance(value, dict):
        return {key: _with_tuples(entry) for key, entry in value.items()}
    return value
