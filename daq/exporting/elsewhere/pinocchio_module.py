"""The identified arm as a Python module that makes a Pinocchio model, with the torque of the whole model.

Source in place of an archive: it can be read, and any version of Pinocchio takes it.
"""

from __future__ import annotations

from pprint import pformat
from textwrap import indent

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.frames import joint_frames
from daq.exporting.elsewhere.mjcf import about_center
from daq.exporting.elsewhere.pinocchio_found import not_in_pinocchio, source_of_gains, source_of_laws

_TEMPLATE = '''"""{heading}

`model()` is a Pinocchio model with the identified bodies and rotor inertias (armature, which `pinocchio.rnea`
includes), friction and damping. `torque(q, v, a)` is the torque of the whole model: friction, offsets and
coupled drives too.

Not in it:
{lost}
"""

import numpy as np
import pinocchio

GRAVITY = {gravity}
# Per joint: name, kind, axis, rotation to the joint before, position in it, mass, centre, inertia about it,
# lower and upper limit, speed, torque.
JOINTS = {joints}
ARMATURE = np.array({armature})
DAMPING = np.array({damping})
FRICTION = np.array({friction})
OFFSET = np.array({offset})
# Drives that move with more than one joint: how they move, inertia, viscous and Coulomb friction.
COUPLINGS = {couplings}
SIGN_WIDTH = {width}  # rad/s or m/s; 0 is the exact sign


def model():
    """The arm; drives that move with several joints are in `torque` only, but for their share per joint."""
    made = pinocchio.Model()
    made.name = {name!r}
    made.gravity.linear = np.array(GRAVITY)
    parent = 0
    for name, kind, axis, rotation, position, mass, center, inertia, lower, upper, speed, torque in JOINTS:
        unaligned = {{
            "revolute": pinocchio.JointModelRevoluteUnaligned,
            "prismatic": pinocchio.JointModelPrismaticUnaligned,
        }}[kind]
        placement = pinocchio.SE3(np.array(rotation), np.array(position))
        one = [np.array([value]) for value in (torque, speed, lower, upper)]
        parent = made.addJoint(parent, unaligned(np.array(axis)), placement, name, *one)
        body = pinocchio.Inertia(mass, np.array(center), np.array(inertia))
        made.appendBodyToJoint(parent, body, pinocchio.SE3.Identity())
        made.addJointFrame(parent)
    made.armature = ARMATURE.copy()
    made.damping = DAMPING.copy()
    made.upperDryFrictionLimit = FRICTION.copy()
    made.lowerDryFrictionLimit = -FRICTION
    return made


def sign(speed):
    return np.sign(speed) if SIGN_WIDTH == 0.0 else np.tanh(speed / SIGN_WIDTH)


{laws}
# Above: effects that were found: law, how its place moves with the joints, its torque as a combination of
# joint torques, share of the offset in that, parameters. Below: drives that do not show a share of theirs.
{gains}


def torque(q, v, a, made=None):
    """Joint torque (n,) at position, velocity and acceleration (n,)."""
    made = model() if made is None else made
    q, v, a = (np.asarray(values, dtype=float) for values in (q, v, a))
    tau = pinocchio.rnea(made, made.createData(), q, v, a) + DAMPING * v + FRICTION * sign(v) + OFFSET
    for row, inertia, viscous, coulomb in COUPLINGS:
        row = np.array(row)
        between = np.outer(row, row) - np.diag(row**2)
        tau += between @ (inertia * a + viscous * v) + row * coulomb * sign(row @ v)
    if FOUND:
        made.armature = np.zeros(len(v))
        links = pinocchio.rnea(made, made.createData(), q, v, a)
        made.armature = ARMATURE.copy()
    for law, row, through_gear, with_offset, p in FOUND:
        row, load = np.array(row), through_gear @ (links + with_offset * OFFSET)
        tau += row * law(row @ q, row @ v, load, p)
    for row, through_gear, share in HIDDEN_SHARES:
        tau -= np.array(row) * share * (through_gear @ tau)
    return tau
'''


def pinocchio_module(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The module, and what is not in it."""
    joints = []
    for axis, frame in enumerate(joint_frames(arm.robot)):
        described = arm.robot.joint[axis]
        mass, center, tensor = about_center(arm.links[axis])
        arrays = (frame.axis, frame.rotation, frame.position)
        body = (mass, center.tolist(), tensor.tolist())
        limits = (*described.position, described.velocity, described.torque)
        joints.append((described.name, described.kind, *(a.tolist() for a in arrays), *body, *limits))
    couplings = [
        (coupling.row.tolist(), coupling.inertia, coupling.viscous, coupling.coulomb)
        for coupling in arm.couplings
    ]
    settings, lost = arm.robot.identification, not_in_pinocchio(arm)
    text = _TEMPLATE.format(
        heading=arm.heading,
        lost=indent("\n".join(f"- {one}" for one in lost) or "- nothing of the model.", ""),
        gravity=list(arm.robot.gravity),
        joints=pformat(joints, width=110),
        armature=arm.armature.tolist(),
        damping=arm.damping.tolist(),
        friction=arm.friction.tolist(),
        offset=arm.offset.tolist(),
        couplings=pformat(couplings, width=110),
        width=settings.friction_width if settings.friction_sign == "tanh" else 0.0,
        name=arm.robot.name,
        laws=source_of_laws(arm),
        gains=source_of_gains(arm),
    )
    return text.encode(), lost
