"""Torques and mass matrices of a serial chain of links along a motion."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray


def chain_torque(
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> FloatArray:
    """Torque of links along a motion, samples × n; see :func:`ident.parameters.newton_euler.torque_along`."""
    # Imported here: the compiler takes a second to load.
    from ident.parameters.newton_euler import torque_along

    return torque_along(frames, links, gravity, position, velocity, acceleration)


def chain_masses(frames: FloatArray, links: FloatArray, position: FloatArray) -> FloatArray:
    """Mass matrices of links along a motion, samples × n × n.

    Args:
        frames: (n, 37), see :func:`ident.effects.chain.chain_frames`.
        links: (n, 10) standard parameters; the masses are linear in them.
        position: samples × n.
    """
    # Imported here: the compiler takes a second to load.
    from ident.parameters.link_masses import masses_along

    samples, n = position.shape
    masses = np.empty((samples, n, n))
    masses_along(tuple(range(n)), frames, np.ascontiguousarray(links), np.ascontiguousarray(position), masses)
    return masses
