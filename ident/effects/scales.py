"""How large an effect can be in nature: the deviations of its parameters before any data are seen.

They come from the description alone (rated torques, speeds, the drives' a-priori figures), never from the
recordings: a prior that follows the data would be no prior.
"""

from __future__ import annotations

from ident.effects.family import Place
from robots import cad_parameters, rigid_body_model
from robots.description import Robot

_LEAST_FRICTION = 0.02
"""Of the rated torque: friction of an arm whose description does not say any."""

_PAYLOAD = 0.1
"""Of the mass of the links: what an arm is built to carry."""

_USUAL = 25.0
_LIGHTEST = 1e-3
"""kg, of the links of a usual arm, and the least that a description's links are taken for."""

_LEVER = 0.1
"""m, from the last link's frame to what a usual arm carries; longer as the arm is larger."""

_RADIAN = 1.0
"""rad: cables, packs and levers turn with a joint, and what they pull changes over a radian."""

_TYPICAL_SPEED = 0.3
"""Of the speed limit: root mean square of a motion that excites an arm."""


def rated_torque(robot: Robot, place: Place) -> float:
    """Torque limit of a place's first joint, N·m (or N)."""
    return float(robot.joint[place.joints[0]].torque)


def travel(robot: Robot, place: Place) -> float:
    """Half the travel of a place's first joint, rad (or m)."""
    joint = place.joints[0]
    return 0.5 * float(robot.upper[joint] - robot.lower[joint])


def way(robot: Robot, place: Place) -> float:
    """Over which a spring at a place's first joint is bent, rad (or m): half its travel, at most a radian.

    A stiffness has no size of its own: what a spring does is its torque at the end of the way, which on an
    axis of 0.3 m has little to do with that at a metre.
    """
    half = travel(robot, place)
    return half if robot.joint[place.joints[0]].kind == "prismatic" else min(half, _RADIAN)


def dry_friction(robot: Robot, place: Place) -> float:
    """Coulomb friction of a place's first drive, N·m (or N)."""
    return max(robot.drive[place.joints[0]].dynamics.coulomb, _LEAST_FRICTION * rated_torque(robot, place))


def viscous_friction(robot: Robot, place: Place) -> float:
    """Viscous friction of a place's first drive, N·m·s/rad (or N·s/m)."""
    joint = place.joints[0]
    least = _LEAST_FRICTION * rated_torque(robot, place) / robot.joint[joint].velocity
    return max(robot.drive[joint].dynamics.viscous, least)


def friction_power(robot: Robot, place: Place) -> float:
    """What friction of a place's first drive turns into heat at a typical speed, W."""
    speed = _TYPICAL_SPEED * robot.joint[place.joints[0]].velocity
    return (dry_friction(robot, place) + viscous_friction(robot, place) * speed) * speed


def rotor_inertia(robot: Robot, place: Place) -> float:
    """Inertia of a place's first drive at its output, kg·m² (or kg)."""
    joint = place.joints[0]
    least = _LEAST_FRICTION * rated_torque(robot, place) / robot.joint[joint].acceleration
    return max(robot.drive[joint].dynamics.inertia, least)


def payload(robot: Robot) -> tuple[float, float]:
    """Mass, kg, that an arm of this size carries, and its distance from the last link's frame, m."""
    masses = cad_parameters(rigid_body_model(robot))[::10]
    mass = max(float(masses.sum()), _LIGHTEST)
    return _PAYLOAD * mass, _LEVER * (mass / _USUAL) ** (1.0 / 3.0)
