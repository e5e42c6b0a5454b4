"""What differs between two checks of one simulated arm: its noise, as it would on a real one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm
from daq.session.bench import ArmOrder
from drivers.simulated.group import serial_number


def with_own_noise(order: ArmOrder, catalogue: Catalogue) -> ArmOrder:
    """The order with a noise seed that this arm has not had, unless one was asked for.

    It follows from the seed of the arm and the number of runs that the catalogue has of it: the same nights
    on a fresh catalogue are the same nights, whatever other arms were driven meanwhile.
    """
    if not order.simulated or order.noise_seed is not None:
        return order
    return replace(order, noise_seed=noise_seed(order.seed, _runs_so_far(order, catalogue)))


def noise_seed(seed: int, runs_so_far: int) -> int:
    """A seed of 32 bits for the noise of the run after so many of the arm of a seed."""
    return int(np.random.SeedSequence([seed, runs_so_far, _PURPOSE]).generate_state(1)[0])


_PURPOSE = 0x419
"""Sets these seeds apart from others that are made of two numbers."""


def _runs_so_far(order: ArmOrder, catalogue: Catalogue) -> int:
    serials = tuple(serial_number(order.robot, order.seed, axis) for axis in range(order.robot.n))
    identity = replace(identity_of_arm(order.robot, simulated=True), serials=serials)
    known = arms.find(catalogue, identity)
    return 0 if known is None else len(runs.every(catalogue, arm=known.label))
