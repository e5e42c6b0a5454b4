"""The REST interface in words: the page /docs, made of the same description as /openapi.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Route:
    """One call.

    Attributes:
        method, path, summary: of it.
        parameters: name, where it goes, what is allowed.
        answers: code and what it says.
        example: a command that makes the call.
    """

    method: str
    path: str
    summary: str
    parameters: tuple[tuple[str, str, str], ...]
    answers: tuple[tuple[str, str], ...]
    example: str

    @property
    def anchor(self) -> str:
        """Its place on the page."""
        return f"{self.method} {self.path}".lower().replace("/", "-").replace(" ", "").translate(_BARE)


_BARE = {ord(mark): None for mark in "{}"}
_VERBS = ("get", "post", "put", "delete", "patch")


def routes_of(described: Mapping[str, Any], address: str) -> tuple[Route, ...]:
    """Every route of a description (OpenAPI 3.1), in its order.

    Args:
        described: as /openapi.json has it.
        address: of the service, for the examples.
    """
    return tuple(
        _route(verb, path, operation, address)
        for path, operations in described["paths"].items()
        for verb, operation in operations.items()
        if verb in _VERBS
    )


def shared_answers(routes: Sequence[Route]) -> tuple[tuple[str, str], ...]:
    """What every route may answer, to be said once."""
    return tuple(one for one in routes[0].answers if all(one in route.answers for route in routes))


def _route(verb: str, path: str, operation: Mapping[str, Any], address: str) -> Route:
    parameters = tuple(
        (p["name"], "path" if p["in"] == "path" else "query", _allowed(p["schema"]))
        for p in operation.get("parameters", ())
    )
    answers = tuple((code, _said(code, answer)) for code, answer in sorted(operation["responses"].items()))
    drives = "" if verb == "get" else '-X POST -H "Authorization: Bearer $TOKEN" '
    return Route(
        verb.upper(),
        path,
        operation.get("summary", ""),
        parameters,
        answers,
        f"curl {drives}{address.rstrip('/')}{path}",
    )


def _said(code: str, answer: Mapping[str, Any]) -> str:
    content = ", ".join(answer.get("content", {}))
    words = {"422": "a parameter that is not allowed", "200": "done", "202": "begun"}.get(
        code, str(answer["description"])
    )
    return f"{words} ({content})" if content and code.startswith("2") else words


def _allowed(schema: Mapping[str, Any]) -> str:
    """What a parameter may be, in words."""
    kinds = [part for part in schema.get("anyOf", [schema]) if part.get("type") != "null"]
    (kind,) = kinds
    words = {"integer": "whole number", "number": "number", "string": "text"}[kind["type"]]
    low, high = kind.get("minimum"), kind.get("maximum")
    if low is not None and high is not None:
        words += f", {low} to {high}"
    if "pattern" in kind:
        words += f", {kind['pattern']}"
    if "default" in schema and schema["default"] is not None:
        words += f"; {schema['default']} where it is left out"
    return words
