"""Checksums of files, the name under which results refer to it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from robots.errors import UserError


class ChecksumError(UserError, ValueError):
    """A recording that cannot be read; one line for the user."""


def file_sha256(path: Path) -> str:
    """Checksum of a whole file, the name under which results refer to a capture."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def source_sha256(path: Path) -> str:
    """Checksum of a recording; of a folder, that of the lines ``<sha256>  <name>`` of its files by name.

    Raises:
        ChecksumError: it cannot be read.
    """
    try:
        if not path.is_dir():
            return file_sha256(path)
        files = sorted(file for file in path.iterdir() if file.is_file())
        lines = "".join(f"{file_sha256(file)}  {file.name}\n" for file in files)
    except OSError as error:
        raise ChecksumError(f"{path}: cannot be read: {error.strerror}") from error
    return hashlib.sha256(lines.encode()).hexdigest()
