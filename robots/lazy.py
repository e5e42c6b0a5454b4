"""Packages that import what they export only when it is asked for (PEP 562)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def exporter(package: str, modules: Mapping[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """``__getattr__`` of a package whose names come out of its modules when they are first used.

    numpy, pydantic, Pinocchio and the CAN libraries take most of a second to import; a command that ends
    with a refusal needs none of them.

    Args:
        package: its name.
        modules: for each module the names that the package exports of it.
    """
    home = {name: module for module, names in modules.items() for name in names}

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(home[name]), name)

    return get
