"""Effects of all that a foreign plant can hide, each so large that its own log shows it.

The older draw (:mod:`benchmarks.evidence.drawn`) had 22 names, some so small that no log could show them.
This one has every name of the plant, and enlarges an effect until it changes the torque of some drive by
twice the noise that this has, or its position by twenty times the encoders'. What it changes is told by logs
without noise: the same noise makes another log where a reading falls on another side of the encoder's step.
Where the model is fitted anew, what counts is what it leaves on the rows of the search.

Nor is anything hidden that no arm is driven with: a controller that swings by itself, a gear that loses half
of its load and more, which locks itself; or that is none: a breakaway where friction is smooth over the
speed, which leaves no standstill to break away from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import robots
from benchmarks.foreign_plant import Arm, Effect, Log, Settings, record
from benchmarks.foreign_plant.effects import OUTSIDE
from benchmarks.foreign_plant.files import write_description
from ident import Recording
from ident.discrepancy.by_evidence.evidence.prepared import prepare, settings_for
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray

_SHARES = {
    "viscous_friction": ("viscous", 0.4),
    "coulomb_friction": ("coulomb", 0.4),
    "asymmetric_friction": ("coulomb", 0.3),
    "stribeck_friction": ("coulomb", 0.5),
    "static_friction": ("coulomb", 0.5),
    "nonlinear_viscous_friction": ("coulomb", 0.3),
    "hysteresis": ("coulomb", 0.3),
    "wrist_coupling": ("coulomb", 0.5),
    "command_dead_zone": ("coulomb", 0.3),
    "dragging_brake": ("coulomb", 0.4),
    "eddy_brake": ("coulomb", 0.5),
    "torque_ripple": ("coulomb", 0.2),
    "current_offset": ("coulomb", 0.3),
    "rotor_inertia": ("rotor", 0.4),
    "gravity_spring": ("torque", 0.05),
    "cable_spring": ("torque", 0.1),
    "contact": ("torque", 0.3),
    "joint_elasticity": ("torque", 200.0),
    "base_compliance": ("torque", 300.0),
}
"""Sizes as shares of a figure of the joint, of joint 2 where the base is meant; of a cable its pull at the
end of the travel."""

_SIZES = {
    "load_dependent_friction": 0.15,
    "directional_efficiency": 0.2,
    "drifting_friction": 0.35,
    "temperature_viscous_friction": 0.4,
    "position_dependent_friction": 0.4,
    "drive_gain_error": 0.06,
    "torque_constant_droop": 0.15,
    "encoder_eccentricity": 0.001,
    "current_loop_lag": 0.003,
    "time_delay": 0.003,
    "saturation": 0.9,
    "payload": 1.0,
    "slosh": 1.0,
    "base_tilt": 0.03,
    "backlash": 0.002,
    "crosstalk": 0.1,
}
"""Sizes in the effects' own units; of a saturation the share of the largest torque."""

_OF_ARM = ("payload", "slosh", "base_tilt", "base_compliance")
_LESS_IS_MORE = ("joint_elasticity", "base_compliance", "saturation")
"""A stiffness or a limit shows more where it is less."""

_OF_LOAD = ("load_dependent_friction", "directional_efficiency")
_LOCKS = 0.5
"""Share of its load from which on a gear that loses it locks itself."""

_ABOVE, _SWINGS = 30.0, 0.5
"""Hz, above what any motion has, and the share of a joint's following error there that is a swing."""

_STEP, _MOST = 1.5, 8
_COARSE = 2e-4
"""s; four times the step of a log: whether an effect shows is no matter of the last digit."""

_ENCODER_NOISE = 1.6e-6
_SHOWN, _OF_POSITION = 2.0, 0.1
"""Root mean square of the change of a torque, in those of the noise, and what one of a position counts."""


def names(taken_up: tuple[str, ...]) -> list[str]:
    """What can be hidden that has a name, but for what a refit takes up."""
    return sorted({*_SHARES, *_SIZES} - set(OUTSIDE) - set(taken_up))


