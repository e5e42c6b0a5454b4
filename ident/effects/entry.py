"""A placed effect as plain values: what model files and the catalogue hold. Quick to import: no numpy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self


@dataclass(frozen=True)
class EffectEntry:
    """A placed effect as plain values: what a model file holds. Joints count from 1.

    ``source`` says where a term came from; it is empty where an effect has a name.
    """

    name: str
    joints: tuple[int, ...]
    shape: Mapping[str, float]
    source: str = ""

    def as_json(self) -> dict[str, Any]:
        """As model files, ``--json`` and the catalogue have it."""
        values = {"effect": self.name, "joints": list(self.joints), "shape": dict(self.shape)}
        return values | ({"source": self.source} if self.source else {})

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> Self:
        """The same back."""
        source = values.get("source", "")
        return cls(values["effect"], tuple(values["joints"]), dict(values["shape"]), source)


def joint_words(joints: Sequence[int]) -> str:
    """Joints (from 1) as a person says them; none are the whole arm."""
    if not joints:
        return "the arm"
    return ("joint " if len(joints) == 1 else "joints ") + " and ".join(map(str, joints))


def found_words(entries: Sequence[EffectEntry]) -> str:
    """Found effects and where they sit."""
    return "; ".join(f"{entry.name.replace('_', ' ')} ({joint_words(entry.joints)})" for entry in entries)
