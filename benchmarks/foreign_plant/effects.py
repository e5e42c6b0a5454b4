"""What can be hidden in an arm, by name, joint and size.

Most names are armhil's own words, so that an answer can be scored; the last ones are words that it does not
have.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OF_A_JOINT = {
    "viscous_friction": "N·m·s/rad more",
    "coulomb_friction": "N·m more",
    "asymmetric_friction": "N·m of dry friction more forwards, less backwards; that share of the viscous",
    "stribeck_friction": "N·m more at low speed, 5 % of the speed limit wide",
    "static_friction": "N·m more at standstill, 0.1 % of the speed limit wide",
    "nonlinear_viscous_friction": "N·m at half the speed limit, growing with its cube",
    "load_dependent_friction": "N·m of friction per N·m through the gear",
    "drifting_friction": "share of the friction that is gained, with 15 s",
    "position_dependent_friction": "share of the Coulomb friction, twice a turn",
    "joint_elasticity": "N·m/rad between rotor and link",
    "backlash": "rad of play between rotor and link",
    "hysteresis": "N·m of a bristle that takes 5 mrad to slip",
    "wrist_coupling": "N·m of friction over this joint's and the next one's speed together",
    "torque_ripple": "N·m, 64 times a turn",
    "drive_gain_error": "relative",
    "current_offset": "N·m",
    "saturation": "N·m that the motor does not exceed",
    "rotor_inertia": "kg·m² more",
    "current_loop_lag": "s",
    "time_delay": "s from control signal to torque",
    "gravity_spring": "N·m/rad about the middle of the travel",
    "cable_spring": "N·m/rad^3 about the middle of the travel, cubic",
    "contact": "N·m/rad beyond where the motion to fit spends a tenth of its time",
    "eddy_brake": "N·m at 8 % of the speed limit, less above",
    "crosstalk": "share of the joint before's torque",
    "command_dead_zone": "N·m of command that the drive does not answer",
    "torque_constant_droop": "share of the gain lost at the torque limit",
    "encoder_eccentricity": "rad, once a turn",
    "temperature_viscous_friction": "share of the viscous friction lost, with 20 s",
    "directional_efficiency": "share of the load's torque lost where the load drives the motor",
    "dragging_brake": "N·m during a third of every 7 s",
}
"""Name: what its size is."""

OF_THE_TOOL = {
    "payload": "kg, 60 mm in front of the last joint's frame",
    "slosh": "kg on a pendulum of 80 mm at the tool",
}
OF_THE_BASE = {
    "base_tilt": "rad about the base's x axis",
    "base_compliance": "N·m/rad about the base's x axis",
}
NAMES = {**OF_A_JOINT, **OF_THE_TOOL, **OF_THE_BASE}

OUTSIDE = (
    "eddy_brake",
    "crosstalk",
    "slosh",
)
"""Names that armhil's vocabulary of 2026-11 does not hold."""

NUMBER = {name: number for number, name in enumerate(OF_A_JOINT)}
"""How the compiled loop calls them."""


@dataclass(frozen=True)
class Effect:
    """One hidden effect: its name, its joint from 0 (−1 for tool and base) and its size, as in ``NAMES``."""

    name: str
    joint: int
    size: float

    def words(self) -> str:
        place = f"joint {self.joint + 1}" if self.joint >= 0 else "arm"
        return f"{self.name} of {place}: {self.size:g} ({NAMES[self.name]})"


def parse_effect(text: str, n: int) -> Effect:
    """``NAME@JOINT=SIZE`` with the joint from 1; ``NAME=SIZE`` for tool and base.

    Raises:
        ValueError: says what is allowed.
    """
    head, _, size = text.partition("=")
    name, _, joint = head.partition("@")
    if name not in NAMES:
        raise ValueError(f"{name!r} is no effect; allowed: {', '.join(NAMES)}")
    needs_joint = name in OF_A_JOINT
    if needs_joint and not (joint.isdigit() and 1 <= int(joint) <= n):
        raise ValueError(f"{text!r}: allowed: {name}@JOINT=SIZE with a joint from 1 to {n}")
    try:
        value = float(size)
    except ValueError:
        raise ValueError(f"{text!r}: the size is no number ({NAMES[name]})") from None
    return Effect(name, int(joint) - 1 if needs_joint else -1, value)


def table(effects: tuple[Effect, ...]) -> np.ndarray:
    """(effects of a joint, 3): number, joint, size."""
    rows = [(NUMBER[e.name], e.joint, e.size) for e in effects if e.name in NUMBER]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def total(effects: tuple[Effect, ...], name: str) -> float:
    """Sum of the sizes of one name."""
    return sum(effect.size for effect in effects if effect.name == name)
