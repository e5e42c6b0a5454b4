"""What deadlines were missed for.

This process was woken late, drives answered late, it worked long, or its work was interrupted: a process
above it or the host of a virtual machine had the processor.
"""

from __future__ import annotations

WOKEN, ANSWERS, WORK = "woken late", "waiting for drives", "own work"
INTERRUPTED = "work interrupted"


class Delays:
    """Counts missed deadlines by what kept the process from them."""

    def __init__(self) -> None:
        self.missed = dict.fromkeys((WOKEN, ANSWERS, WORK, INTERRUPTED), 0)
        """Deadlines, by cause."""

    def note(self, missed: int, overrun: float, answers_after_deadline: bool, interrupted: float) -> None:
        """Some deadlines were missed.

        Args:
            missed: how many.
            overrun: s by which the first of them was gone before this process began to wait for it.
            answers_after_deadline: the answers to the SYNC before were complete, or given up, only after it.
            interrupted: s since those answers in which this thread had no processor. It neither sleeps nor
                waits there, so without them it would have begun to wait that much earlier.
        """
        if overrun <= 0.0:
            cause = WOKEN
        elif answers_after_deadline:
            cause = ANSWERS
        else:
            cause = WORK if overrun > interrupted else INTERRUPTED
        self.missed[cause] += missed

    def words(self) -> str:
        """For people; empty where none was missed."""
        told = [f"{count} {cause}" for cause, count in self.missed.items() if count]
        return f"deadlines missed: {', '.join(told)}" if told else ""
