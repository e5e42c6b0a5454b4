"""Answers to what was asked last, by identity, since many effects ask for the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from operator import is_
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


@dataclass(frozen=True)
class IdentityCache(Generic[Value]):
    """The answers that were asked for last, by the very object that was asked about.

    Attributes:
        most: answers that are kept.
        same: of two that were asked about; by default, whether they are one object.
    """

    most: int = 4
    same: Callable[[Any, Any], bool] = is_
    _answers: list[tuple[object, Value]] = field(default_factory=list, repr=False, compare=False)

    def forget(self) -> None:
        """All of them."""
        self._answers.clear()

    def of(self, asked: object, make: Callable[[], Value]) -> Value:
        """The answer to ``asked``, made where it is not kept."""
        same = [one for one in self._answers if self.same(one[0], asked)]
        answer = same[0][1] if same else make()
        kept = [one for one in self._answers if not self.same(one[0], asked)]  # others may have been made
        self._answers[:] = [*kept, (asked, answer)][-self.most :]
        return answer
