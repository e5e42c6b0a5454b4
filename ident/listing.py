"""Names in a message: as many as fit into a line."""

from __future__ import annotations

from collections.abc import Sequence

SHOWN = 3
"""Names that a message shows where there are many."""

_FEW = 6
"""So many are not yet many."""


def listed(names: Sequence[str], few: int = _FEW) -> str:
    """All of a few names; of many the first three, and how many more there are."""
    if len(names) <= few:
        return ", ".join(names)
    return f"{', '.join(names[:SHOWN])} and {len(names) - SHOWN} more"
