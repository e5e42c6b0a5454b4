"""Parameters that the search found beside the truth's, where the plant has that very parameter.

The plant's effects are not those of the vocabulary: a bristle's width is no parameter of a law without one,
and such pairs are left out. What is compared has the same definition on both sides, up to a formula that
stands here.
Only the scoring reads this; the search never sees a scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.simulated import PlantTruth
from drivers.simulated.plant import STEP_RATE
from robots import Robot

Entry = Mapping[str, Any]
Found = Mapping[str, Sequence[float]]
"""Per name of a parameter its value and its standard deviation."""


@dataclass(frozen=True)
class Hidden:
    """One entry of a scenario, on one arm."""

    robot: Robot
    truth: PlantTruth
    entry: Entry
    found: Found

    @property
    def axis(self) -> int:
        """Index of its drive or joint, from 0."""
        return int(self.entry.get("drive", self.entry.get("joint", 1))) - 1

    def figure(self, symbol: str) -> float:
        """The arm's own figure of this drive (Fv, Fc, Ia)."""
        return float(self.truth.per_drive(symbol)[self.axis])

    def shape(self, name: str) -> float:
        """A value that the search found."""
        return float(self.found[name][0])


def compared(
    robot: Robot,
    truth: PlantTruth,
    scenario: Mapping[str, Any],
    effect: str,
    joints: Sequence[int],
    parameters: Found,
) -> dict[str, list[float]]:
    """Per parameter what was found, its standard deviation, and what it is in truth.

    Args:
        robot: the description.
        truth: the arm.
        scenario: what was hidden in it, as plain values.
        effect: name of a finding.
        joints: of the finding, from 1; empty where it is of the whole arm.
        parameters: of the finding.

    Returns:
        Nothing where the scenario has no such effect there, or no parameter of the same definition.
    """
    given = scenario.get(effect)
    if effect not in _TRUE or given is None:
        return {}
    entries = given if isinstance(given, list) else [given]
    here = [entry for entry in entries if _sits_at(entry, joints)]
    if not here:
        return {}
    hidden = Hidden(robot, truth, here[0], parameters)
    number = "" if not joints else str(joints[-1])
    pairs = {}
    for name, true in _TRUE[effect](hidden).items():
        value = _found(parameters, name, number)
        if value is not None:
            pairs[name] = [*value, float(true)]
    return pairs


def coverage(lines: Sequence[Mapping[str, Any]], deviations: float = 3.0) -> dict[str, list[bool]]:
    """Per effect and parameter, whether each truth is within so many deviations of what was found."""
    within: dict[str, list[bool]] = {}
    for line in lines:
        for effect, parameters in line.get("compared", {}).items():
            for name, (value, sigma, true) in parameters.items():
                key = f"{effect}: {name}"
                within.setdefault(key, []).append(bool(abs(value - true) <= deviations * sigma))
    return within


def _sits_at(entry: Entry, joints: Sequence[int]) -> bool:
    if not joints:
        return True
    axes = entry.get("joints") or [entry.get("drive", entry.get("joint"))]
    return sorted(axes) == sorted(joints)


def _found(parameters: Found, name: str, number: str) -> tuple[float, float] | None:
    """Value and deviation of a parameter, or of the amplitude of its cosine and sine."""
    for key in (name, name + number):
        if key in parameters:
            return float(parameters[key][0]), float(parameters[key][1])
    parts = [parameters.get(f"{name}_{wave}{number}") for wave in ("cos", "sin")]
    if parts[0] is None or parts[1] is None:
        return None
    values, sigmas = np.array([parts[0], parts[1]], dtype=np.float64).T
    amplitude = float(np.hypot(*values))
    return amplitude, float(np.hypot(*(values * sigmas)) / max(amplitude, 1e-300))


def _stribeck(hidden: Hidden) -> dict[str, float]:
    if hidden.shape("exponent") != hidden.entry.get("exponent", 1.0):
        return {}  # another law, with another speed
    return {
        "Fs": hidden.entry["rise"] * hidden.figure("Fc"),
        "stribeck_speed": hidden.entry["speed"],
    }


def _power(hidden: Hidden) -> dict[str, float]:
    share, power = hidden.entry.get("share", 0.0), hidden.entry.get("exponent", 0.5)
    if hidden.entry.get("cubic"):
        return {}
    limit, reference = float(hidden.robot.velocity_limits[hidden.axis]), hidden.entry.get("reference", 1.0)
    viscous = share * hidden.figure("Fv")
    return {
        "Fn": viscous * limit * (limit / reference) ** (power - 1.0),
        "Fn_linear": -viscous,
        "power": power,
    }


def _position_dependent(hidden: Hidden) -> dict[str, float]:
    if not hidden.entry.get("wave"):
        return {
            "Fq_spot": hidden.entry["spot"] * hidden.figure("Fc"),
            "spot_centre": hidden.entry["spot_centre"],
            "spot_width": hidden.entry["spot_width"],
        }
    return {
        "Fq": abs(hidden.entry["wave"]) * hidden.figure("Fc"),
        "waves": hidden.entry.get("order", 1.0),
    }


def _elastic(hidden: Hidden) -> dict[str, float]:
    if hidden.entry.get("cubic"):
        return {}
    return {"compliance": 1.0 / hidden.entry["stiffness"]}


