"""How each effect is drawn: where it can sit, its shape, and its entry for a magnitude from 0 to 1.

Magnitude 1 is the largest that a real arm would still be driven with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.simulated.drawing.gap import Ruler
from drivers.simulated.plant import Plant
from robots import Robot

Entries = dict[str, Any]
Axes = tuple[int, ...]


@dataclass(frozen=True)
class Place:
    """Where an effect is about to be put, and what is known of the arm there."""

    axes: Axes
    robot: Robot
    ruler: Ruler

    @property
    def index(self) -> int:
        """Of its first axis, from 0."""
        return self.axes[0] - 1

    def figure(self, prefix: str) -> float:
        """The arm's true ``Ia``, ``Fv``, ``Fc`` of the drive."""
        return self.ruler.truth.parameters[f"{prefix}{self.axes[0]}"]

    def travel(self) -> tuple[float, float]:
        """Lowest and highest joint position of the motion."""
        path = self.ruler.quiet.position[:, self.index]
        return float(path.min()), float(path.max())

    def signal(self) -> float:
        """Largest control signal of the motion."""
        return float(np.abs(self.ruler.quiet.control_signal[:, self.index]).max())

    def torque(self) -> float:
        """Torque limit of the joint, N·m."""
        return float(self.robot.torque_limits[self.index])


Shape = Callable[[np.random.Generator, Place], Entries]
Sized = Callable[[float, Entries], Entries]


@dataclass(frozen=True)
class Recipe:
    """One effect."""

    places: Callable[[Robot], tuple[Axes, ...]]
    shape: Shape
    """Random and arm-dependent figures of the effect."""
    entries: Callable[[float, Axes, Entries], Entries]
    """The scenario, as a file would hold it."""


def each_axis(robot: Robot) -> tuple[Axes, ...]:
    """Each joint or drive."""
    return tuple((axis,) for axis in range(1, robot.n + 1))


def each_revolute(robot: Robot) -> tuple[Axes, ...]:
    """Each joint that turns."""
    return tuple((j,) for j, joint in enumerate(robot.joint, start=1) if joint.kind == "revolute")


def each_rotor(robot: Robot) -> tuple[Axes, ...]:
    """Each drive whose rotor has an inertia of its own: only between two masses can a gear give way."""
    return tuple((i,) for i, drive in enumerate(robot.drive, start=1) if drive.dynamics.inertia > 0)


def whole_arm(robot: Robot) -> tuple[Axes, ...]:
    """One place: the arm."""
    return ((),)


def uncoupled_neighbours(robot: Robot) -> tuple[Axes, ...]:
    """Pairs of neighbouring joints of one kind whose drives are not described as coupled."""
    matrix = robot.transmission_matrix
    return tuple(
        (j, j + 1)
        for j in range(1, robot.n)
        if robot.joint[j - 1].kind == robot.joint[j].kind and not matrix[j, j - 1] and not matrix[j - 1, j]
    )


def pairs(robot: Robot) -> tuple[Axes, ...]:
    """Ordered pairs of different drives."""
    return tuple((a, b) for a in range(1, robot.n + 1) for b in range(1, robot.n + 1) if a != b)


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _nothing(rng: np.random.Generator, place: Place) -> Entries:
    return {}


def _one(name: str, axis: str, sized: Sized, shape: Shape = _nothing) -> Recipe:
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
_WITH_A_ROTOR = ("joint_elasticity", "backlash", "gear_ripple")


def _with_sign(largest: float, key: str) -> tuple[Sized, Shape]:
    """A relative change of either sign."""
    return (
        lambda m, s: {key: s["sign"] * m * largest},
        lambda rng, place: {"sign": _sign(rng)},
    )


def _asymmetric(rng: np.random.Generator, place: Place) -> Entries:
    return {"coulomb": _sign(rng) * 0.8, "viscous": _sign(rng) * float(rng.uniform(0.0, 0.5))}


def _stribeck(rng: np.random.Generator, place: Place) -> Entries:
    speed = place.robot.velocity_limits[place.index] * _between(rng, 0.004, 0.03)
    return {"speed": float(speed), "exponent": float(rng.choice((1.0, 2.0)))}


def _static(rng: np.random.Generator, place: Place) -> Entries:
    speed = place.robot.velocity_limits[place.index] * _between(rng, 0.0005, 0.0015)
    width = place.ruler.truth.bristle_width[place.index]
    return {"speed": float(speed), "width": width, "longer": _between(rng, 10.0, 60.0)}


