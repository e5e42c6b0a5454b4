"""What the tables of a robot.toml are made of: types of values, tables that never change or may be left out.

A description for logs alone has no drives and no controller. Whatever drives an arm, plans for it or
simulates its loop reads their keys; a key that was never given has no value that would be right.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from robots.errors import UserError, ValueNotAllowed


def whole_number(value: object) -> object:
    """Refuse ``true`` and ``1.0`` where a choice of whole numbers stands: Python calls them equal to 1."""
    if type(value) is not int:
        raise ValueNotAllowed((), "is not one of the choices")
    return value


class Frozen(BaseModel):
    """A table that refuses keys it does not know, and never changes."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


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


_WRITTEN = {"drive": "[[drive]]", "controller": "[controller]"}


def missing(table: str, key: str) -> MissingFromDescription:
    """The error where ``table.key`` is read and the table was left out."""
    return MissingFromDescription(
        f"robot.toml has no {_WRITTEN[table]}: {table}.{key} is needed to drive, plan and simulate the loop;"
        " write the table as docs/reference/robot-toml.md says"
    )


def without(name: str, tables: Sequence[str], wanted: str) -> MissingFromDescription:
    """The error before something begins that needs tables which were left out.

    Args:
        name: of the arm.
        tables: as keys.
        wanted: what needs them.
    """
    listed = " and no ".join(_WRITTEN[table] for table in tables)
    return MissingFromDescription(
        f"{name}: its robot.toml has no {listed}: {wanted} needs that; docs/reference/robot-toml.md says how"
    )
