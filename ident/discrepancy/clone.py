"""A clone of the arm: the present model simulated in closed loop, and examined as if it were the arm.

What it leaves is not a missing effect: it comes of filters, of sampling and of friction at standstill. It
is taken off what the arm leaves, so that a clean arm leaves noise alone.
"""

from __future__ import annotations

import logging
from dataclasses import replace

from ident.closed_loop import SimulatedRun, simulate
from ident.discrepancy.examination import Examination, examine
from ident.discrepancy.prior import Prior
from ident.discrepancy.scene import Scene, make_scene
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.recording import Recording
from robots.arrays import FloatArray

_log = logging.getLogger(__name__)


def with_clone(examination: Examination, standard: FloatArray, plain: BaseParameters) -> Examination:
    """The examination with its clone's residual beside it.

    Where the arm cannot be simulated (no reference or controller, a mass matrix that is not positive
    definite) the examination comes back as it is, with the reason in the log.

    Args:
        examination: of the arm.
        standard: (p,) the present model's parameters.
        plain: the model before anything was found, whose parameters come first in the present one's. Its
            clone serves throughout: play in a gear is too sensitive for a simulation of it to be taken off.
    """
    b, p = plain.independent.size, len(plain.model.names)
    try:
        runs = [simulate(plain.model, standard[:p], scene.recording) for scene in examination.scenes]
    except IdentificationError as error:
        _log.warning("no clone of the arm: %s", error)
        return examination
    scenes = [_as_scene(examination, scene, run) for scene, run in zip(examination.scenes, runs, strict=True)]
    prior = examination.prior
    if prior is not None:
        prior = Prior(examination.beta[:b], prior.covariance[:b, :b], prior.source)
    only = tuple(examination.used[examination.segment == k] for k in range(len(scenes)))
    copy = examine(plain, scenes, prior, examination.whitening, only)
    return replace(examination, clone=copy.residual)


def _as_scene(examination: Examination, scene: Scene, run: SimulatedRun) -> Scene:
    recording = Recording(
        f"clone of {scene.recording.name}",
        scene.recording.time,
        scene.recording.reference,
        run.position,
        run.control_signal,
    )
    return make_scene(examination.base.model.robot, recording, scene.started)
