"""Which of several torques that are named equally was measured: the data say it, not the names.

A torque that a controller computes of a motion has no friction in it, and none of the measurement's noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import Sampled
from daq.importing.proof import TorqueProof, smooth
from ident.listing import SHOWN, listed
from robots import Robot
from robots.arrays import FloatArray


def measured_torque(named: Sequence[Channels], log: Sampled, robot: Robot) -> tuple[Channels, list[str]]:
    """The torque that was measured, and a sentence where there was a choice.

    Those in which friction brakes come before those in which it does not; of these the roughest is taken.

    Args:
        named: at least one; named equally.
        log: the joints' positions.
        robot: the arm.
    """
    if len(named) == 1:
        return named[0], []
    series = [log.even(channel.values[:, log.moving]) for channel in named]
    none = np.zeros(robot.n)
    proofs = (TorqueProof.of(robot, log.position, torque, log.period, log.cutoff) for torque in series)
    brakes = [proof.brakes(none) for proof in proofs]
    rough = [_roughness(torque, log) for torque in series]
    best = max(range(len(named)), key=lambda k: (brakes[k], rough[k]))
    same = [c.label for k, c in enumerate(named) if k != best and brakes[k] == brakes[best]]
    other = [c.label for k, c in enumerate(named) if k != best and brakes[k] != brakes[best]]
    why = [f"in {listed(other, few=SHOWN)} no friction brakes"] if other else []
    why += [f"{listed(same, few=SHOWN)} are smoother"] if same else []
    return named[best], [f"torque, of several: {named[best].label}; {', and '.join(why)}"]


def _roughness(torque: FloatArray, log: Sampled) -> float:
    """What the low-pass of the positions takes away, as a share of what it leaves: median of the joints."""
    smoothed = smooth(torque, log.period, log.cutoff)
    size = np.std(smoothed, axis=0)
    live = size > 0
    return float(np.median(np.std(torque - smoothed, axis=0)[live] / size[live])) if live.any() else 0.0
