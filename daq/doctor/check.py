"""One thing that ``armhil doctor`` looked at, and what the worst of them means for the exit code."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Status = Literal["ok", "warning", "failed", "unknown"]
CODES: dict[Status, int] = {"ok": 0, "warning": 1, "failed": 2, "unknown": 3}
"""Exit codes; the worst check decides, and failed is worse than unknown."""
_RANK: dict[Status, int] = {"ok": 0, "warning": 1, "unknown": 2, "failed": 3}


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: of the check.
        status: what it found.
        detail: in words.
        remedy: what to do; empty where nothing is to be done.
    """

    name: str
    status: Status
    detail: str
    remedy: str = ""


def worst(checks: Iterable[Check]) -> Status:
    """The status that decides."""
    return max((check.status for check in checks), key=lambda status: _RANK[status], default="ok")
