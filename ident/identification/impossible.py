"""What no arm can have: rotors, joints and friction below zero, and fits that show nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.effects import RigidBody, RotorInertia, State
from ident.identification.friction_power import driven_by_friction
from ident.identification.summary import not_of_a_rotor
from ident.listing import listed
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from ident.recording import Recording
from ident.results import Estimate
from robots.arrays import FloatArray

_POSTURES = 100
"""Of the recordings, at which inertias are looked at."""
_ODD, _IMPOSSIBLE = 3.0, 5.0
"""Deviations below zero from which on an inertia is said, and from which on the model must not be trusted."""
_SEEN = 0.3
"""σ as a share of the value below which a parameter is seen."""


Said = tuple[tuple[str, ...], bool]
"""A sentence, none where there is nothing to say, and whether the model must not be trusted for it."""


def nonsense_of(
    estimate: Estimate, base: BaseParameters, rows: Rows, recordings: Sequence[Recording]
) -> tuple[Said, ...]:
    """Everything in an estimate that no arm can have.

    Args:
        estimate: by least squares, of these base parameters.
        base: what they are of.
        rows: that they were fitted to.
        recordings: that the rows are of.
    """
    return (
        not_of_a_rotor(estimate),
        driven_by_friction(estimate, rows),
        without_inertia(estimate, base, recordings),
        nothing_is_seen(estimate),
    )


def without_inertia(estimate: Estimate, base: BaseParameters, recordings: Sequence[Recording]) -> Said:
    """A sentence on joints that are easier to accelerate than nothing is, none where there is none.

    The inertia that a drive feels at a posture, M_jj(q), is a sum of base parameters; so its σ is known.
    Alone, a base parameter of a link may be below zero.

    Args:
        estimate: of these base parameters.
        base: what they are of.
        recordings: whose postures are looked at.
    """
    every = np.concatenate([recording.position for recording in recordings])
    position = every[np.linspace(0, len(every) - 1, min(_POSTURES, len(every))).astype(int)]
    beta, covariance = np.array([p.value for p in estimate.parameters]), estimate.covariance
    deviations = []
    for joint in range(base.model.robot.n):
        columns = _inertia_columns(base, position, joint)
        sigma = np.sqrt(np.einsum("ij,jk,ik->i", columns, covariance, columns))
        deviations.append(float(np.min(columns @ beta / np.maximum(sigma, np.finfo(float).tiny))))
    joints = base.model.robot.joint
    wrong = [f"{joints[k].name} by {-t:.3g} σ" for k, t in enumerate(deviations) if t < -_ODD]
    if not wrong:
        return (), False
    words = f"inertia at a joint below zero ({listed(wrong, few=3)}): no arm has it"
    return (f"{words}; are torque and motion of the same joint, and its unit right?",), min(
        deviations
    ) < -_IMPOSSIBLE


def _inertia_columns(base: BaseParameters, position: FloatArray, joint: int) -> FloatArray:
    """What M_jj is made of at postures (m, n): m × b, so that times base parameters it is kg·m² (or kg)."""
    rest, pushed = np.zeros_like(position), np.zeros_like(position)
    pushed[:, joint] = 1.0
    found = np.zeros((len(position), base.independent.size))
    for effect, places, own in base.columns_of_effects:
        if isinstance(effect, RigidBody | RotorInertia):
            with_push, without = (
                effect.columns(State(position, rest, acceleration))[:, joint][:, own]
                for acceleration in (pushed, rest)
            )
            found[:, places] = with_push - without
    return found


def nothing_is_seen(estimate: Estimate) -> Said:
    """A sentence where not one parameter comes out of the noise."""
    if any(p.sigma <= _SEEN * abs(p.value) for p in estimate.parameters):
        return (), False
    count = len(estimate.parameters)
    return (
        f"none of {count} parameters has less than {100 * _SEEN:.0f} % σ: are torques and positions of one"
        " motion, and of the same joints?",
    ), True
