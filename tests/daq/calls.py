"""The type of what the fixture ``armhil`` gives."""

from __future__ import annotations

import re
from collections.abc import Callable

Call = Callable[..., tuple[int, str, str]]
"""Calls the command line with these words: exit code, stdout, stderr."""

SEE = re.compile(r"; see `armhil [a-z -]*--help`$", re.MULTILINE)
"""What a refusal ends with that names no other command."""
COMMAND = re.compile(r"`[^` ]+ [^`]+`|: (\./)?armhil [a-z-]+| -m pip install ")
"""A whole command in a refusal."""
