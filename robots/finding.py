"""Where an arm's description is; alone here, so that a name that does not exist is refused at once."""

from __future__ import annotations

from pathlib import Path

from robots.errors import RobotFileError
from robots.nearest import did_you_mean

FILE_NAME = "robot.toml"


def shipped() -> tuple[str, ...]:
    """The names of the arms that come with the package, sorted."""
    here = Path(__file__).parent
    return tuple(sorted(folder.parent.name for folder in here.glob(f"*/{FILE_NAME}")))


def find(name_or_path: str | Path) -> Path:
    """The robot.toml that a name or a path stands for.

    Args:
        name_or_path: a shipped name, the path of a robot.toml, or the folder that holds it.

    Raises:
        RobotFileError: there is none.
    """
    names = shipped()
    text = str(name_or_path)
    if text in names:
        return Path(__file__).parent / text / FILE_NAME
    path = Path(name_or_path)
    allowed = f"{', '.join(names)}, the path of a {FILE_NAME} or of its folder"
    try:
        if path.is_dir():
            if (path / FILE_NAME).is_file():
                return path / FILE_NAME
            raise RobotFileError(path, f"a folder without {FILE_NAME}", allowed=allowed)
        if path.is_file():
            return path
        there = path.exists()
    except OSError as error:
        raise RobotFileError(path, f"cannot be read: {error.strerror}", allowed=allowed) from None
    if there:
        raise RobotFileError(path, "not a file", allowed=allowed)
    raise RobotFileError(
        path, f"no robot of this name, no such file{did_you_mean(text, names)}", allowed=allowed
    )
