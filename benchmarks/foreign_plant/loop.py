"""The compiled loop: controller samples, forces of hidden effects, and MuJoCo's steps between."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mujoco
import numba
import numpy as np

from benchmarks.foreign_plant.effects import NUMBER

_library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))))
_step = _library.mj_step
_step.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
_step.restype = None

VISCOUS, COULOMB, ASYMMETRIC, STRIBECK, STATIC, CUBIC, LOAD, DRIFT, PLACE = (
    NUMBER[name]
    for name in (
        "viscous_friction",
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "static_friction",
        "nonlinear_viscous_friction",
        "load_dependent_friction",
        "drifting_friction",
        "position_dependent_friction",
    )
)
ELASTIC, PLAY, BRISTLE, WRIST, RIPPLE, GAIN, OFFSET, LIMIT, LAG, DELAY = (
    NUMBER[name]
    for name in (
        "joint_elasticity",
        "backlash",
        "hysteresis",
        "wrist_coupling",
        "torque_ripple",
        "drive_gain_error",
        "current_offset",
        "saturation",
        "current_loop_lag",
        "time_delay",
    )
)
SPRING, CABLE, CONTACT, EDDY, CROSSTALK, DEAD, DROOP, COOLING, ONE_WAY, BRAKE = (
    NUMBER[name]
    for name in (
        "gravity_spring",
        "cable_spring",
        "contact",
        "eddy_brake",
        "crosstalk",
        "command_dead_zone",
        "torque_constant_droop",
        "temperature_viscous_friction",
        "directional_efficiency",
        "dragging_brake",
    )
)
_WIDTH = 0.005
"""rad/s; of the tanh that stands for Coulomb friction."""


class Plant(NamedTuple):
    """MuJoCo's arrays (views) and the arm's figures, n joints."""

    model: int
    data: int
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    applied: np.ndarray
    damping: np.ndarray
    sticking: np.ndarray
    rotor: np.ndarray
    twist: np.ndarray
    figures: np.ndarray
    """(n, 8): viscous, Coulomb, gain, limits of torque and speed, middle of travel, rotor, contact."""
    effects: np.ndarray
    """(k, 3): number, joint, size."""
    step: float
    sticks: bool


class Law(NamedTuple):
    """The controller, n joints; samples × n references and fed-forward signals."""

    cascade: bool
    kp: np.ndarray
    kv: np.ndarray
    ki: np.ndarray
    limit: np.ndarray
    feed_forward: float
    smoothing: float
    delay: int
    period: float
    reference: np.ndarray
    added: np.ndarray


@numba.njit(cache=False)
def _forces(  # noqa: C901 - one branch per effect
    p: Plant, signal: np.ndarray, lagging: np.ndarray, bristle: np.ndarray, time: float
) -> None:
    """Writes applied forces, damping and sticking of the coming step from the signals (n,) that act in it."""
    n = len(p.rotor)
    torque, level = np.empty(n), np.empty(n)
    p.applied[:] = 0.0
    for j in range(n):
        torque[j], level[j] = p.figures[j, 2] * signal[j], p.figures[j, 1]
        p.damping[p.rotor[j]] = p.figures[j, 0]
    for k in range(len(p.effects)):
        kind, j, size = int(p.effects[k, 0]), int(p.effects[k, 1]), p.effects[k, 2]
        if kind == LAG:
            lagging[j] += (1.0 - math.exp(-p.step / size)) * (torque[j] - lagging[j])
            torque[j] = lagging[j]
    for k in range(len(p.effects)):
        kind, j, size = int(p.effects[k, 0]), int(p.effects[k, 1]), p.effects[k, 2]
        r = p.rotor[j]
        q, v, fastest = p.position[r], p.velocity[r], p.figures[j, 4]
        middle, inertia = p.figures[j, 5], p.figures[j, 6]
        if kind == GAIN:
            torque[j] *= 1.0 + size
        elif kind == DROOP:
            torque[j] *= 1.0 - size * min(1.0, (torque[j] / p.figures[j, 3]) ** 2)
        elif kind == DEAD:
            torque[j] = math.copysign(max(abs(torque[j]) - size, 0.0), torque[j])
        elif kind == LIMIT:
            torque[j] = min(max(torque[j], -size), size)
        elif kind == CROSSTALK:
            p.applied[r] += size * torque[j - 1]
        elif kind == OFFSET:
            p.applied[r] += size
        elif kind == RIPPLE:
            p.applied[r] += size * math.sin(64.0 * q + 0.3)
        elif kind == VISCOUS:
            p.damping[r] += size
        elif kind == COULOMB:
            level[j] += size
        elif kind == ASYMMETRIC:
            more = size * math.tanh(v / _WIDTH)
            level[j] += more
            p.damping[r] += more / p.figures[j, 1] * p.figures[j, 0]
        elif kind == STRIBECK:
            level[j] += size * math.exp(-abs(v) / (0.05 * fastest))
        elif kind == STATIC:
            level[j] += size * math.exp(-((v / (0.001 * fastest)) ** 2))
        elif kind == CUBIC:
            p.damping[r] += size * v * v / (0.5 * fastest) ** 3
        elif kind == LOAD:
            level[j] += size * abs(torque[j] - inertia * p.acceleration[r] - _rubbing(p, j, v))
        elif kind == ONE_WAY:
            load = torque[j] - inertia * p.acceleration[r] - _rubbing(p, j, v)
            if load * v < 0.0:
                level[j] += size * abs(load)
        elif kind == DRIFT:
            grown = size * (1.0 - math.exp(-time / 15.0))
            level[j] += grown * p.figures[j, 1]
            p.damping[r] += grown * p.figures[j, 0]
        elif kind == COOLING:
            p.damping[r] -= size * (1.0 - math.exp(-time / 20.0)) * p.figures[j, 0]
        elif kind == PLACE:
            level[j] += size * p.figures[j, 1] * math.cos(2.0 * q + 0.7)
        elif kind == BRAKE:
            if time % 7.0 < 7.0 / 3.0:
                level[j] += size
        elif kind == EDDY:
            x = v / (0.08 * fastest)
            p.applied[r] -= 2.0 * size * x / (1.0 + x * x)
        elif kind == WRIST:
            both = v + p.velocity[p.rotor[j + 1]]
            rub = size * math.tanh(both / _WIDTH) + 0.3 * size * both
            p.applied[r] -= rub
            p.applied[p.rotor[j + 1]] -= rub
        elif kind == BRISTLE:
            moved = bristle[j] + p.step * v / 0.005
            bristle[j] = min(max(moved, -1.0), 1.0)
            p.applied[r] -= size * bristle[j]
        elif kind == SPRING:
            p.applied[r] -= size * (q - middle)
        elif kind == CABLE:
            p.applied[r] -= size * (q - middle) ** 3
        elif kind == CONTACT:
            p.applied[r] -= size * max(q - p.figures[j, 7], 0.0)
        elif kind == ELASTIC:
            t = p.twist[j]
            p.applied[t] -= size * p.position[t]
            p.damping[t] = 0.02 * math.sqrt(size * inertia)
        elif kind == PLAY:
            t, stiff = p.twist[j], inertia * (2 * math.pi * 120.0) ** 2
            beyond = max(abs(p.position[t]) - 0.5 * size, 0.0)
            p.applied[t] -= math.copysign(stiff * beyond, p.position[t])
            p.damping[t] = 0.3 * math.sqrt(stiff * inertia) if beyond > 0.0 else 0.0
    for j in range(n):
        r = p.rotor[j]
        v = p.velocity[r]
        p.applied[r] += torque[j]
        if p.sticks:
            p.sticking[r] = max(level[j], 0.0)
        else:
            # Friction linearised about the speed now, its slope as damping, which MuJoCo takes implicitly.
            smooth = math.tanh(v / _WIDTH)
            slope = level[j] * (1.0 - smooth * smooth) / _WIDTH
            p.applied[r] -= level[j] * smooth - slope * v
            p.damping[r] += slope


@numba.njit(cache=False)
def _rubbing(p: Plant, j: int, v: float) -> float:
    friction: float = p.figures[j, 0] * v + p.figures[j, 1] * math.tanh(v / _WIDTH)
    return friction


@numba.njit(cache=False)
def run(  # noqa: C901 - one function, so that its arrays stay in it
    p: Plant,
    law: Law,
    start: np.ndarray,
    readings: np.ndarray,
    quantum: float,
    eccentric: np.ndarray,
    torque_noise: np.ndarray,
    seen: np.ndarray,
    sent: np.ndarray,
    steps: int,
) -> None:
    """Drive the arm along the law's reference; ``seen`` and ``sent`` (samples × n) are written.

    MuJoCo takes velocities first and positions with the new ones, so its positions lie half a step ahead of
    its velocities; an encoder reads at the instant of the velocity.

    Args:
        p, law: the arm and its controller.
        start: (n,) control signals that hold the arm still.
        readings: samples × n, errors of the encoders, rad.
        quantum: of the encoders, rad.
        eccentric: (n,) errors once a turn, rad.
        torque_noise: samples × n, N·m at the joints, held for a sample.
        seen, sent: what the encoders read and the control signals that act from then on.
        steps: of the plant per sample.
    """
    n, samples = len(p.rotor), len(law.reference)
    last, filtered, integral = np.empty(n), np.zeros(n), start.copy()
    coming = np.empty((law.delay + 1, n))
    delays = np.zeros(n)
    longest = 0.0
    for k in range(len(p.effects)):
        if int(p.effects[k, 0]) == DELAY:
            delays[int(p.effects[k, 1])] += p.effects[k, 2]
            longest = max(longest, delays.max())
    kept = int(longest / p.step) + 2
    past, count = np.empty((kept, n)), 0
    lagging, bristle, acting = np.empty(n), np.zeros(n), np.empty(n)
    for j in range(n):
        last[j] = p.position[p.rotor[j]]
        coming[:, j] = start[j]
        past[:, j] = start[j]
        lagging[j] = start[j] * p.figures[j, 2]
    for sample in range(samples):
        before = max(sample - 1, 0)
        for j in range(n):
            r = p.rotor[j]
            q = p.position[r] - 0.5 * p.step * p.velocity[r]
            q += eccentric[j] * math.sin(q) + readings[sample, j]
            q = quantum * np.rint(q / quantum)
            filtered[j] += law.smoothing * ((q - last[j]) / law.period - filtered[j])
            last[j] = q
            fed = law.feed_forward * (law.reference[sample, j] - law.reference[before, j]) / law.period
            error = law.reference[sample, j] - q
            if law.cascade:
                rate = law.kv[j] * (law.kp[j] * error + fed - filtered[j])
                wanted = rate + integral[j]
                grown = law.kv[j] * law.ki[j] * law.period * (law.kp[j] * error + fed - filtered[j])
            else:
                wanted = law.kp[j] * error + law.kv[j] * (fed - filtered[j]) + integral[j]
                wanted += law.added[sample, j]
                grown = law.ki[j] * law.period * error
            output = min(max(wanted, -law.limit[j]), law.limit[j])
            if output == wanted:
                integral[j] += grown
            coming[sample % (law.delay + 1), j] = output
            acting[j] = coming[(sample + 1) % (law.delay + 1), j]
            seen[sample, j], sent[sample, j] = q, acting[j]
        for k in range(steps):
            past[count % kept] = acting
            for j in range(n):
                acting[j] = past[(count - int(delays[j] / p.step + 0.5)) % kept, j]
            _forces(p, acting, lagging, bristle, (sample + k / steps) * law.period)
            for j in range(n):
                p.applied[p.rotor[j]] += torque_noise[sample, j]
                acting[j] = sent[sample, j]
            _step(p.model, p.data)
            count += 1


Run = Callable[..., None]
