"""Parameters that an arm can have, near those of a fit that none can have.

A fit that lacks an effect, or that a motion shows badly, can make the inertia behind a wrist negative. What
the loop is simulated for here needs the arm roughly: where it moves without noise, and how its friction turns
its sign. So such inertias go on the way to the description's as far as they have to.
"""

from __future__ import annotations

import numpy as np

from ident.closed_loop.torque_parts import ModelStructure
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import BoolArray, FloatArray
from robots.pseudo_inertia import LINK_SIZE

_SHARES = (0.125, 0.25, 0.5, 1.0)
"""Of the way to the description's inertias."""

_LEAST = 0.1
"""Of the description's least inertia at a posture: a drive behind less than that moves as none does."""

_POSTURES = 500
"""At which it is asked."""

_INERTIAS = ("Ia", "Iam")


def existing(model: RegressorModel, standard: FloatArray, position: FloatArray) -> FloatArray:
    """A standard vector (p,) itself where its mass matrix is positive definite along a motion.

    Else the first on the way to the description's links and rotors at which it is, friction as it was.

    Args:
        model: the effects.
        standard: (p,) their parameters.
        position: samples × n, rad (or m).
    """
    postures = position[:: max(1, len(position) // _POSTURES)]
    if _least_inertias(model, standard, postures).min() > 0.0:
        return standard
    described, inertial = model.prior(), _inertial(model)
    enough = _LEAST * _least_inertias(model, described, postures)
    for share in _SHARES:
        mixed = np.where(inertial, standard + share * (described - standard), standard)
        if (_least_inertias(model, mixed, postures) >= enough).all():
            return mixed
    return standard


def _least_inertias(model: RegressorModel, standard: FloatArray, position: FloatArray) -> FloatArray:
    """(samples,) smallest eigenvalue of the mass matrix, drives included."""
    mass = Present(model, standard).link_mass_matrix(position)
    return np.asarray(np.linalg.eigvalsh(mass + ModelStructure(model).parts(standard).inertia)[:, 0])


def _inertial(model: RegressorModel) -> BoolArray:
    """(p,) which parameters are of the links, or inertias of the drives."""
    own = np.zeros(len(model.names), dtype=np.bool_)
    own[: LINK_SIZE * model.robot.n] = True
    for effect, columns in model.columns_of_effects:
        own[columns] |= np.isin([one.symbol for one in effect.parameters], _INERTIAS)
    return own
