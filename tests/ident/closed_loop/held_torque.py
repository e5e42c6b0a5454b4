"""The torque that a simulated motion takes, step by step, as the integration has it."""

from __future__ import annotations

import numpy as np

from ident import RegressorModel
from ident.closed_loop import SimulatedRun
from ident.closed_loop.direct_dynamics import DirectDynamics
from ident.closed_loop.friction_rows import shares_at_new_velocity
from ident.closed_loop.torque_parts import ModelStructure
from ident.effects import RigidBody, State


def middle_of_steps(run: SimulatedRun, h: float) -> State:
    """Every step but the first and the last: position and velocity in its middle, and its acceleration.

    The run has one integration step of h s per sample.
    """
    before, after = run.velocity[1:-1], run.velocity[2:]
    return State(
        run.position[1:-1] + 0.5 * h * before, 0.5 * (before + after), (after - before) / h, run.time[1:-1]
    )


def held_torque(model: RegressorModel, standard: np.ndarray, run: SimulatedRun, h: float) -> np.ndarray:
    """(samples − 2) × joints: what links, drives and friction of a usual model take over each of these steps.

    Links and damping as in the middle of the step, the velocity of the links there as the step before
    foretells it; dry friction partly as before and partly as after the step.
    """
    structure = ModelStructure(model)
    parts = structure.parts(standard)
    middle = middle_of_steps(run, h)
    before, after = run.velocity[1:-1], run.velocity[2:]
    coming = before + 0.5 * (before - run.velocity[:-2])
    links = next(effect for effect in model.effects if isinstance(effect, RigidBody))
    torque = links.columns(State(middle.position, coming, middle.acceleration)) @ parts.links.ravel()
    torque += middle.acceleration @ parts.inertia.T + middle.velocity @ parts.damping.T + parts.constant
    rows = parts.friction
    mass = DirectDynamics(structure, parts, run.position[0], h).mass_matrix(run.position[0])
    new = shares_at_new_velocity(rows.heads, rows.speed, rows.torque, rows.strength, mass, h)
    for share, speed in ((1.0 - new, before), (new, after)):
        torque += np.tanh(speed @ rows.speed.T * rows.heads[:, 0]) * (share * rows.strength) @ rows.torque
    return np.asarray(torque)
