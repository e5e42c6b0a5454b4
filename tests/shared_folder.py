"""Folders that one worker fills and all of them use."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest


def shared_folder(factory: pytest.TempPathFactory, name: str, fill: Callable[[Path], None]) -> Path:
    """A folder of this run of the tests, filled by the worker that asks first; the others wait for it.

    Args:
        factory: of pytest.
        name: of the folder; one name stands for one content.
        fill: is given the folder, which is new and empty. Where it raises, the next worker tries again.
    """
    base = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    filled = base / f"{name}.filled"
    with (base / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not filled.exists():
            folder = factory.mktemp(name)
            fill(folder)
            filled.write_text(str(folder))
        return Path(filled.read_text())
