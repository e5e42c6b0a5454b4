"""What the tables of a robot.toml are made of: types of their values, and tables that do not change."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from robots.errors import ValueNotAllowed


def whole_number(value: object) -> object:
    """Refuse ``true`` and ``1.0`` where a choice of whole numbers stands: Python calls them equal to 1."""
    if type(value) is not int:
        raise ValueNotAllowed((), "is not one of the choices")
    return value


class Frozen(BaseModel):
    """A table that refuses keys it does not know, and never changes."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
