"""NMT states of CiA 301."""

from __future__ import annotations

from enum import IntEnum


class Nmt(IntEnum):
    """NMT states as heartbeats carry them."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127
