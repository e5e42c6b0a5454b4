"""What a key of robot.toml may hold, in words, derived from the models' types and bounds."""

from __future__ import annotations

import types
import typing
from typing import Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from robots.errors import shown
from robots.toml_lines import Path

_SCALARS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


def keys_of(model: type[BaseModel]) -> tuple[str, ...]:
    """The keys that a file may give in this table (fields that only the loader sets are left out)."""
    return tuple(name for name, field in model.model_fields.items() if not field.exclude)


def table_at(model: type[BaseModel], path: Path) -> type[BaseModel] | None:
    """The model of the table at ``path`` below ``model``; None when no table can be there."""
    annotation: Any = model
    for part in path:
        annotation = _step(annotation, part)
    annotation = _bare(annotation)
    return annotation if _is_model(annotation) else None


def allowed_at(model: type[BaseModel], path: Path) -> str:
    """What may stand at ``path`` below ``model``, e.g. ``a whole number from 1 to 127``."""
    annotation: Any = model
    for part in path:
        annotation = _step(annotation, part)
    return _words(annotation)


def _step(annotation: Any, part: str | int) -> Any:
    bare = _bare(annotation)
    if _is_model(bare) and part in bare.model_fields:
        return bare.model_fields[part]
    if get_origin(bare) is tuple and isinstance(part, int):
        entries = get_args(bare)
        return entries[0] if len(entries) == 2 and entries[1] is Ellipsis else entries[part]
    return None


def _bare(annotation: Any) -> Any:
    """The type inside a field, an Annotated or an optional."""
    if isinstance(annotation, FieldInfo):
        return _bare(annotation.annotation)
    if get_origin(annotation) is typing.Annotated:
        return _bare(get_args(annotation)[0])
    if get_origin(annotation) in (typing.Union, types.UnionType):
        return _bare(next(entry for entry in get_args(annotation) if entry is not type(None)))
    return annotation


def _constraints(annotation: Any) -> list[Any]:
    """Bounds and patterns given along the way to the bare type."""
    if isinstance(annotation, FieldInfo):
        return list(annotation.metadata) + _constraints(annotation.annotation)
    if get_origin(annotation) is typing.Annotated:
        inner, *extras = get_args(annotation)
        return [c for extra in extras for c in _constraints(extra) or [extra]] + _constraints(inner)
    if get_origin(annotation) in (typing.Union, types.UnionType):
        return [c for entry in get_args(annotation) for c in _constraints(entry)]
    return []


def _words(annotation: Any) -> str:
    bare = _bare(annotation)
    if get_origin(bare) is Literal:
        return _choice([shown(value) for value in get_args(bare)])
    if get_origin(bare) is tuple:
        entries = get_args(bare)
        if entries[-1] is Ellipsis:
            return f"a list, each entry {_words(entries[0])}"
        return f"[{', '.join(_words(entry) for entry in entries)}]"
    if _is_model(bare):
        return f"a table with the keys {', '.join(keys_of(bare))}"
    return _SCALARS.get(bare, "") + _range(_constraints(annotation))


def _range(constraints: list[Any]) -> str:
    lowest = [c.ge for c in constraints if isinstance(c, Ge)]
    highest = [c.le for c in constraints if isinstance(c, Le)]
    if lowest and highest:
        return f" from {lowest[0]:.12g} to {highest[0]:.12g}"
    limits = [f"at least {value}" for value in lowest] + [f"at most {value}" for value in highest]
    limits += [f"greater than {c.gt}" for c in constraints if isinstance(c, Gt)]
    limits += [f"less than {c.lt}" for c in constraints if isinstance(c, Lt)]
    limits += ["not empty" for c in constraints if getattr(c, "min_length", 0)]
    limits += [f"like {c.pattern}" for c in constraints if getattr(c, "pattern", None)]
    return ", " + ", ".join(limits) if limits else ""


def _choice(options: list[str]) -> str:
    return options[0] if len(options) == 1 else f"{', '.join(options[:-1])} or {options[-1]}"


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
