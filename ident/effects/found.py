"""An effect that a search has found, as part of the model that later steps go on with."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from ident.effects.family import StandardParameter
from ident.effects.placed import Placed


@dataclass(frozen=True, eq=False)
class Found(Placed):
    """A placed effect with its shape as it was found.

    ``kept`` says which of its linear parameters the model has; the others stay zero. ``source`` says where a
    term came from.
    """

    kept: tuple[bool, ...] = ()
    source: str = ""

    @classmethod
    def of(cls, placed: Placed, taken: Collection[str], source: str = "") -> Found:
        """All parameters of a placed effect, under names that nothing in the model has yet.

        Args:
            placed: the effect.
            taken: parameter names of the model that it is added to.
            source: where a term came from.
        """
        values = {name: getattr(placed, name) for name in Placed.__dataclass_fields__}
        own = unused(values.pop("parameters"), taken)
        return cls(**values, parameters=own, kept=(True,) * len(own), source=source)

    def keeping(self, kept: tuple[bool, ...]) -> Found:
        """The same with these of its parameters."""
        return replace(self, kept=kept)


def unused(
    parameters: Collection[StandardParameter], taken: Collection[str]
) -> tuple[StandardParameter, ...]:
    """Each parameter, counted as a copy where its name is in use: ``Fc1``, then ``Fc1_2``."""
    found: list[StandardParameter] = []
    for parameter in parameters:
        own = replace(parameter, copy=1)
        while own.name in taken or own in found:
            own = replace(own, copy=own.copy + 1)
        found.append(own)
    return tuple(found)
