"""Raw CAN frames as arrays: what a listener hands over and what a capture holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from daq.recording import messages
from daq.recording.mcap_file import Rows
from robots.arrays import BoolArray, IntArray


@dataclass(frozen=True)
class Frames:
    """N classical CAN frames in the order of their arrival."""

    stamp: IntArray
    """(N,) ns since the epoch, when this machine received the frame."""
    can_id: NDArray[np.uint32]
    """(N,) 11 or 29 bits; of an error frame the class of the error."""
    is_rtr: BoolArray
    is_extended: BoolArray
    is_error: BoolArray
    """(N,) true for a report of this machine's controller, which was never on the wire."""
    dlc: NDArray[np.uint8]
    data: NDArray[np.uint8]
    """N × 8; bytes beyond ``dlc`` are 0."""

    def __len__(self) -> int:
        return len(self.stamp)

    @classmethod
    def empty(cls, count: int = 0) -> Self:
        """Data frames that are all 0."""
        return cls(
            stamp=np.zeros(count, dtype=np.int64),
            can_id=np.zeros(count, dtype=np.uint32),
            is_rtr=np.zeros(count, dtype=np.bool_),
            is_extended=np.zeros(count, dtype=np.bool_),
            is_error=np.zeros(count, dtype=np.bool_),
            dlc=np.zeros(count, dtype=np.uint8),
            data=np.zeros((count, 8), dtype=np.uint8),
        )

    @classmethod
    def concatenate(cls, batches: Sequence[Frames]) -> Self:
        """One batch of several; empty where there is none."""
        if not batches:
            return cls.empty()
        return cls(*(np.concatenate([getattr(b, f.name) for b in batches]) for f in fields(cls)))

    def select(self, rows: NDArray[np.intp] | BoolArray) -> Frames:
        """The given rows."""
        return Frames(*(getattr(self, f.name)[rows] for f in fields(Frames)))

    def rows(self) -> Rows:
        """The frames as ``can_msgs/Frame`` messages, N × size."""
        columns = {
            "id": self.can_id,
            "is_rtr": self.is_rtr,
            "is_extended": self.is_extended,
            "is_error": self.is_error,
            "dlc": self.dlc,
            "data": self.data,
        }
        return _layout().rows(self.stamp, columns)

    @classmethod
    def of_rows(cls, rows: Rows) -> Self | None:
        """The inverse of :meth:`rows`; None where they are no such messages."""
        found = _layout().decode(rows)
        if found is None:
            return None
        return cls(
            stamp=found["sec"].astype(np.int64) * 1_000_000_000 + found["nanosec"],
            can_id=found["id"].copy(),
            is_rtr=found["is_rtr"].copy(),
            is_extended=found["is_extended"].copy(),
            is_error=found["is_error"].copy(),
            dlc=found["dlc"].copy(),
            data=found["data"].copy(),
        )


@cache
def _layout() -> messages.Layout:
    return messages.frame_layout()