def _static_sized(magnitude: float, shape: Entries) -> Entries:
    displacement = shape["width"] * (1.0 + shape["longer"] * magnitude)
    return {"speed": shape["speed"], "rise": 3.0 * magnitude, "displacement": displacement}


def _power(rng: np.random.Generator, place: Place) -> Entries:
    return {"exponent": _between(rng, 0.3, 0.7), "reference": _between(rng, 0.5, 2.0)}


def _wave(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    if rng.random() < 0.5:
        return {"order": float(rng.choice((1.0, 2.0, 3.0))), "phase": float(rng.uniform(-3.0, 3.0))}
    centre = float(rng.uniform(low + 0.3 * (high - low), high - 0.3 * (high - low)))
    return {"spot_centre": centre, "spot_width": _between(rng, 0.08, 0.25) * (high - low)}


def _wave_sized(magnitude: float, shape: Entries) -> Entries:
    return shape | ({"spot": 4.0 * magnitude} if "spot_centre" in shape else {"wave": 0.9 * magnitude})


def _drift(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "sign": _sign(rng),
        "time_constant": _between(rng, 4.0, 20.0),
        "ratio": _between(rng, 0.25, 1.0),
        "ambient_rate": float(rng.uniform(-0.05, 0.05)),
    }


def _drift_sized(magnitude: float, shape: Entries) -> Entries:
    return {
        "start": shape["sign"] * 60.0 * magnitude,
        "time_constant": shape["time_constant"],
        "viscous_per_kelvin": -0.015,
        "coulomb_per_kelvin": -0.015 * shape["ratio"],
        "ambient_rate": shape["ambient_rate"] * magnitude,
    }


def _reflected(place: Place) -> float:
    """Inertia at the drive output that sets the scale: the rotor's, or the arm's where the rotor has none."""
    if (rotor := place.figure("Ia")) > 0:
        return rotor
    return 0.3 * float(Plant(place.robot, place.ruler.truth).mass_matrix()[place.index, place.index])


def _elastic(rng: np.random.Generator, place: Place) -> Entries:
    return {"inertia": _reflected(place)}


def _elastic_sized(magnitude: float, shape: Entries) -> Entries:
    # From a rotor that swings against its output at 160 Hz down to 12 Hz.
    frequency = 160.0 * (12.0 / 160.0) ** magnitude
    return {"stiffness": shape["inertia"] * (2.0 * np.pi * frequency) ** 2}


def _play_sized(magnitude: float, shape: Entries) -> Entries:
    return {"width": 8e-3 * magnitude}


def _hysteresis(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    return {"torque": place.torque(), "displacement": _between(rng, 0.01, 0.15) * (high - low)}


def _hysteresis_sized(magnitude: float, shape: Entries) -> Entries:
    return {"torque": 0.2 * magnitude * shape["torque"], "displacement": shape["displacement"]}


def _shaft(rng: np.random.Generator, place: Place) -> Entries:
    figures = place.ruler.truth.parameters
    second = place.axes[1]
    return {
        "ratio": float(rng.choice((-1.0, -0.5, 0.5, 1.0))),
        "inertia": figures[f"Ia{second}"],
        "viscous": figures[f"Fv{second}"] * float(rng.uniform(0.5, 1.0)),
        "coulomb": figures[f"Fc{second}"] * float(rng.uniform(0.5, 1.0)),
    }


def _shaft_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    shaft: Entries = {key: 2.0 * magnitude * shape[key] for key in ("inertia", "viscous", "coulomb")}
    return {"wrist_coupling": [{"joints": list(place), "ratios": [shape["ratio"], 1.0], **shaft}]}


def _ripple(rng: np.random.Generator, place: Place) -> Entries:
    return {"order": float(rng.choice((1.0, 2.0))), "phase": float(rng.uniform(-3.0, 3.0))}


def _cogging(rng: np.random.Generator, place: Place) -> Entries:
    order, phase = float(rng.choice((1.0, 2.0, 4.0))), float(rng.uniform(-3.0, 3.0))
    return {"order": order, "phase": phase, "torque": place.torque(), "current": float(rng.random() < 0.3)}


def _cogging_sized(magnitude: float, shape: Entries) -> Entries:
    kept = {key: shape[key] for key in ("order", "phase")}
    if shape["current"]:
        return kept | {"per_current": 0.3 * magnitude}
    return kept | {"amplitude": 0.2 * magnitude * shape["torque"]}


def _offset(rng: np.random.Generator, place: Place) -> Entries:
    return {"torque": _sign(rng) * 0.25 * place.torque()}


def _signal(rng: np.random.Generator, place: Place) -> Entries:
    return {"signal": place.signal()}


def _payload_shape(rng: np.random.Generator, place: Place) -> Entries:
    heaviest = 0.25 * sum(
        v for k, v in place.ruler.truth.parameters.items() if k[:1] == "M" and k[1:].isdigit()
    )
    return {
        "mass": heaviest,
        "centre": [float(v) for v in rng.uniform((-0.08, -0.08, 0.02), (0.08, 0.08, 0.2))],
    }


def _payload_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    mass = shape["mass"] * magnitude
    size = 0.4 * mass * 0.05**2
    return {"payload": {"mass": mass, "centre": shape["centre"], "inertia": [size, size, size]}}


def _spring(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    centre = float(rng.uniform(low, high))
    return {"torsion": rng.random() < 0.5, "centre": centre, "torque": place.torque()}


def _spring_sized(magnitude: float, shape: Entries) -> Entries:
    if shape["torsion"]:
        return {"torsion": 0.6 * magnitude * shape["torque"], "centre": shape["centre"]}
    # At right angles the spring is about 0.22 m long and pulls on a lever of nearly 0.08 m.
    stiffness = 0.5 * magnitude * shape["torque"] / (0.08 * 0.12)
    return {"stiffness": stiffness, "length": 0.1, "angle": shape["centre"]}


def _tilt_shape(rng: np.random.Generator, place: Place) -> Entries:
    return {"direction": float(rng.uniform(-np.pi, np.pi))}


def _tilt_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    tilt, direction = 0.35 * magnitude, shape["direction"]
    return {"base_tilt": {"roll": tilt * np.cos(direction), "pitch": tilt * np.sin(direction)}}


def _delay_places(robot: Robot) -> tuple[Axes, ...]:
    """The bus as a whole as often as each of the drives together."""
    single = each_axis(robot)
    return single + ((),) * len(single) if robot.n > 1 else single


def _delay_shape(rng: np.random.Generator, place: Place) -> Entries:
    return {"channel": str(rng.choice(("position", "torque"))), "drives": place.robot.n}


def _delay_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    drives = place or tuple(range(1, shape["drives"] + 1))
    return {"time_delay": [{"drive": drive, shape["channel"]: 0.012 * magnitude} for drive in drives]}


def _cable(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    room = high - low
    return {
        "centre": float(rng.uniform(low + 0.3 * room, high - 0.3 * room)),
        "torque": place.torque(),
        "room": room,
        "linear": float(rng.uniform(0.1, 0.5)),
    }


def _cable_sized(magnitude: float, shape: Entries) -> Entries:
    reach = 0.6 * shape["room"]
    pull = 0.4 * magnitude * shape["torque"]
    linear = shape["linear"]
    return {
        "centre": shape["centre"],
        "stiffness": linear * pull / reach,
        "cubic": (1.0 - linear) * pull / reach**3,
    }


def _wall(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    depth = float(rng.uniform(0.1, 0.3)) * (high - low)
    upper = bool(rng.random() < 0.5)
    return {
        "side": "upper" if upper else "lower",
        "at": high - depth if upper else low + depth,
        "stiffness": 0.8 * place.torque() / depth,
    }


def _wall_sized(magnitude: float, shape: Entries) -> Entries:
    stiffness = magnitude * shape["stiffness"]
    return {shape["side"]: shape["at"], "stiffness": stiffness, "damping": 0.01 * stiffness}


def _shaking(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "frequency": _between(rng, 1.3, 25.0),
        "phase": float(rng.uniform(-3.0, 3.0)),
        "torque": place.torque(),
    }


def _slosh(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "frequency": _between(rng, 0.8, 4.0),
        "damping": _between(rng, 0.01, 0.1),
        "inertia": _reflected(place),
    }


EFFECTS: dict[str, Recipe] = {
    "none": Recipe(whole_arm, _nothing, lambda magnitude, place, shape: {}),
    "viscous_friction": _one("viscous_friction", "drive", *_with_sign(0.9, "change")),
    "coulomb_friction": _one("coulomb_friction", "drive", *_with_sign(0.9, "change")),
    "asymmetric_friction": _one(
        "asymmetric_friction",
        "drive",
        lambda m, s: {"coulomb": m * s["coulomb"], "viscous": m * s["viscous"]},
        _asymmetric,
    ),
    "stribeck_friction": _one("stribeck_friction", "drive", lambda m, s: s | {"rise": 3.0 * m}, _stribeck),
    "static_friction": _one("static_friction", "drive", _static_sized, _static),
    "nonlinear_viscous_friction": _one(
        "nonlinear_viscous_friction", "drive", lambda m, s: s | {"share": m}, _power
    ),
    "load_dependent_friction": _one(
        "load_dependent_friction", "drive", lambda m, s: {"coefficient": 0.4 * m}
    ),
    "drifting_friction": _one("drifting_friction", "drive", _drift_sized, _drift),
    "position_dependent_friction": _one("position_dependent_friction", "drive", _wave_sized, _wave),
    "joint_elasticity": _one("joint_elasticity", "drive", _elastic_sized, _elastic),
    "backlash": _one("backlash", "drive", _play_sized),
    "hysteresis": _one("hysteresis", "drive", _hysteresis_sized, _hysteresis),
    "wrist_coupling": Recipe(uncoupled_neighbours, _shaft, _shaft_entries),
    "gear_ripple": _one("gear_ripple", "drive", lambda m, s: s | {"amplitude": 2e-3 * m}, _ripple),
    "drive_gain_error": _one("drive_gain_error", "drive", *_with_sign(0.4, "change")),
    "current_offset": _one("current_offset", "drive", lambda m, s: {"torque": m * s["torque"]}, _offset),
    "torque_ripple": _one("torque_ripple", "drive", _cogging_sized, _cogging),
    "saturation": _one("saturation", "drive", lambda m, s: {"limit": s["signal"] * (1.0 - 0.6 * m)}, _signal),
    "rotor_inertia": _one(
        "rotor_inertia",
        "drive",
        lambda m, s: {"change": 3.0 * m * s["inertia"]},
        lambda rng, place: {"inertia": _reflected(place)},
    ),
    "current_loop_lag": _one("current_loop_lag", "drive", lambda m, s: {"time_constant": 0.008 * m}),
    "payload": Recipe(whole_arm, _payload_shape, _payload_entries),
    "gravity_spring": _one("gravity_spring", "joint", _spring_sized, _spring),
    "base_tilt": Recipe(whole_arm, _tilt_shape, _tilt_entries),
    "time_delay": Recipe(_delay_places, _delay_shape, _delay_entries),
    "cable_spring": _one("cable_spring", "joint", _cable_sized, _cable),
    "contact": _one("contact", "joint", _wall_sized, _wall),
    "vibration": _one(
        "vibration",
        "joint",
        lambda m, s: {k: s[k] for k in ("frequency", "phase")} | {"amplitude": 0.2 * m * s["torque"]},
        _shaking,
    ),
    "slosh": _one("slosh", "joint", lambda m, s: s | {"inertia": 2.0 * m * s["inertia"]}, _slosh),
    "torque_bursts": _one(
        "torque_bursts",
        "joint",
        lambda m, s: {"deviation": 0.3 * m * s["torque"], "duration": s["duration"], "rate": 0.4},
        lambda rng, place: {"torque": place.torque(), "duration": _between(rng, 0.4, 2.0)},
    ),
    "dither": _one(
        "dither",
        "joint",
        lambda m, s: {"amplitude": 0.2 * m * s["torque"], "frequency": s["frequency"]},
        lambda rng, place: {"torque": place.torque(), "frequency": _between(rng, 5.0, 30.0)},
    ),
    "brake_drag": _one(
        "brake_drag",
        "drive",
        lambda m, s: s | {"rise": 3.0 * m},
        lambda rng, place: {"period": _between(rng, 1.3, 4.0), "share": float(rng.uniform(0.2, 0.6))},
    ),
    "thermal_gain_drift": _one(
        "thermal_gain_drift",
        "drive",
        lambda m, s: {"per_kelvin": -0.01, "heating": 60.0 * m / s["square"], "time_constant": s["time"]},
        lambda rng, place: {
            "square": max(place.signal(), 1e-3) ** 2 / 4.0,
            "time": _between(rng, 3.0, 15.0),
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
        lambda rng, place: {"sign": _sign(rng)},
        lambda m, place, s: {
            "torque_crosstalk": [{"drive": place[0], "source": place[1], "share": 0.5 * m * s["sign"]}]
        },
    ),
}
"""Recipes by name: the vocabulary of the discrepancy search, then effects outside it, and ``none``."""
