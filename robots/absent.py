"""Tables that a description may leave out: what needs one of their keys says so when it asks for it.

A description for logs alone has no drives and no controller. Whatever drives an arm, plans for it or
simulates its loop reads their keys; a key that was never given has no value that would be right.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robots.errors import UserError
from robots.fields import Frozen


class MissingFromDescription(UserError, AttributeError):
    """Something was asked of an arm whose description leaves it out; one line."""


class Omittable(Frozen):
    """A table that may be left out: its keys then raise :class:`MissingFromDescription` when read."""

    if not TYPE_CHECKING:  # a type checker would take every attribute for one that exists

        def __getattr__(self, name: str) -> Any:
            if name in type(self).model_fields:
                raise missing(type(self).__name__.lower(), name)
            return super().__getattr__(name)

    @property
    def is_given(self) -> bool:
        """Whether the description has this table: all keys that it cannot do without."""
        fields = type(self).model_fields
        return all(name in self.__dict__ for name, field in fields.items() if field.is_required())


def missing(table: str, key: str) -> MissingFromDescription:
    """The error where ``table.key`` is read and the table was left out."""
    return MissingFromDescription(
        f"robot.toml has no [{table}]: {table}.{key} is needed to drive, plan and simulate the loop;"
        " write the table as docs/reference/robot-toml.md says"
    )
