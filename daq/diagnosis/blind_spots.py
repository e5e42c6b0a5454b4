"""What a diagnosis could not have shown: drive gains whose error hides in the arm's own parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.diagnosis.settled_by import settled_by
from ident.discrepancy import Diagnosis
from ident.discrepancy.by_evidence import EvidenceAnswer
from ident.effects.vocabulary import VOCABULARY

GAIN = "drive_gain_error"

WORTH_KNOWING = 0.05
"""Relative error of a drive gain that somebody would want to hear of."""


@dataclass(frozen=True)
class BlindSpot:
    """An effect that may be there unseen.

    Attributes:
        effect: name of the vocabulary.
        joints: its place, from 1; empty where it is of every place.
        smallest: relative error that would have been named; infinite where none would.
        settled_by: what would show it.
    """

    effect: str
    joints: tuple[int, ...]
    smallest: float
    settled_by: str

    def words(self) -> str:
        """One sentence."""
        name = self.effect.replace("_", " ")
        if not self.joints:
            return f"{name}: vanishes into a refit and cannot be found without --prior"
        place = f"{name} of drive {self.joints[0]}"
        if not np.isfinite(self.smallest) or self.smallest > 1.0:
            return f"{place}: no motion of this kind shows it; {self.settled_by}"
        return f"{place}: shows from {100 * self.smallest:.0f} % on, not below; {self.settled_by}"


def blind_spots(diagnosis: Diagnosis, answer: EvidenceAnswer) -> tuple[BlindSpot, ...]:
    """What these recordings could not have shown, whatever the verdict.

    After a refit that is every effect that needs a prior. Against a prior it is the gain of drives whose
    torque is nearly all friction or inertia of their own: a few per cent more of those look the same.

    Args:
        diagnosis: of the recordings.
        answer: of the evidence, which says from which size on it would have given a name.
    """
    if diagnosis.examinations[0].prior is None:
        return tuple(
            BlindSpot(family.name, (), np.inf, settled_by((family.name,)))
            for family in VOCABULARY
            if family.needs_prior
        )
    return tuple(
        BlindSpot(GAIN, one.joints, one.size, settled_by((GAIN,)))
        for one in answer.nameable
        if one.name == GAIN and one.size > WORTH_KNOWING
    )
