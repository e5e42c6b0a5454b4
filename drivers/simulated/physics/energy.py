"""What springs, gears and swinging masses hold, J: for checks that nothing passive makes energy."""

from __future__ import annotations

import numpy as np

from drivers.simulated.physics.records import SLIP_ELEMENTS, Arm, Motion


def stored_in_gears(arm: Arm, motion: Motion) -> float:
    """Potential energy of the gears' springs and slip elements."""
    drives = arm.drives
    stretch = motion.motors["stretch"]
    x = stretch - np.clip(stretch, -drives["gap"], drives["gap"])
    springs = 0.5 * drives["stiffness"] * x**2 + 0.25 * drives["cubic_stiffness"] * x**4
    elements = 0.5 * drives["slip_stiffness"] / SLIP_ELEMENTS * np.square(motion.slip).sum(axis=1)
    dragged = 0.5 * drives["drag_stiffness"] / SLIP_ELEMENTS * np.square(motion.dragged).sum(axis=1)
    return float(np.sum((springs + elements)[drives["compliant"] != 0]) + dragged.sum())


def stored_in_joints(arm: Arm, motion: Motion) -> float:
    """Energy of springs, cables, walls and swinging masses at the joints, and of the constant offsets."""
    j, q, s = arm.joints, motion.position, motion.joints
    energy = j["offset"] * q + 0.5 * j["torsion_stiffness"] * (q - j["torsion_centre"]) ** 2
    x = q - j["cable_centre"]
    energy += 0.5 * j["cable_stiffness"] * x**2 + 0.25 * j["cable_cubic"] * x**4
    into_upper = np.maximum(q - j["wall_upper"], 0.0)
    into_lower = np.maximum(j["wall_lower"] - q, 0.0)
    energy += 0.5 * j["wall_stiffness"] * (into_upper**2 + into_lower**2)
    energy += 0.5 * j["slosh_inertia"] * s["slosh_velocity"] ** 2
    energy += 0.5 * j["slosh_stiffness"] * (q - s["slosh_position"]) ** 2
    fixed, moving = j["spring_fixed_radius"], j["spring_moving_radius"]
    turned = 2.0 * fixed * moving * (1.0 - np.cos(q - j["spring_angle"]))
    length = np.sqrt((fixed - moving) ** 2 + turned + 1e-12)
    energy += 0.5 * j["spring_stiffness"] * (length - j["spring_length"]) ** 2
    return float(energy.sum())
