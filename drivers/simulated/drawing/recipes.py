"""How each effect is drawn: where it can sit, its shape, and the scenario for a magnitude up to 1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.simulated.drawing import foot, shapes
from drivers.simulated.drawing.places import (
    Axes,
    delay_places,
    each_axis,
    each_revolute,
    each_rotor,
    pairs,
    uncoupled_neighbours,
    whole_arm,
)
from drivers.simulated.drawing.shapes import Entries, Shape, Sized
from robots import Robot


@dataclass(frozen=True)
class Recipe:
    """One effect."""

    places: Callable[[Robot], tuple[Axes, ...]]
    shape: Shape
    """Random and arm-dependent figures of the effect."""
    entries: Callable[[float, Axes, Entries], Entries]
    """The scenario, as a file would hold it."""


def _one(name: str, axis: str, sized: Sized, shape: Shape = shapes.nothing) -> Recipe:
    """An effect with one table on one axis; ``sized`` makes its keys from magnitude and shape."""

    def entries(magnitude: float, place: Axes, drawn: Entries) -> Entries:
        return {name: [{axis: place[0], **sized(magnitude, drawn)}]}

    places = each_axis
    if name in _TURNING_ONLY:
        places = each_revolute
    elif name in _WITH_A_ROTOR:
        places = each_rotor
    return Recipe(places, shape, entries)


_TURNING_ONLY = ("gravity_spring",)
_WITH_A_ROTOR = ("joint_elasticity", "stiffening_elasticity", "backlash", "gear_ripple")


EFFECTS: dict[str, Recipe] = {
    "none": Recipe(whole_arm, shapes.nothing, lambda magnitude, place, shape: {}),
    "viscous_friction": _one("viscous_friction", "drive", *shapes.with_sign(0.9, "change")),
    "coulomb_friction": _one("coulomb_friction", "drive", *shapes.with_sign(0.9, "change")),
    "asymmetric_friction": _one(
        "asymmetric_friction",
        "drive",
        lambda m, s: {"coulomb": m * s["coulomb"], "viscous": m * s["viscous"]},
        shapes.asymmetric,
    ),
    "stribeck_friction": _one(
        "stribeck_friction", "drive", lambda m, s: s | {"rise": 3.0 * m}, shapes.stribeck
    ),
    "static_friction": _one("static_friction", "drive", shapes.static_sized, shapes.static),
    "nonlinear_viscous_friction": _one(
        "nonlinear_viscous_friction", "drive", lambda m, s: s | {"share": m}, shapes.power
    ),
    "load_dependent_friction": _one(
        "load_dependent_friction", "drive", lambda m, s: {"coefficient": 0.4 * m}
    ),
    "load_quadratic_friction": _one(
        "load_quadratic_friction",
        "drive",
        lambda m, s: {"coefficient": m / s["torque"]},
        lambda rng, place: {"torque": place.torque()},
    ),
    "directional_efficiency": _one(
        "directional_efficiency", "drive", lambda m, s: {"driving": 0.4 * m, "driven": 0.15 * m}
    ),
    "drifting_friction": _one("drifting_friction", "drive", shapes.drift_sized, shapes.drift),
    "temperature_viscous_friction": _one(
        "temperature_viscous_friction",
        "drive",
        lambda m, s: s | {"start": 60.0 * m * s["start"]},
        lambda rng, place: {"start": shapes.sign(rng), "time_constant": shapes.between(rng, 4.0, 20.0)},
    ),
    "position_dependent_friction": _one(
        "position_dependent_friction", "drive", shapes.wave_sized, shapes.wave
    ),
    "joint_elasticity": _one("joint_elasticity", "drive", shapes.elastic_sized, shapes.elastic),
    "stiffening_elasticity": _one(
        "stiffening_elasticity", "drive", shapes.stiffening_sized, shapes.stiffening
    ),
    "backlash": _one("backlash", "drive", shapes.play_sized),
    "hysteresis": _one("hysteresis", "drive", shapes.hysteresis_sized, shapes.hysteresis),
    "wrist_coupling": Recipe(uncoupled_neighbours, shapes.shaft, shapes.shaft_entries),
    "gear_ripple": _one("gear_ripple", "drive", lambda m, s: s | {"amplitude": 2e-3 * m}, shapes.ripple),
    "drive_gain_error": _one("drive_gain_error", "drive", *shapes.with_sign(0.4, "change")),
    "current_offset": _one(
        "current_offset", "drive", lambda m, s: {"torque": m * s["torque"]}, shapes.offset
    ),
    "torque_ripple": _one("torque_ripple", "drive", shapes.cogging_sized, shapes.cogging),
    "saturation": _one(
        "saturation", "drive", lambda m, s: {"limit": s["signal"] * (1.0 - 0.6 * m)}, shapes.signal
    ),
    "torque_constant_droop": _one(
        "torque_constant_droop",
        "drive",
        lambda m, s: {"loss": 0.8 * m, "current": s["signal"]},
        shapes.signal,
    ),
    "command_dead_zone": _one(
        "command_dead_zone", "drive", lambda m, s: {"width": 0.2 * m * s["signal"]}, shapes.signal
    ),
    "encoder_eccentricity": _one("encoder_eccentricity", "drive", shapes.scale_sized, shapes.scale),
    "rotor_inertia": _one(
        "rotor_inertia",
        "drive",
        lambda m, s: {"change": 3.0 * m * s["inertia"]},
        lambda rng, place: {"inertia": shapes.reflected(place)},
    ),
    "current_loop_lag": _one("current_loop_lag", "drive", lambda m, s: {"time_constant": 0.008 * m}),
    "payload": Recipe(whole_arm, shapes.payload_shape, shapes.payload_entries),
    "gravity_spring": _one("gravity_spring", "joint", shapes.spring_sized, shapes.spring),
    "base_tilt": Recipe(whole_arm, shapes.tilt_shape, shapes.tilt_entries),
    "base_compliance": Recipe(whole_arm, foot.shape, foot.entries),
    "time_delay": Recipe(delay_places, shapes.delay_shape, shapes.delay_entries),
    "cable_spring": _one("cable_spring", "joint", shapes.cable_sized, shapes.cable),
    "dress_pack_hysteresis": _one("dress_pack_hysteresis", "joint", shapes.pack_sized, shapes.pack),
    "contact": _one("contact", "joint", shapes.wall_sized, shapes.wall),
    "vibration": _one(
        "vibration",
        "joint",
        lambda m, s: {k: s[k] for k in ("frequency", "phase")} | {"amplitude": 0.2 * m * s["torque"]},
        shapes.shaking,
    ),
    "slosh": _one("slosh", "joint", lambda m, s: s | {"inertia": 2.0 * m * s["inertia"]}, shapes.slosh),
    "torque_bursts": _one(
        "torque_bursts",
        "joint",
        lambda m, s: {"deviation": 0.3 * m * s["torque"], "duration": s["duration"], "rate": 0.4},
        lambda rng, place: {"torque": place.torque(), "duration": shapes.between(rng, 0.4, 2.0)},
    ),
    "dither": _one(
        "dither",
        "joint",
        lambda m, s: {"amplitude": 0.2 * m * s["torque"], "frequency": s["frequency"]},
        lambda rng, place: {"torque": place.torque(), "frequency": shapes.between(rng, 5.0, 30.0)},
    ),
    "dragging_brake": _one(
        "dragging_brake",
        "drive",
        lambda m, s: s | {"rise": 3.0 * m},
        lambda rng, place: {"period": shapes.between(rng, 1.3, 4.0), "share": float(rng.uniform(0.2, 0.6))},
    ),
    "thermal_gain_drift": _one(
        "thermal_gain_drift",
        "drive",
        lambda m, s: {"per_kelvin": -0.01, "heating": 60.0 * m / s["square"], "time_constant": s["time"]},
        lambda rng, place: {
            "square": max(place.signal(), 1e-3) ** 2 / 4.0,
            "time": shapes.between(rng, 3.0, 15.0),
        },
    ),
    "missed_samples": _one(
        "missed_samples",
        "drive",
        lambda m, s: {"rate": 100.0 * m, "samples": s["samples"]},
        lambda rng, place: {"samples": int(rng.integers(2, 8))},
    ),
    "torque_crosstalk": Recipe(
        pairs,
        lambda rng, place: {"sign": shapes.sign(rng)},
        lambda m, place, s: {
            "torque_crosstalk": [{"drive": place[0], "source": place[1], "share": 0.5 * m * s["sign"]}]
        },
    ),
}
"""Recipes by name: the vocabulary of the discrepancy search, then effects outside it, and ``none``."""
