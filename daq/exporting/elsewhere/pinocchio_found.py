"""Found effects as Python source: torque over position, speed and load, for the module that has no armhil.

Each law gives the torque at its place, a joint or a drive's output, of its position `q`, its speed `v`, the
torque `load` of the links through its gear, and its parameters `p`: the expressions of the vocabulary.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.found import BODIES, TILT, FoundEffect
from ident.effects.placed import speed_limit
from robots import Robot

LAWS = {
    "asymmetric_friction": '    return p["dFc"] * abs(sign(v)) + p.get("dFv", 0.0) * abs(v)',
    "stribeck_friction": (
        '    return p["Fs"] * sign(v) * np.exp(-(abs(v / p["stribeck_speed"]) ** p["exponent"]))'
    ),
    "nonlinear_viscous_friction": (
        '    return p["Fn"] * sign(v) * abs(v / p["speed_limit"]) ** p["power"] + p["Fn_linear"] * v'
    ),
    "load_dependent_friction": (
        '    if "mu" in p:\n'
        '        return p["mu"] * abs(load) * sign(v)\n'
        '    share = p["motor_share"]\n'
        "    whole = abs(load) / (1.0 - share * sign(v) * np.sign(load))\n"
        '    return p["load_friction"] * share * whole * sign(v)'
    ),
    "load_quadratic_friction": '    return p["mu_square"] * load**2 * sign(v)',
    "directional_efficiency": (
        '    return p["mu_mean"] * abs(load) * sign(v) + p["dmu"] * load * sign(v) ** 2'
    ),
    "position_dependent_friction": (
        '    if "Fq_spot" in p:\n'
        '        away = (q - p["spot_centre"]) / p["spot_width"]\n'
        '        return sign(v) * p["Fq_spot"] * np.exp(-0.5 * away**2)\n'
        '    waves = p["waves"] * q\n'
        '    return sign(v) * (p["Fq_cos"] * np.cos(waves) + p["Fq_sin"] * np.sin(waves))'
    ),
    "gravity_spring": (
        '    if "spring" not in p:\n'
        '        return p["stiffness"] * q + p["preload"]\n'
        '    turned, radius = q - p["anchor_angle"], p["moving_radius"]\n'
        "    length = np.sqrt(1.0 + radius**2 - 2.0 * radius * np.cos(turned))\n"
        '    return p["spring"] * np.sin(turned) * (1.0 - p["free_length"] / length)'
    ),
    "cable_spring": (
        '    bent = q - p["rest_angle"]\n    return p["cable"] * bent + p["stiffening"] * bent**3'
    ),
    "contact": (
        '    side = p["side"]\n    return p["contact"] * side * max(side * (q - p["contact_angle"]), 0.0)'
    ),
}
"""Source of each law's body by the effect's name."""
_OF_ALL = "drive_gain_error"
"""A share of the torque of everything else that the drive's signal does not show."""


def not_in_pinocchio(arm: IdentifiedArm) -> tuple[str, ...]:
    """A sentence for each found effect, or part of one, that the module does not hold."""
    late = [one for one in arm.found if one.name in LAWS and "load_memory" in one.shape]
    return arm.lost(BODIES | {TILT, _OF_ALL} | LAWS.keys()) + tuple(
        f"{one.sentence[:-1]} is there without its memory: it follows its load"
        f" {1e3 * one.shape['load_memory']:.3g} ms late."
        for one in late
    )


def source_of_laws(arm: IdentifiedArm) -> str:
    """Functions of the laws that this arm has, and the table of where they act."""
    names = dict.fromkeys(one.name for one in arm.found if one.name in LAWS)
    functions = (f"def {name}(q, v, load, p):\n{LAWS[name]}\n\n\n" for name in names)
    return "".join(functions) + _table("FOUND", arm, lambda one: one.name in LAWS, _entry)


def source_of_gains(arm: IdentifiedArm) -> str:
    """The table of drives whose gain is not what it is thought to be."""
    return _table("HIDDEN_SHARES", arm, lambda one: one.name == _OF_ALL, _share)


def _table(
    name: str,
    arm: IdentifiedArm,
    which: Callable[[FoundEffect], bool],
    entry: Callable[[Robot, FoundEffect], str],
) -> str:
    rows = "".join(f"    {entry(arm.robot, one)},\n" for one in arm.found if which(one))
    return f"{name} = [\n{rows}]" if rows else f"{name} = []"


def _entry(robot: Robot, one: FoundEffect) -> str:
    p = {**one.values, **one.shape}
    if one.name == "nonlinear_viscous_friction":
        p["speed_limit"] = speed_limit(robot, one.row)
    return (
        f"({one.name}, {one.row.tolist()}, {_through_gear(robot, one)}, {p.get('offset_at_link', 0.0)}, {p})"
    )


def _share(robot: Robot, one: FoundEffect) -> str:
    return f"({one.row.tolist()}, {_through_gear(robot, one)}, {one.values['gain_error']})"


def _through_gear(robot: Robot, one: FoundEffect) -> list[float]:
    """(n,) the drive's torque as a combination of joint torques; of a joint its own."""
    if np.count_nonzero(one.row) == 0:
        return [0.0] * robot.n
    column = np.linalg.inv(robot.transmission_matrix)[:, one.joints[0]]
    return [float(value) for value in column]
