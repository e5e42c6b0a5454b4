"""Which drives have answered a SYNC, and which have answered it more than once.

A TPDO is a sample only where it is the one TPDO of its drive between two SYNCs: of two nobody knows which is
the drive's. Two come where two nodes have one id, where something else sends in a drive's name, and where an
answer is late. A late one is missed at its own SYNC first, so it is told apart from the others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from drivers.frames.layout import DriveLink

DOUBLES_FORGIVEN = 2
"""SYNCs that a drive may answer twice under torque: CAN itself repeats a frame whose last bit was disturbed
at its sender alone (inconsistent message duplicates; Rufino et al., FTCS 1998)."""
DOUBLES_WITHIN = 1000
"""SYNCs in which one more than that ends the stream."""


class Answers:
    """Answers of all drives between two SYNCs.

    Args:
        links: the drives in the order of the axes.
        parts: per axis, how many TPDOs make an answer.
    """

    def __init__(self, links: Sequence[DriveLink], parts: Sequence[int]) -> None:
        n = len(links)
        self.complete = [False] * n
        """Drives that have answered the latest SYNC; always the same list."""
        self.missing = n
        """How many have not."""
        self.doubtful = False
        """Whether some drive sent more than its answer between the two SYNCs before."""
        self.doubled = [False] * n
        """Drives that did."""
        self.swapped = [False] * n
        """Those of them that owed no late answer: SYNCs before may have got the wrong one, too."""
        self.twice = [0] * n
        """SYNCs so far of which that is true."""
        self.odd_sizes: list[Counter[int]] = [Counter() for _ in links]
        """TPDOs of another length than mapped, by their length."""
        self.forgiven = 0
        """SYNCs out of DOUBLES_WITHIN that may be answered twice; none before there is torque."""
        self._links = links
        self._whole = [(1 << count) - 1 for count in parts]
        self._parts = [0] * n
        self._extra = [0] * n
        self._has_extra = False
        self._owed = [0] * n
        self._owes = False
        self.syncs = 0
        """How many there have been."""
        self._when: list[list[int]] = [[] for _ in links]
        self._nothing, self._zeros = (False,) * n, (0,) * n

    def part(self, axis: int, part: int) -> None:
        """One of a drive's several TPDOs has come.

        Args:
            axis: whose.
            part: its bit: 1, 2, 4 …
        """
        if self._parts[axis] & part:
            self.again(axis)
            return
        self._parts[axis] |= part
        if self._parts[axis] == self._whole[axis]:
            self.complete[axis] = True
            self.missing -= 1

    def again(self, axis: int) -> None:
        """A TPDO has come that had come before."""
        self._extra[axis] += 1
        self._has_extra = True

    def odd_size(self, axis: int, size: int) -> None:
        """A TPDO has come that is longer or shorter than it was mapped: no answer, but something was said."""
        self.odd_sizes[axis][size] += 1
        self.again(axis)

    def close(self, *, lost: bool = False) -> str | None:
        """Judge what came since the SYNC before, and begin anew: the next SYNC is about to be sent.

        Args:
            lost: whether frames were lost on this side. Any drive's may be among them, and what came may be
                what something else sent in its place, so no answer of late is believed.

        Returns:
            Why the bus cannot be relied on: two nodes with one id; None where nothing speaks for that.
        """
        failure = None
        if self.missing or self._has_extra or self._owes or self.doubtful or lost:
            failure = self._judge() if self.syncs else None
            if lost:
                self.doubtful, everyone = True, [True] * len(self._links)
                self.doubled, self.swapped = everyone, everyone
            self._extra[:] = self._zeros
            self._has_extra = False
        self.syncs += 1
        self.complete[:] = self._nothing
        self._parts[:] = self._zeros
        self.missing = len(self._links)
        return failure

    def _judge(self) -> str | None:
        failure = None
        self.doubled = [extra > 0 for extra in self._extra]
        self.swapped = list(self._nothing)
        self.doubtful = self._has_extra
        for axis, (complete, extra) in enumerate(zip(self.complete, self._extra, strict=True)):
            owed = self._owed[axis]
            if not complete:
                self._owed[axis] = owed + 1
                continue
            self._owed[axis] = 0
            if extra > owed:
                self.swapped[axis] = True
                failure = failure or self._note_twice(axis)
        self._owes = any(self._owed)
        return failure

    def _note_twice(self, axis: int) -> str | None:
        self.twice[axis] += 1
        when = self._when[axis] = [k for k in self._when[axis] if self.syncs - k < DOUBLES_WITHIN]
        when.append(self.syncs)
        if len(when) <= self.forgiven:
            return None
        link, times = self._links[axis], "once" if len(when) == 1 else f"{len(when)} times"
        return f"two nodes with id {link.node}: {link.name} has answered one SYNC twice, {times}"

    def words(self) -> tuple[str, ...]:
        """For people: what drives said more than once, or in another length."""
        found = []
        for link, twice, sizes in zip(self._links, self.twice, self.odd_sizes, strict=True):
            if twice:
                found.append(f"{link.name} answered {twice} SYNCs more than once: they are incomplete")
            found += [
                f"{link.name} sent {count} TPDOs of {size} bytes, another length than mapped: no samples"
                for size, count in sorted(sizes.items())
            ]
        return tuple(found)
