"""The pseudo-inertia of a rigid body: a symmetric 4 × 4 matrix that is positive for bodies that can exist.

For a body of density ρ(x) it is ∫ [x; 1][x; 1]ᵀ ρ dx = [[Σ, h], [hᵀ, m]] with Σ = ½ tr(I)·1 − I. Ten
standard parameters belong to a body with density nowhere negative if and only if it is positive
semidefinite (Wensing, Kim, Slotine 2018); then the mass is positive and the principal moments about the
centre of mass satisfy the triangle inequality (Traversaro et al. 2016).
"""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

LINK_SIZE = 10
"""Standard parameters of one link, in the order of ``robots.standard.LINK_SYMBOLS``."""


def pseudo_inertia(link: FloatArray) -> FloatArray:
    """The pseudo-inertia (4, 4) of standard parameters (10,): kg, kg·m, kg·m² about the link frame."""
    mass, first, (xx, xy, yy, xz, yz, zz) = link[0], link[1:4], link[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    pseudo[:3, 3] = pseudo[3, :3] = first
    pseudo[3, 3] = mass
    return pseudo


def link_of_pseudo_inertia(pseudo: FloatArray) -> FloatArray:
    """The standard parameters (10,) of a pseudo-inertia (4, 4)."""
    second = pseudo[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    tail = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return np.concatenate(([pseudo[3, 3]], pseudo[:3, 3], tail))


def link_map() -> FloatArray:
    """(10, 16): standard parameters from the entries of a pseudo-inertia, row by row."""
    units = np.eye(16).reshape(16, 4, 4)
    return np.column_stack([link_of_pseudo_inertia(0.5 * (unit + unit.T)) for unit in units])


def impossible_links(links: FloatArray) -> tuple[int, ...]:
    """Indices (from 0) of links that no body can have: a negative mass, a negative or impossible inertia.

    Args:
        links: (n, 10) standard parameters.
    """
    found = []
    for index, link in enumerate(links):
        values = np.linalg.eigvalsh(pseudo_inertia(link))
        if values[0] < -1e-9 * np.abs(values).max():
            found.append(index)
    return tuple(found)
