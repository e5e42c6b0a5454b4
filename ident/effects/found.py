"""An effect that a search has found, as part of the model that later steps go on with."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from ident.effects.placed import Placed


@dataclass(frozen=True, eq=False)
class Found(Placed):
    """A placed effect with its shape as it was found.

    ``kept`` says which of its linear parameters the model has; the others stay zero.
    """

    kept: tuple[bool, ...] = ()

    @classmethod
    def of(cls, placed: Placed, taken: Collection[str]) -> Found:
        """All parameters of a placed effect, under names that nothing in the model has yet.

        Args:
            placed: the effect.
            taken: parameter names of the model that it is added to.
        """
        values = {name: getattr(placed, name) for name in Placed.__dataclass_fields__}
        names = values.pop("parameter_names")
        return cls(**values, parameter_names=unused_names(names, taken), kept=(True,) * len(names))

    def keeping(self, kept: tuple[bool, ...]) -> Found:
        """The same with these of its parameters."""
        return replace(self, kept=kept)


def unused_names(names: Collection[str], taken: Collection[str]) -> tuple[str, ...]:
    """Each name, with a number behind it where it is in use: ``Fc1``, then ``Fc1_2``."""
    found: list[str] = []
    for name in names:
        unused, count = name, 1
        while unused in taken or unused in found:
            count += 1
            unused = f"{name}_{count}"
        found.append(unused)
    return tuple(found)
