"""What friction at standstill may do by any law: columns beside those of the law that the recordings chose.

How dry friction turns its sign is no effect that has a name. A gear's is known to be near one of two laws
(:mod:`ident.discrepancy.presliding`); that of another plant creeps, sticks, or answers to acceleration. A law
says what share of the Coulomb friction acts while the drive is slow, so any of them is a mixture of friction
that turns over other speeds and other ways, sooner or later, and departs from ours by up to that friction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.loop import COARSE
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.effects import FrictionSign
from ident.effects.family import Place
from ident.effects.scales import dry_friction
from ident.effects.simulated import Bristle, FrictionTorque, SimulatedParts, SoftConstraint
from robots.arrays import FloatArray

_SHARES = (0.1, 0.3, 0.6, 1.5, 2.2, 3.3, 5.0)
"""Of the size that goes best with the drive."""
_WAYS = (1e-4, 1e-3)
"""rad (or m), for a drive whose friction turns its sign over a speed; longer ones have a name, hysteresis."""
_SPEEDS = (5e-4, 2e-3, 8e-3, 3.2e-2)
"""rad/s (or m/s), for a drive whose friction builds up over a way: of others."""
_STEP = 0.1
"""Of the Coulomb friction: what a column is simulated with stays within what is linear."""

_Law = Bristle | FrictionSign | SoftConstraint


def law_columns(evidence: LoopEvidence) -> FloatArray:
    """Rows × drives × m, each in units of its factor's prior deviation, the Coulomb friction of its drive.

    Every column stands there twice, as it is and a row later. The difference is the law's rate, so friction
    that answers to acceleration, as that of a constraint does, is among them.

    Args:
        evidence: of a model whose drives have each their own size.
    """
    jobs = [(drive, law) for drive, own in enumerate(evidence.standstill) for law in _others(own)]
    evidence.run(COARSE)
    found = at_once(lambda job: _change(evidence, *job), jobs)
    columns = np.stack([one for one in found if one is not None], axis=2)
    cuts = np.cumsum([evidence.loop.count(piece) for piece in evidence.loop.prepared])[:-1]
    late = [np.concatenate([part[:1], part[:-1]]) for part in np.split(columns, cuts)]
    return np.concatenate([columns, np.concatenate(late)], axis=2)


def _change(evidence: LoopEvidence, drive: int, law: _Law) -> FloatArray | None:
    """Of the drives' torque by another law of one drive; None where the loop with it cannot be simulated."""
    row = evidence.robot.transmission_matrix[drive]
    friction = dry_friction(evidence.robot, Place("drive", (drive,)))
    step = _STEP * friction * row
    own = evidence.standstill[drive]
    more = SimulatedParts(friction=(FrictionTorque(row, step, law), FrictionTorque(row, -step, own)))
    change = evidence.change(more)
    return None if change is None else change / _STEP


def _others(own: _Law) -> list[_Law]:
    laws: list[_Law]
    if isinstance(own, Bristle):
        laws = [Bristle(share * own.length, own.kind) for share in _SHARES]
        return [*laws, *(FrictionSign("tanh", speed) for speed in _SPEEDS)]
    laws = [replace(own, width=share * own.width) for share in _SHARES]
    return [*laws, *(Bristle(way, "exponential") for way in _WAYS)]
