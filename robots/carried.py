"""A body that is screwed to a link, as the identification reads it: standard parameters, known or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray
from robots.pseudo_inertia import LINK_SIZE


@dataclass(frozen=True, eq=False)
class Load:
    """What a body adds to the standard parameters of the link that it is screwed to.

    Attributes:
        name: of the body, for messages.
        link: from 0.
        ten: (10,) standard parameters about the link's frame; zero where they are not known.
        unknown: which of the ten are not known.
    """

    name: str
    link: int
    ten: FloatArray
    unknown: tuple[int, ...] = ()

    @property
    def mass(self) -> float:
        return float(self.ten[0])

    def links(self, joints: int) -> FloatArray:
        """(n, 10): zero but for the link that carries it."""
        links = np.zeros((joints, LINK_SIZE))
        links[self.link] = self.ten
        return links

    def with_values(self, values: FloatArray) -> Load:
        """The same with values of what was not known, in the order of ``unknown``."""
        ten = self.ten.copy()
        ten[list(self.unknown)] = values
        return replace(self, ten=ten, unknown=())
