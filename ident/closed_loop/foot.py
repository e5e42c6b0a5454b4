"""A base that gives way, as the arrays of the compiled closed loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio

from ident.effects.chain import chain_frames
from ident.effects.foot import AXES, FootSpring, links_on_a_foot, on_a_foot
from ident.kernels.foot import Foot
from ident.kernels.rigid_bodies import mass_and_bias
from robots.arrays import FloatArray

_ROUNDS = 8
"""Of leaning by the weight of an arm that leans: each adds some per mille of the last."""


def firm() -> Foot:
    """One that does not give way."""
    none, square = np.zeros(0), np.zeros((0, 0))
    return Foot(
        (),
        np.zeros((0, 37)),
        np.zeros((0, 10)),
        none,
        none,
        np.zeros((3, 0)),
        none,
        none,
        np.zeros((0, 2)),
        square,
        none,
        square,
        none,
        np.zeros((0, 22)),
    )


def foot_of(
    feet: Sequence[FootSpring],
    model: pinocchio.Model,
    links: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
) -> Foot:
    """The foot, leaning as it rests in a posture.

    Args:
        feet: in series; none are a firm one.
        model: of the links, a serial chain.
        links: (n, 10) their standard parameters.
        gravity: (3,).
        position: (n,) posture at the start.
    """
    if not feet:
        return firm()
    frames = chain_frames(on_a_foot(model))
    assert frames is not None
    compliance = np.asarray(sum(np.array(foot.compliance) for foot in feet))
    stiffness = np.divide(1.0, compliance, out=np.full(AXES, np.inf), where=compliance > 0.0)
    damping = np.asarray(sum(np.array(foot.damping) for foot in feet))
    size = AXES + position.shape[0]
    foot = Foot(
        axes=tuple(range(size)),
        frames=frames,
        links=links_on_a_foot(links, max(foot.inertia for foot in feet)),
        stiffness=stiffness,
        damping=damping,
        moving=np.zeros((3, AXES)),
        position=np.concatenate([np.zeros(AXES), position]),
        velocity=np.zeros(size),
        turn=np.empty((size, 2)),
        mass=np.zeros((size, size)),
        bias=np.zeros(size),
        matrix=np.zeros((size, size)),
        right=np.zeros(size),
        work=np.zeros((size, 22)),
    )
    for _ in range(_ROUNDS):
        foot.position[:AXES] = foot.moving[0]
        foot.turn[:] = np.column_stack([np.cos(foot.position), np.sin(foot.position)])
        constants = (foot.axes, foot.frames, foot.links, gravity)
        mass_and_bias(*constants, foot.position, foot.turn, foot.velocity, foot.mass, foot.bias, foot.work)
        foot.moving[0] = -foot.bias[:AXES] / stiffness
    return foot
