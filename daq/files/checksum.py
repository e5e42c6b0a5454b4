"""Checksum of a file, the name under which results refer to it."""

from __future__ import annotations

import hashlib
from pathlib import Path


def file_sha256(path: Path) -> str:
    """Checksum of a whole file, the name under which results refer to a capture."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