def effect_of(
    random: np.random.Generator,
    name: str,
    joint: int,
    arm: Arm,
    settings: Settings,
    seed: int,
    refit: bool = False,
) -> Effect:
    """An effect as large as its log shows it, within a third.

    Args:
        random: draws the size.
        name, joint: of the effect; the joint from 0.
        arm, settings, seed: of the log.
        refit: whether the model is fitted to this log anew.

    Raises:
        RuntimeError: no size of it shows that the arm still follows with.
    """
    if name == "static_friction" and settings.friction == "tanh":
        raise RuntimeError(f"seed {seed}: friction that is smooth over the speed breaks away from nothing")
    factor = float(np.exp(random.normal(0.0, 0.3)))
    short = replace(settings, periods=1, step=_COARSE)
    quiet = replace(short, noise=0.0)
    clean = record(arm, quiet, (), seed, 0)
    noisy = record(arm, short, (), seed, 0)
    shown = _after_a_fit(arm, short, clean, noisy) if refit else _at_all(clean, noisy)
    joint = min(joint, arm.n - 2) if name == "wrist_coupling" else max(joint, 1 if name == "crosstalk" else 0)
    effect = Effect(name, -1 if name in _OF_ARM else joint, factor * _usual(name, joint, arm))
    if name == "saturation":
        peak = float(np.abs(clean.control_signal[:, joint]).max()) * arm.links[joint].gain
        effect = replace(effect, size=peak * min(0.97, 0.9 * factor**0.2))
    step = 1.0 / _STEP if name in _LESS_IS_MORE else _STEP
    step = 0.95 if name == "saturation" else step
    for _ in range(_MOST):
        if name in _OF_LOAD and effect.size >= _LOCKS:
            break
        log = record(arm, quiet, (effect,), seed, 0)
        if _swings(log):
            break
        if shown(log) >= _SHOWN:
            return effect
        effect = replace(effect, size=effect.size * step)
    raise RuntimeError(f"{arm.name}: no size of {name} at joint {joint + 1} shows in the log of seed {seed}")


def _swings(log: Log) -> bool:
    """Whether most of what a joint does beside its reference is faster than any reference is."""
    error = log.reference - log.position
    power = np.abs(np.fft.rfft(error - error.mean(axis=0), axis=0)) ** 2
    fast = np.fft.rfftfreq(log.time.size, float(log.time[1] - log.time[0])) > _ABOVE
    return bool(np.any(power[fast].sum(axis=0) > _SWINGS**2 * power.sum(axis=0)))


def _at_all(clean: Log, noisy: Log) -> Callable[[Log], float]:
    """Of a log without noise: how much it is another than the clean one, in units of the noise."""
    noise = _rms(noisy.control_signal - clean.control_signal)

    def shown(log: Log) -> float:
        torque = _rms(log.control_signal - clean.control_signal) / noise
        position = _rms(log.position - clean.position) / _ENCODER_NOISE
        return float(max(torque.max(), _OF_POSITION * position.max()))

    return shown


def _after_a_fit(arm: Arm, settings: Settings, clean: Log, noisy: Log) -> Callable[[Log], float]:
    """The same of what the usual model, fitted by least squares to the rows of the search, leaves there."""
    with TemporaryDirectory() as folder:
        write_description(Path(folder), arm, settings)
        robot = settings_for(robots.load(folder), _recording(clean))
        base = base_parameters(RegressorModel.of(robot))

    def left(log: Log) -> FloatArray:
        rows = prepare(robot, (_recording(log),))
        columns, weight = base.columns(rows.parts[0].own), np.ones((arm.n, 1))
        for _ in range(2):
            weighted = (columns / weight)[rows.used], (rows.torque / weight[:, 0])[rows.used]
            fitted = np.linalg.lstsq(*weighted)[0]
            rest = np.where(rows.used, rows.torque - columns @ fitted, 0.0)
            weight[:, 0] = np.sqrt(np.sum(rest**2, axis=0) / rows.used.sum(axis=0))
        return weight[:, 0]

    usual, noise = left(clean), left(noisy)

    def shown(log: Log) -> float:
        return float(np.sqrt(np.maximum(left(log) ** 2 - usual**2, 0.0) / noise**2).max())

    return shown


def _recording(log: Log) -> Recording:
    return Recording("drawn", log.time, log.reference, log.position, log.control_signal)


def _rms(change: FloatArray) -> FloatArray:
    """(n,) over the samples."""
    return np.asarray(np.sqrt(np.mean(change**2, axis=0)))


def _usual(name: str, joint: int, arm: Arm) -> float:
    if name in _SIZES:
        return _SIZES[name]
    figure, share = _SHARES[name]
    link = arm.links[1 if name in _OF_ARM else joint]
    way = 0.5 * (link.travel[1] - link.travel[0]) if name == "cable_spring" else 1.0
    return share * float(getattr(link, figure)) / way**3