def _shaft(hidden: Hidden) -> dict[str, float]:
    first, second = hidden.entry["joints"]
    if first > second or hidden.shape("ratio") != hidden.entry.get("ratios", (1.0, 1.0))[0]:
        return {}
    return {
        "Iam": hidden.entry.get("inertia", 0.0),
        "Fvm": hidden.entry.get("viscous", 0.0),
        "Fcm": hidden.entry.get("coulomb", 0.0),
    }


def _ripple(name: str, key: str, usual: float) -> Callable[[Hidden], dict[str, float]]:
    def true(hidden: Hidden) -> dict[str, float]:
        # One of a period that no gear explains says it otherwise, and its phase is not compared.
        same = hidden.found.get("periods_per_turn", (0.0,))[0] == hidden.entry.get("order", usual)
        return {name: hidden.entry[key]} if same and hidden.entry.get(key) else {}

    return true


def _torque_ripple(hidden: Hidden) -> dict[str, float]:
    """Cogging, or a share of the torque."""
    share = bool(hidden.shape("with_torque"))
    name, key = ("ripple_share", "per_current") if share else ("ripple", "amplitude")
    return _ripple(name, key, 6.0)(hidden)


def _payload(hidden: Hidden) -> dict[str, float]:
    mass, centre = hidden.entry["mass"], hidden.entry.get("centre", (0.0, 0.0, 0.0))
    moments = {f"M{axis}_payload": mass * c for axis, c in zip("XYZ", centre, strict=True)}
    return {"M_payload": mass, **moments}


def _spring(hidden: Hidden) -> dict[str, float]:
    """A torsion spring, or one between two anchors; of both at once nothing."""
    entry = hidden.entry
    torsion, between = entry.get("torsion", 0.0), entry.get("stiffness", 0.0)
    if torsion and between:
        return {}
    if torsion:
        return {"stiffness": torsion, "preload": -torsion * entry.get("centre", 0.0)}
    radii = entry.get("fixed_radius", 0.2) * entry.get("moving_radius", 0.08)
    return {"spring": between * radii, "anchor_angle": entry.get("angle", 0.0)}


def _lag(hidden: Hidden) -> dict[str, float]:
    """Mean delay of the plant's lag, which goes on in steps, each with the current at its end: T − h/2 + …"""
    step = 1.0 / STEP_RATE
    return {"lag": step / float(np.expm1(step / hidden.entry["time_constant"]))}


def _delay(hidden: Hidden) -> dict[str, float]:
    return {"delay": hidden.entry.get("position", 0.0) - hidden.entry.get("torque", 0.0)}


def _wall(hidden: Hidden) -> dict[str, float]:
    upper, lower = hidden.entry.get("upper"), hidden.entry.get("lower")
    side, at = (1.0, upper) if upper is not None else (-1.0, lower)
    if hidden.shape("side") != side:
        return {}
    return {"contact": hidden.entry.get("stiffness", 300.0), "contact_angle": at}


_TRUE: dict[str, Callable[[Hidden], dict[str, float]]] = {
    "viscous_friction": lambda h: {"Fv": h.entry["change"] * h.figure("Fv")},
    "coulomb_friction": lambda h: {"Fc": h.entry["change"] * h.figure("Fc")},
    "asymmetric_friction": lambda h: {
        "dFc": h.entry.get("coulomb", 0.0) * h.figure("Fc"),
        "dFv": h.entry.get("viscous", 0.0) * h.figure("Fv"),
    },
    "stribeck_friction": _stribeck,
    "nonlinear_viscous_friction": _power,
    "load_dependent_friction": lambda h: {"mu": h.entry["coefficient"]},
    "directional_efficiency": lambda h: {
        "mu_mean": 0.5 * (h.entry["driving"] + h.entry["driven"]),
        "dmu": 0.5 * (h.entry["driving"] - h.entry["driven"]),
    },
    # The plant's friction goes exponentially with temperature, the effect's in proportion: the time alone.
    "drifting_friction": lambda h: {"settling_time": h.entry["time_constant"]},
    "position_dependent_friction": _position_dependent,
    "joint_elasticity": _elastic,
    "backlash": lambda h: {"gap": h.entry["width"]},
    "wrist_coupling": _shaft,
    "gear_ripple": _ripple("gear_error", "amplitude", 2.0),
    "drive_gain_error": lambda h: {"gain_error": h.entry["change"] / (1.0 + h.entry["change"])},
    # A current that nobody asks for does a part of the work, so that less is asked for.
    "current_offset": lambda h: {"doff": -h.entry["torque"]},
    "torque_ripple": _torque_ripple,
    "saturation": lambda h: {"torque_limit": h.entry["limit"] * abs(float(h.robot.gains[h.axis]))},
    "rotor_inertia": lambda h: {"dIa": h.entry["change"]},
    "current_loop_lag": _lag,
    "payload": _payload,
    "gravity_spring": _spring,
    "base_tilt": lambda h: {"tilt_x": h.entry.get("roll", 0.0), "tilt_y": h.entry.get("pitch", 0.0)},
    "time_delay": _delay,
    "cable_spring": lambda h: {
        "cable": h.entry.get("stiffness", 0.0),
        "stiffening": h.entry.get("cubic", 0.0),
        "rest_angle": h.entry.get("centre", 0.0),
    },
    "contact": _wall,
}
"""Effects of which the plant has a parameter of the same definition; the others are left out."""
