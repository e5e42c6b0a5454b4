"""What an effect looks like: figures drawn for a place, and the keys of its table for a magnitude up to 1.

Magnitude 1 is the largest that a real arm would still be driven with.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drivers.simulated.drawing.places import Axes, Place
from drivers.simulated.plant import Plant

Entries = dict[str, Any]
"""Keys and values, as a scenario file would hold them; between shape and size, whatever the two agree on."""
Shape = Callable[[np.random.Generator, Place], Entries]
Sized = Callable[[float, Entries], Entries]


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def nothing(rng: np.random.Generator, place: Place) -> Entries:
    return {}


def with_sign(largest: float, key: str) -> tuple[Sized, Shape]:
    """A relative change of either sign."""
    return (
        lambda m, s: {key: s["sign"] * m * largest},
        lambda rng, place: {"sign": sign(rng)},
    )


def asymmetric(rng: np.random.Generator, place: Place) -> Entries:
    return {"coulomb": sign(rng) * 0.8, "viscous": sign(rng) * float(rng.uniform(0.0, 0.5))}


def stribeck(rng: np.random.Generator, place: Place) -> Entries:
    speed = place.robot.velocity_limits[place.index] * between(rng, 0.004, 0.03)
    return {"speed": float(speed), "exponent": float(rng.choice((1.0, 2.0)))}


def static(rng: np.random.Generator, place: Place) -> Entries:
    speed = place.robot.velocity_limits[place.index] * between(rng, 0.0005, 0.0015)
    width = place.ruler.truth.bristle_width[place.index]
    return {"speed": float(speed), "width": width, "longer": between(rng, 10.0, 60.0)}


def static_sized(magnitude: float, shape: Entries) -> Entries:
    displacement = shape["width"] * (1.0 + shape["longer"] * magnitude)
    return {"speed": shape["speed"], "rise": 3.0 * magnitude, "displacement": displacement}


def power(rng: np.random.Generator, place: Place) -> Entries:
    return {"exponent": between(rng, 0.3, 0.7), "reference": between(rng, 0.5, 2.0)}


def wave(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    if rng.random() < 0.5:
        return {"order": place.order(rng.choice((1.0, 2.0, 3.0))), "phase": float(rng.uniform(-3.0, 3.0))}
    centre = float(rng.uniform(low + 0.3 * (high - low), high - 0.3 * (high - low)))
    return {"spot_centre": centre, "spot_width": between(rng, 0.08, 0.25) * (high - low)}


def wave_sized(magnitude: float, shape: Entries) -> Entries:
    return shape | ({"spot": 4.0 * magnitude} if "spot_centre" in shape else {"wave": 0.9 * magnitude})


def drift(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "sign": sign(rng),
        "time_constant": between(rng, 4.0, 20.0),
        "ratio": between(rng, 0.25, 1.0),
        "ambient_rate": float(rng.uniform(-0.05, 0.05)),
    }


def drift_sized(magnitude: float, shape: Entries) -> Entries:
    return {
        "start": shape["sign"] * 60.0 * magnitude,
        "time_constant": shape["time_constant"],
        "viscous_per_kelvin": -0.015,
        "coulomb_per_kelvin": -0.015 * shape["ratio"],
        "ambient_rate": shape["ambient_rate"] * magnitude,
    }


def reflected(place: Place) -> float:
    """Inertia at the drive output that sets the scale: the rotor's, or the arm's where the rotor has none."""
    if (rotor := place.figure("Ia")) > 0:
        return rotor
    return 0.3 * float(Plant(place.robot, place.ruler.truth).mass_matrix()[place.index, place.index])


def elastic(rng: np.random.Generator, place: Place) -> Entries:
    return {"inertia": reflected(place)}


def elastic_sized(magnitude: float, shape: Entries) -> Entries:
    # From a rotor that swings against its output at 80 Hz, which the loop of its drive still damps, to 8 Hz.
    frequency = 80.0 * (8.0 / 80.0) ** magnitude
    return {"stiffness": shape["inertia"] * (2.0 * np.pi * frequency) ** 2}


def stiffening(rng: np.random.Generator, place: Place) -> Entries:
    return elastic(rng, place) | {"torque": place.torque()}


def stiffening_sized(magnitude: float, shape: Entries) -> Entries:
    # Twice as stiff where a tenth of the joint's torque would have bent the first stiffness.
    stiffness = elastic_sized(magnitude, shape)["stiffness"]
    return {"stiffness": stiffness, "cubic": stiffness**3 / (0.1 * shape["torque"]) ** 2}


def play_sized(magnitude: float, shape: Entries) -> Entries:
    return {"width": 8e-3 * magnitude}


def hysteresis(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    return {"torque": place.torque(), "displacement": between(rng, 0.01, 0.15) * (high - low)}


def hysteresis_sized(magnitude: float, shape: Entries) -> Entries:
    return {"torque": 0.2 * magnitude * shape["torque"], "displacement": shape["displacement"]}


def shaft(rng: np.random.Generator, place: Place) -> Entries:
    figures = place.ruler.truth.parameters
    second = place.axes[1]
    return {
        "ratio": float(rng.choice((-1.0, -0.5, 0.5, 1.0))),
        "inertia": figures[f"Ia{second}"],
        "viscous": figures[f"Fv{second}"] * float(rng.uniform(0.5, 1.0)),
        "coulomb": figures[f"Fc{second}"] * float(rng.uniform(0.5, 1.0)),
    }


def shaft_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    shaft: Entries = {key: 2.0 * magnitude * shape[key] for key in ("inertia", "viscous", "coulomb")}
    return {"wrist_coupling": [{"joints": list(place), "ratios": [shape["ratio"], 1.0], **shaft}]}


def ripple(rng: np.random.Generator, place: Place) -> Entries:
    return {"order": float(rng.choice((1.0, 2.0))), "phase": float(rng.uniform(-3.0, 3.0))}


def cogging(rng: np.random.Generator, place: Place) -> Entries:
    order, phase = float(rng.choice((1.0, 2.0, 4.0))), float(rng.uniform(-3.0, 3.0))
    return {"order": order, "phase": phase, "torque": place.torque(), "current": float(rng.random() < 0.3)}


def cogging_sized(magnitude: float, shape: Entries) -> Entries:
    kept = {key: shape[key] for key in ("order", "phase")}
    if shape["current"]:
        return kept | {"per_current": 0.3 * magnitude}
    return kept | {"amplitude": 0.2 * magnitude * shape["torque"]}


def scale(rng: np.random.Generator, place: Place) -> Entries:
    gear = float(place.robot.drive[place.index].gear) if place.robot.has_drives else 1.0
    return {"turns": 2.0 * np.pi * gear if place.slides else gear, "phase": float(rng.uniform(-3.0, 3.0))}


def scale_sized(magnitude: float, shape: Entries) -> Entries:
    # A scale of 25 mm whose middle is up to 0.25 mm beside the shaft.
    return shape | {"amplitude": 0.02 * magnitude / shape["turns"]}


def offset(rng: np.random.Generator, place: Place) -> Entries:
    return {"torque": sign(rng) * 0.25 * place.torque()}


def signal(rng: np.random.Generator, place: Place) -> Entries:
    return {"signal": place.signal()}


def payload_shape(rng: np.random.Generator, place: Place) -> Entries:
    heaviest = 0.25 * sum(
        v for k, v in place.ruler.truth.parameters.items() if k[:1] == "M" and k[1:].isdigit()
    )
    return {
        "mass": heaviest,
        "centre": [float(v) for v in rng.uniform((-0.08, -0.08, 0.02), (0.08, 0.08, 0.2))],
    }


def payload_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    mass = shape["mass"] * magnitude
    size = 0.4 * mass * 0.05**2
    return {"payload": {"mass": mass, "centre": shape["centre"], "inertia": [size, size, size]}}


def spring(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    centre = float(rng.uniform(low, high))
    return {"torsion": rng.random() < 0.5, "centre": centre, "torque": place.torque()}


def spring_sized(magnitude: float, shape: Entries) -> Entries:
    if shape["torsion"]:
        return {"torsion": 0.6 * magnitude * shape["torque"], "centre": shape["centre"]}
    # At right angles the spring is about 0.22 m long and pulls on a lever of nearly 0.08 m.
    stiffness = 0.5 * magnitude * shape["torque"] / (0.08 * 0.12)
    return {"stiffness": stiffness, "length": 0.1, "angle": shape["centre"]}


def tilt_shape(rng: np.random.Generator, place: Place) -> Entries:
    return {"direction": float(rng.uniform(-np.pi, np.pi))}


def tilt_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    tilt, direction = 0.35 * magnitude, shape["direction"]
    return {"base_tilt": {"roll": tilt * np.cos(direction), "pitch": tilt * np.sin(direction)}}


def delay_shape(rng: np.random.Generator, place: Place) -> Entries:
    return {"channel": str(rng.choice(("position", "torque"))), "drives": place.robot.n}


def delay_entries(magnitude: float, place: Axes, shape: Entries) -> Entries:
    drives = place or tuple(range(1, shape["drives"] + 1))
    return {"time_delay": [{"drive": drive, shape["channel"]: 0.012 * magnitude} for drive in drives]}


def cable(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    room = high - low
    return {
        "centre": float(rng.uniform(low + 0.3 * room, high - 0.3 * room)),
        "torque": place.torque(),
        "room": room,
        "linear": float(rng.uniform(0.1, 0.5)),
    }


def cable_sized(magnitude: float, shape: Entries) -> Entries:
    reach = 0.6 * shape["room"]
    pull = 0.4 * magnitude * shape["torque"]
    linear = shape["linear"]
    return {
        "centre": shape["centre"],
        "stiffness": linear * pull / reach,
        "cubic": (1.0 - linear) * pull / reach**3,
    }


def pack(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    return {"torque": place.torque(), "bend": between(rng, 0.1, 0.5), "centre": float(rng.uniform(low, high))}


def pack_sized(magnitude: float, shape: Entries) -> Entries:
    pull = 0.1 * magnitude * shape["torque"]
    return {"slip": pull, "bend": shape["bend"], "stiffness": pull, "centre": shape["centre"]}


def wall(rng: np.random.Generator, place: Place) -> Entries:
    low, high = place.travel()
    depth = float(rng.uniform(0.1, 0.3)) * (high - low)
    upper = bool(rng.random() < 0.5)
    return {
        "side": "upper" if upper else "lower",
        "at": high - depth if upper else low + depth,
        "stiffness": 0.8 * place.torque() / depth,
    }


def wall_sized(magnitude: float, shape: Entries) -> Entries:
    stiffness = magnitude * shape["stiffness"]
    return {shape["side"]: shape["at"], "stiffness": stiffness, "damping": 0.01 * stiffness}


def shaking(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "frequency": between(rng, 1.3, 25.0),
        "phase": float(rng.uniform(-3.0, 3.0)),
        "torque": place.torque(),
    }


def slosh(rng: np.random.Generator, place: Place) -> Entries:
    return {
        "frequency": between(rng, 0.8, 4.0),
        "damping": between(rng, 0.01, 0.1),
        "inertia": reflected(place),
    }
