"""Torques on the joints besides the links' own: offsets, springs, walls, sloshing, the tool's contact."""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Arm, Motion, Plane, Record, Records
from drivers.simulated.physics.vectors import (
    Vector,
    add,
    cross,
    dot,
    load3,
    rotate,
    scale,
    store,
    subtract,
)
from robots.arrays import FloatArray


@inner
def spring_torque(joint: Record, position: float) -> float:
    """Torque that a spring between two anchors needs: k (L − L0) dL/dq, N·m.

    One anchor is fixed, the other moves with the link; both are in the plane of the motion at given
    radii from the joint's axis, in line at the spring's angle. L² = a² + b² − 2 a b cos(q − angle).
    """
    turned = position - joint.spring_angle
    product: float = joint.spring_fixed_radius * joint.spring_moving_radius
    apart = joint.spring_fixed_radius - joint.spring_moving_radius
    length: float = math.sqrt(apart * apart + 2.0 * product * (1.0 - math.cos(turned)) + 1e-12)
    pull: float = joint.spring_stiffness * (length - joint.spring_length)
    return pull * product * math.sin(turned) / length


@inner
def wall_torque(joint: Record, position: float, velocity: float) -> float:
    """Torque that pushes into a wall, N·m: a spring with a damper that never pulls."""
    above: float = position - joint.wall_upper
    below: float = position - joint.wall_lower
    damping: float = joint.wall_damping * velocity
    if above > 0.0:
        push: float = max(joint.wall_stiffness * above + damping, 0.0)
    elif below < 0.0:
        push = min(joint.wall_stiffness * below + damping, 0.0)
    else:
        push = 0.0
    return push


@inner
def add_joint_loads(
    joints: Records,
    states: Records,
    position: FloatArray,
    velocity: FloatArray,
    push: FloatArray,
    loads: FloatArray,
) -> None:
    """Adds to ``loads`` what the drives have to overcome at each joint, without the tool's contact."""
    for j in range(len(joints)):
        joint = joints[j]
        q, v = position[j], velocity[j]
        load = joint.offset + joint.torsion_stiffness * (q - joint.torsion_centre)
        if joint.spring_stiffness != 0.0:
            load += spring_torque(joint, q)
        if joint.cable_stiffness != 0.0 or joint.cable_cubic != 0.0:
            x = q - joint.cable_centre
            load += (joint.cable_stiffness + joint.cable_cubic * x * x) * x
        if joint.pack_slip > 0.0:
            load += joint.pack_stiffness * (q - joint.pack_centre) + states[j].pack_torque
        if joint.wall_stiffness > 0.0:
            load += wall_torque(joint, q, v)
        if joint.slosh_inertia > 0.0:
            load += joint.slosh_stiffness * (q - states[j].slosh_position)
            load += joint.slosh_damping * (v - states[j].slosh_velocity)
        loads[j] += load - push[j]


@inner
def move_sloshing(
    joints: Records, states: Records, position: FloatArray, velocity: FloatArray, step: float
) -> None:
    """The swinging masses on the joints, by one step."""
    for j in range(len(joints)):
        joint, state = joints[j], states[j]
        if joint.slosh_inertia > 0.0:
            pull = joint.slosh_stiffness * (position[j] - state.slosh_position)
            pull += joint.slosh_damping * (velocity[j] - state.slosh_velocity)
            state.slosh_velocity += step * pull / joint.slosh_inertia
            state.slosh_position += step * state.slosh_velocity


@inner
def add_tool_contact(arm: Arm, motion: Motion) -> None:
    """Adds the joint torques that balance the force of the obstacle on the tool."""
    n = len(motion.position)
    spin, motion_of_origin = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    turn = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    origin = (0.0, 0.0, 0.0)
    for j in range(n):
        row = arm.chain.work[j]
        step = rotate(turn, load3(row, 9))
        origin = add(origin, step)
        motion_of_origin = add(motion_of_origin, cross(spin, step))
        x = rotate(turn, (row[0], row[3], row[6]))
        y = rotate(turn, (row[1], row[4], row[7]))
        axis = rotate(turn, (row[2], row[5], row[8]))
        turn = (x[0], y[0], axis[0], x[1], y[1], axis[1], x[2], y[2], axis[2])
        if arm.chain.slides[j]:
            motion_of_origin = add(motion_of_origin, scale(motion.velocity[j], axis))
        else:
            spin = add(spin, scale(motion.velocity[j], axis))
        store(motion.tool[j], 0, axis)
        store(motion.tool[j], 3, origin)
        store(motion.tool[j], 6, turn)
    arm_of_tool = rotate(turn, load3(arm.plane.point, 0))
    point = add(origin, arm_of_tool)
    speed = add(motion_of_origin, cross(spin, arm_of_tool))
    force = plane_force(arm.plane, point, speed)
    for j in range(n):
        axis = load3(motion.tool[j], 0)
        if arm.chain.slides[j]:
            motion.loads[j] -= dot(axis, force)
        else:
            motion.loads[j] -= dot(axis, cross(subtract(point, load3(motion.tool[j], 3)), force))


@inner
def plane_force(plane: Plane, point: Vector, speed: Vector) -> Vector:
    """Force of the obstacle on the tool, N."""
    normal = load3(plane.normal, 0)
    depth = plane.distance - dot(normal, point)
    if depth <= 0.0:
        return (0.0, 0.0, 0.0)
    push = max(plane.stiffness * depth - plane.damping * dot(normal, speed), 0.0)
    return scale(push, normal)


@inner
def bend_packs(joints: Records, states: Records, velocity: FloatArray, step: float) -> None:
    """Torque of the strands that slide in each dress pack, N·m, after a step: up to its slip."""
    for j in range(len(joints)):
        if joints[j].pack_slip > 0.0:
            way = velocity[j] * step / joints[j].pack_bend
            states[j].pack_torque += joints[j].pack_slip * way - abs(way) * states[j].pack_torque
