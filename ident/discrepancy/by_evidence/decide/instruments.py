"""Where nothing repeats: the motion of the simulated closed loop, for columns without a sample's own noise.

Process torque and an encoder's noise move an arm in closed loop, and stand in y. A column that is made of the
measured motion holds the same noise, E(Eᵀε) ≠ 0, and rates and accelerations of a torque hold most of it: a
lag, a delay, a soft gear explain noise. Another period of the motion has noise of its own; where there is
none, the arm is simulated under the recorded references and the same control law, as IDIM-IV makes its
instruments. What an effect that is searched for does to the motion itself is missing there, until it is found
(:mod:`.beside_motion`).
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.closed_loop import simulate
from ident.discrepancy.by_evidence.decide.problem import Problem, first_values
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, prepare
from ident.discrepancy.existing_arm import existing
from ident.discrepancy.prior import Prior
from ident.discrepancy.unknown_feed_forward import unknown_feed_forward
from ident.effects.family import PlacedEffect
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray

_log = logging.getLogger(__name__)

Beside = tuple[tuple[PlacedEffect, FloatArray], ...]


@dataclass(frozen=True, eq=False)
class Simulation:
    """A model in closed loop; :data:`ident.discrepancy.by_evidence.evidence.prepared.Simulated`.

    Attributes:
        base: the model.
        beta: its parameters (b,).
        beside: effects that it has beside these, with their values.
    """

    base: BaseParameters
    beta: FloatArray
    beside: Beside = ()

    def __call__(self, recording: Recording) -> FloatArray | None:
        """Positions (samples, n) of the simulated arm; None where it cannot be simulated.

        What the controller adds beside the described law is added. A loop with an effect may ring where the
        arm's does not, or otherwise than it; then the model without it is nearer, and stands for the arm.
        """
        fed = unknown_feed_forward(self.base.model.robot, recording)
        if fed is not None and fed.there.any():
            recording = fed.added(fed.there)
        alone = self._simulated(recording, ())
        found = self._simulated(recording, self.beside) if self.beside else None
        if found is None or alone is None:
            return alone if found is None else found
        return _nearer(recording, found, alone)

    def _simulated(self, recording: Recording, beside: Beside) -> FloatArray | None:
        model = self.base.model
        whole = RegressorModel(model.robot, (*model.effects, *(effect for effect, _ in beside)))
        standard = self.base.standard_from(self.beta, model.prior())
        standard = existing(model, standard, recording.position)
        try:
            standard = np.concatenate([standard, *(values for _, values in beside)])
            return simulate(whole, standard, recording).position
        except IdentificationError as error:
            _log.info("no simulated motion: %s", error)
            return None


def _nearer(recording: Recording, one: FloatArray, other: FloatArray) -> FloatArray:
    """Of two simulated motions (samples, n) the one nearer to the recorded, each joint with equal weight."""
    away = [np.sum((motion - recording.position) ** 2, axis=0) for motion in (one, other)]
    farther = np.log(np.maximum(away, np.finfo(float).tiny))
    return one if np.sum(farther[0]) <= np.sum(farther[1]) else other


def fitted_motion(base: BaseParameters, prior: Prior | None, recordings: Sequence[Recording]) -> Prepared:
    """Recordings to fit, as :func:`prepared_beside` a first fit of the model.

    Args:
        base: the model, of an arm with the settings of the evidence.
        prior: of its parameters; None after a refit.
        recordings: of the arm.

    Raises:
        IdentificationError: as :func:`prepare`.
    """
    prepared = prepare(base.model.robot, recordings)
    if prepared.repeats:
        return prepared
    return prepared_beside(base, first_values(base, prior, prepared), recordings)


def with_found(problem: Problem, found: Found, recordings: Sequence[Recording]) -> Prepared:
    """Recordings with the motion of a model that has what was found.

    An arm with a delay moves otherwise than one without, a little; what tells a delay from a lag is little,
    too.

    Args:
        problem: that the set was found in.
        found: the set.
        recordings: of the arm.

    Raises:
        IdentificationError: as :func:`prepare`.
    """
    beside = tuple((one.entry.placed, found.theta(k)[0]) for k, one in enumerate(found.members))
    return prepared_beside(problem.base, problem.beta.mean(found.posterior.known), recordings, beside)


def prepared_beside(
    base: BaseParameters, beta: FloatArray, recordings: Sequence[Recording], beside: Beside = ()
) -> Prepared:
    """Recordings with the motion of other periods, or of a simulated model where they do not repeat.

    Args:
        base: the model, of an arm with the settings of the evidence.
        beta: its parameters (b,).
        recordings: of the arm.
        beside: effects that it has beside these, with their values.

    Raises:
        IdentificationError: as :func:`prepare`.
    """
    return prepare(base.model.robot, recordings, Simulation(base, beta, beside))


def predicted(prepared: Prepared, present: Present) -> Prepared:
    """Recordings of a motion with the torque that a model says of it."""
    parts = tuple(
        replace(
            part,
            torque=present.torque(part.own),
            own=part.own.with_torque(present.torque(part.own)),
            other=part.other.with_torque(present.torque(part.other)),
        )
        for part in prepared.parts
    )
    return replace(prepared, parts=parts)
