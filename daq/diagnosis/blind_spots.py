"""What a diagnosis could not have shown: drive gains whose error hides in the arm's own parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.diagnosis.scored_families import settled_by
from ident.discrepancy import Diagnosis
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import partialled, prior_share
from ident.discrepancy.settings import DEFAULTS
from ident.effects.vocabulary import VOCABULARY, family_named
from ident.parameters.present import Present

GAIN = "drive_gain_error"

WORTH_KNOWING = 0.05
"""Relative error of a drive gain that somebody would want to hear of."""


@dataclass(frozen=True)
class BlindSpot:
    """An effect that may be there unseen.

    Attributes:
        effect: name of the vocabulary.
        joints: its place, from 1; empty where it is of every place.
        smallest: relative error that would have been found; infinite where none would.
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


def blind_spots(diagnosis: Diagnosis) -> tuple[BlindSpot, ...]:
    """What these recordings could not have shown, whatever the verdict.

    After a refit that is every effect that needs a prior. Against a prior it is the gain of drives whose
    torque is nearly all friction or inertia of their own: a few per cent more of those look the same.
    """
    first = diagnosis.examinations[0]
    if first.prior is None:
        return tuple(
            BlindSpot(family.name, (), np.inf, settled_by((family.name,)))
            for family in VOCABULARY
            if family.needs_prior
        )
    found = {(finding.effect, finding.joints) for finding in diagnosis.findings}
    spots = []
    for drive in range(first.base.model.robot.n):
        smallest = smallest_gain_error(first, drive)
        if smallest > WORTH_KNOWING and (GAIN, (drive + 1,)) not in found:
            spots.append(BlindSpot(GAIN, (drive + 1,), smallest, settled_by((GAIN,))))
    return tuple(spots)


def smallest_gain_error(examination: Examination, drive: int) -> float:
    """Relative error of a drive's gain (drive from 0) whose score would be enough for a finding."""
    base, family = examination.base, family_named(GAIN)
    place = next(place for place in family.places(base.model.robot) if place.joints == (drive,))
    standard = base.standard_from(examination.beta, base.model.prior())
    effect = family.effect(base.model.robot, place, (), Present(base.model, standard))
    beyond = partialled(examination, effect, exact=False)
    if beyond is None:
        return float("inf")
    rows, energy = examination.torque.shape[0], float(np.sum(beyond**2))
    least, share = DEFAULTS.least_score, examination.smallest_share(DEFAULTS)
    of_data = 1.0 - prior_share(beyond / np.sqrt(energy), examination.data_rows)
    needed = least + of_data * max(share * rows - least, 0.0) + float(np.log(rows))
    return float(np.sqrt(needed / energy))
