"""docs/reference/python-api.md, made of what the packages export and of its docstrings.

``python -m tests.python_api_page`` writes it.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pydantic import BaseModel

PAGE = Path(__file__).resolve().parents[1] / "docs" / "reference" / "python-api.md"
PACKAGES = ("daq.api", "robots", "ident", "trajectories", "drivers")
"""In full."""
ROOMS = (
    "ident.effects",
    "ident.estimators",
    "ident.covariances",
    "ident.controllers",
    "ident.closed_loop",
    "ident.exogeneity",
    "ident.discrepancy",
    "ident.drift",
    "drivers.cia402",
    "drivers.simulated",
)
"""One line for each name."""
HEAD = """# Python API

What each package exports; everything else may change without notice. `daq.api` is for people who write
scripts and notebooks; the rest of `daq` has the [command line](cli.md), its [JSON](json.md) and its files as
interfaces. Arrays are samples × joints, units SI and rad (m and N on a prismatic axis). This page is made by
`python -m tests.python_api_page`.
"""
_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Yields):$", re.MULTILINE)
_ROLE = re.compile(r":\w+:`~?([^`]+)`")


def page() -> str:
    """The whole page."""
    return HEAD + "".join(_package(name) for name in PACKAGES) + "".join(_room(name) for name in ROOMS)


def exported(name: str) -> Iterator[tuple[str, Any]]:
    """Names and objects that a package exports, in the order of the alphabet."""
    package = importlib.import_module(name)
    yield from ((each, getattr(package, each)) for each in sorted(package.__all__, key=str.lower))


def _package(name: str) -> str:
    module: ModuleType = importlib.import_module(name)
    entries = "".join(_entry(f"{name}.{each}", value) for each, value in exported(name))
    return f"\n## {name}\n\n{_text(module.__doc__ or '')}\n{entries}"


def _room(name: str) -> str:
    module = importlib.import_module(name)
    entries = "".join(
        f"- `{each}`: {_line(_own_doc(value) if inspect.isclass(value) else value.__doc__ or '')}".rstrip(
            ": "
        )
        + "\n"
        for each, value in exported(name)
        if inspect.isclass(value) or inspect.isfunction(value)
    )
    return f"\n## {name}\n\n{_text(module.__doc__ or '')}\n\n{entries}"


def _entry(name: str, value: Any) -> str:
    if inspect.isclass(value):
        return f"\n### {name}\n\n{_declared(value)}{_text(_own_doc(value))}\n{_members(value)}"
    if inspect.isfunction(value):
        call = _call(value.__name__, value)
        return f"\n### {name}\n\n```python\n{call}\n```\n\n{_text(value.__doc__ or '')}\n"
    return f"\n### {name}\n\nOne of these: `{_plain(str(value))}`\n"


def _own_doc(kind: type) -> str:
    """Not the one that dataclasses write."""
    text = kind.__doc__ or ""
    return "" if is_dataclass(kind) and text.startswith(f"{kind.__name__}(") else text


def _declared(kind: type) -> str:
    """How an object of a class is made, where that is for a caller to do."""
    if issubclass(kind, BaseModel | BaseException) or getattr(kind, "_is_protocol", False):
        return ""
    return f"```python\n{_call(kind.__name__, kind)}\n```\n\n"


def _members(kind: type) -> str:
    lines = []
    if issubclass(kind, BaseModel):
        lines += [
            f"- `{key}: {kind.__annotations__.get(key, '…')}`: {_line(field.description or '')}"
            for key, field in kind.model_fields.items()
        ]
    for name, member in vars(kind).items():
        plain = member.__func__ if isinstance(member, classmethod | staticmethod) else member
        if name.startswith("_"):
            continue
        if isinstance(member, property):
            lines.append(f"- `{name}`: {_line(member.__doc__ or '')}")
        elif inspect.isfunction(plain):
            lines.append(f"- `{_call(name, plain)}`: {_line(plain.__doc__ or '')}")
    return "\n" + "\n".join(line.rstrip(": ") for line in lines) + "\n" if lines else ""


def _call(name: str, made: Any) -> str:
    """A name with its parameters, as it would be declared."""
    try:
        signature = inspect.signature(made)
    except ValueError:
        return name
    kept = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    shown = [p.replace(default=_Shown(p.default)) if p.default is not p.empty else p for p in kept]
    back = inspect.Signature.empty if inspect.isclass(made) else signature.return_annotation
    return _plain(f"{name}{signature.replace(parameters=shown, return_annotation=back)}".replace("'", ""))


class _Shown:
    """A default value as it stays from run to run: without the place of an object in memory."""

    def __init__(self, value: Any) -> None:
        text = repr(value)
        self._text = "…" if "<" in text or len(text) > 40 else text

    def __repr__(self) -> str:
        return self._text


def _plain(text: str) -> str:
    return re.sub(r"\b(?:\w+\.)+(\w+)", r"\1", text)


def _line(doc: str) -> str:
    """The first sentence or paragraph of a docstring in one line."""
    return _marked(" ".join(inspect.cleandoc(doc).split("\n\n")[0].split()))


def _text(doc: str) -> str:
    """A docstring as Markdown: its sections are lists."""
    parts = _SECTION.split(inspect.cleandoc(doc))
    found = [_marked(parts[0].strip())]
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        body = inspect.cleandoc(body)
        entries = re.split(r"\n(?=\S)", body) if title not in ("Returns", "Yields") else [body]
        found.append(f"{title}:\n\n" + "\n".join(f"- {_marked(' '.join(e.split()))}" for e in entries))
    return "\n\n".join(part for part in found if part)


def _marked(text: str) -> str:
    return _ROLE.sub(r"`\1`", text).replace("``", "`")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
