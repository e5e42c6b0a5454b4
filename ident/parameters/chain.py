"""Torques of a serial chain of links along a motion."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray


def along_chain(
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Torque (samples × n) and mass matrix (samples × n × n) of links along a motion.

    Args:
        frames: (n, 37), see :func:`ident.effects.chain.chain_frames`.
        links: (n, 10) standard parameters; the torque is linear in them.
        gravity: (3,) m/s² in the base.
        position, velocity, acceleration: samples × n.
    """
    # Imported here: the compiler takes a second to load.
    from ident.parameters.link_torque import along_motion

    samples, n = position.shape
    torque, masses = np.empty((samples, n)), np.empty((samples, n, n))
    along_motion(
        tuple(range(n)),
        frames,
        np.ascontiguousarray(links),
        gravity,
        np.ascontiguousarray(position),
        np.ascontiguousarray(velocity),
        np.ascontiguousarray(acceleration),
        torque,
        masses,
    )
    return torque, masses
