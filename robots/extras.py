"""Parts that are installed only where they are wanted, and the command that installs one."""

from __future__ import annotations

import shlex
import sys


def install_command(extra: str) -> str:
    """What to type, whole: into the environment that runs now, whichever is active in the shell.

    Args:
        extra: as in pyproject.toml, e.g. ``parquet``.
    """
    return shlex.join([sys.executable, "-m", "pip", "install", f"armhil[{extra}]"])
