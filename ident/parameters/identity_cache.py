"""Answers to what was asked last, by identity, since many effects ask for the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Value = TypeVar("Value")


@dataclass(frozen=True)
class IdentityCache(Generic[Value]):
    """The last few answers, by the very object that was asked about.

    Attributes:
        most: answers that are kept.
    """

    most: int = 4
    _answers: list[tuple[object, Value]] = field(default_factory=list, repr=False, compare=False)

    def of(self, asked: object, make: Callable[[], Value]) -> Value:
        """The answer to ``asked``, made where it is not kept."""
        for about, answer in self._answers:
            if about is asked:
                return answer
        answer = make()
        self._answers[:] = [*self._answers, (asked, answer)][-self.most :]
        return answer
