"""What deadlines were missed for: this process was woken late, drives answered late, or it worked long."""

from __future__ import annotations

WOKEN, ANSWERS, WORK = "woken late", "waiting for drives", "own work"


class Delays:
    """Counts missed deadlines by what kept the process from them."""

    def __init__(self) -> None:
        self.missed = dict.fromkeys((WOKEN, ANSWERS, WORK), 0)
        """Deadlines, by cause."""

    def note(self, missed: int, overrun: float, answers_after_deadline: bool) -> None:
        """Some deadlines were missed.

        Args:
            missed: how many.
            overrun: s by which the first of them was gone before this process began to wait for it.
            answers_after_deadline: the answers to the SYNC before were complete, or given up, only after it.
        """
        cause = WOKEN if overrun <= 0.0 else ANSWERS if answers_after_deadline else WORK
        self.missed[cause] += missed

    def words(self) -> str:
        """For people; empty where none was missed."""
        told = [f"{count} {cause}" for cause, count in self.missed.items() if count]
        return f"deadlines missed: {', '.join(told)}" if told else ""
