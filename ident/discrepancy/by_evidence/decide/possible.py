"""Sizes that friction can have: it takes power from a drive and gives none.

Forms that describe a law may have any size, and a set can explain its rows by one against the other: a power
of the speed and less Coulomb friction than none, a hysteresis of 2.2 N·m and a tight spot of −1.8. So a set
has the probability that dry and viscous friction of each drive, of the model and of all members together, are
not below nothing; of a tight spot in its middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import log_ndtr

from ident.discrepancy.by_evidence.evidence.known import Beta
from ident.discrepancy.by_evidence.evidence.solved import Posterior
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.effects.usual import FRICTION
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray


class WithEntry(Protocol):
    """What is asked of a member of a set."""

    @property
    def entry(self) -> Entry: ...


@dataclass(frozen=True, eq=False)
class UsualFriction:
    """Dry and viscous friction of each drive, as the model under examination has them.

    Attributes:
        size: (2, n) where its known factors are 0, N·m (or N) and N·m·s/rad.
        of_known: (2, n, b) of known factors of β.
    """

    size: FloatArray
    of_known: FloatArray

    @classmethod
    def of(cls, base: BaseParameters, beta: Beta) -> UsualFriction:
        """Of a model and what its base parameters are made of."""
        shares = np.zeros((len(FRICTION), base.model.robot.n, len(base.model.parameters)))
        for kind, (usual, _) in enumerate(FRICTION):
            for column, one in enumerate(base.model.parameters):
                if one.symbol in usual:
                    shares[kind, one.joint, column] = usual[one.symbol]
        standard = base.standard_from(beta.mean(np.zeros(beta.count)), base.model.prior())
        return cls(shares @ standard, shares @ np.linalg.lstsq(base.relation, beta.spread, rcond=None)[0])

    def log_possible(
        self, members: Sequence[WithEntry], posterior: Posterior, at: tuple[int, ...] | None = None
    ) -> float:
        """Log probability that friction of drives is not below nothing.

        Each is a sum of parameters of the model and of members, so it is normal by the posterior of them all.
        It is asked where a member changes it: beside others the model's own may be a little wrong.

        Args:
            members: of a set.
            posterior: of known factors and their parameters.
            at: joints of the place that is asked about, from 0, several of which are no drive's; all drives
                where None.
        """
        places = [one.entry.placed.place.joints for one in members]
        drives = {joints[0] for joints in (places if at is None else [at]) if len(joints) == 1}
        if not drives:
            return 0.0
        scale = np.concatenate([one.entry.white.scale for one in members])
        symbols = [
            (parameter.symbol, joints)
            for one, joints in zip(members, places, strict=True)
            for parameter in one.entry.placed.parameters
        ]
        total = 0.0
        for one in sorted(drives):
            for kind, (_, changes) in enumerate(FRICTION):
                acts = [symbol in changes and joints == (one,) for symbol, joints in symbols]
                if any(acts):
                    total += self._one(kind, one, np.where(acts, scale, 0.0), posterior)
        return total

    def _one(self, kind: int, drive: int, of_members: FloatArray, posterior: Posterior) -> float:
        own = self.of_known[kind, drive]
        whole = np.concatenate([own, np.zeros(posterior.known.size - own.size), of_members])
        size = self.size[kind, drive] + own @ posterior.known[: own.size] + of_members @ posterior.theta
        return float(log_ndtr(size / np.sqrt(whole @ posterior.covariance @ whole)))
