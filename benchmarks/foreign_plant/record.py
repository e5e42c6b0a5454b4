"""One log of an arm: its motion, its controller, its noise, and what is hidden in it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.foreign_plant.arms import Arm
from benchmarks.foreign_plant.effects import Effect, table
from benchmarks.foreign_plant.loop import Law, Plant, run
from benchmarks.foreign_plant.model import Model, build
from benchmarks.foreign_plant.motions import reference
from benchmarks.foreign_plant.settings import Settings

QUANTUM = 2e-6
"""rad; of every encoder."""

_ENCODER = 1.5e-6
_PROCESS, _LOGGED = 0.0006, 0.0009
"""Encoder noise, rad; torque noise that moves the arm and that of the log alone, as shares of the limits."""


@dataclass(frozen=True)
class Gains:
    """The controller's figures, (n,) each: as ``robot.toml`` calls them."""

    position: np.ndarray
    velocity: np.ndarray
    integral: np.ndarray
    limit: np.ndarray
    viscous: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class Log:
    """Samples × n: reference and position in rad, control signal; time in s."""

    time: np.ndarray
    reference: np.ndarray
    position: np.ndarray
    control_signal: np.ndarray


def gains(arm: Arm, settings: Settings) -> Gains:
    """Velocity loops of the arm's bandwidth at its mean inertia, position loops at a quarter of that."""
    model = build(arm, settings)
    data = mujoco.MjData(model.mujoco)
    generator = np.random.default_rng(0)
    travel = np.array([link.travel for link in arm.links])
    mean = np.zeros(arm.n)
    for _ in range(40):
        data.qpos[:] = generator.uniform(*travel.T)
        mujoco.mj_forward(model.mujoco, data)
        whole = np.zeros((arm.n, arm.n))
        mujoco.mj_fullM(model.mujoco, data, whole)
        mean += np.diag(whole) / 40
    gain = np.array([link.gain for link in arm.links])
    omega = 2 * np.pi * np.array(arm.bandwidth)
    velocity, position = mean * omega / gain, omega / 3.6
    limit = 1.5 * np.array([link.torque for link in arm.links]) / gain
    viscous = np.array([link.viscous for link in arm.links]) / gain
    integral = position / 3.0
    if settings.law != "p_pi":
        position, integral = position * velocity, position * velocity * position / 6.0
    return Gains(position, velocity, integral, limit, viscous, mean / gain)


def record(arm: Arm, settings: Settings, effects: tuple[Effect, ...], seed: int, part: int) -> Log:
    """A log; ``part`` 0 is to fit, 1 to validate: another motion and other noise of the same arm.

    The arm goes through a period before the log begins, so that the log begins within the motion.
    """
    generator = np.random.default_rng([seed, part])
    period = reference(arm, settings, generator)
    target = np.tile(period, (settings.periods + 1, 1))
    model = build(arm, settings, effects)
    data = mujoco.MjData(model.mujoco)
    data.qpos[model.rotor] = target[0]
    mujoco.mj_forward(model.mujoco, data)
    figures = gains(arm, settings)
    gain = np.array([link.gain for link in arm.links])
    limits = np.array([link.torque for link in arm.links])
    noise = settings.noise
    readings = noise * _ENCODER * generator.normal(size=target.shape)
    torques = noise * _PROCESS * limits * generator.normal(size=target.shape)
    seen, sent = np.empty(target.shape), np.empty(target.shape)
    eccentric = np.zeros(arm.n)
    for effect in effects:
        if effect.name == "encoder_eccentricity":
            eccentric[effect.joint] += effect.size
    # What an arm presses against stands where it stands, whichever motion goes there.
    first = period if part == 0 else reference(arm, settings, np.random.default_rng([seed, 0]))
    plant = _plant(arm, settings, effects, model, data, np.quantile(first, 0.9, axis=0))
    law = _law(arm, settings, figures, target)
    start = data.qfrc_bias[model.rotor] / gain
    run(plant, law, start, readings, QUANTUM, eccentric, torques, seen, sent, settings.steps)
    if not np.isfinite(seen).all() or np.abs(seen - target).max() > 1.0:
        raise RuntimeError(f"{arm.name} with {[e.words() for e in effects]} does not follow its reference")
    logged = sent + noise * _LOGGED * limits / gain * generator.normal(size=sent.shape)
    begins = len(period)
    time = np.arange(len(target) - begins) / settings.rate
    return Log(time, target[begins:], seen[begins:], logged[begins:])


def _plant(
    arm: Arm,
    settings: Settings,
    effects: tuple[Effect, ...],
    model: Model,
    data: mujoco.MjData,
    contact: np.ndarray,
) -> Plant:
    m = model.mujoco
    columns = [
        (o.viscous, o.coulomb, o.gain, o.torque, o.speed, sum(o.travel) / 2, m.dof_armature[r], q)
        for o, r, q in zip(arm.links, model.rotor, contact, strict=True)
    ]
    return Plant(
        model=m._address,
        data=data._address,
        position=data.qpos,
        velocity=data.qvel,
        acceleration=data.qacc,
        applied=data.qfrc_applied,
        damping=_flat(m.dof_damping),
        sticking=m.dof_frictionloss,
        rotor=model.rotor,
        twist=model.twist,
        figures=np.array(columns, dtype=np.float64),
        effects=table(effects),
        step=settings.step,
        sticks=settings.friction == "stick",
    )


def _flat(values: np.ndarray) -> np.ndarray:
    return values if values.ndim == 1 else values[:, 0]


def _law(arm: Arm, settings: Settings, figures: Gains, target: np.ndarray) -> Law:
    cascade = settings.law == "p_pi"
    speed = np.diff(target, axis=0, prepend=target[:1]) * settings.rate
    change = np.diff(speed, axis=0, prepend=speed[:1]) * settings.rate
    if settings.law == "pd_torque":
        added = _inverse(arm, settings, target, speed, change)
    else:
        added = figures.viscous * speed + figures.inertia * change
    return Law(
        cascade=cascade,
        kp=figures.position,
        kv=figures.velocity,
        ki=figures.integral,
        limit=figures.limit,
        feed_forward=settings.feed_forward,
        smoothing=1.0 - float(np.exp(-2 * np.pi * 200.0 / settings.rate)),
        delay=1 if cascade else 0,
        period=1.0 / settings.rate,
        reference=target,
        added=added if not cascade else np.zeros_like(added),
    )


def _inverse(
    arm: Arm, settings: Settings, target: np.ndarray, speed: np.ndarray, change: np.ndarray
) -> np.ndarray:
    """Control signals of the nominal arm's whole torque, without dry friction, along the reference."""
    model = build(arm, settings)
    data = mujoco.MjData(model.mujoco)
    gain = np.array([link.gain for link in arm.links])
    viscous = np.array([link.viscous for link in arm.links])
    found = np.empty_like(target)
    for k, (q, v, a) in enumerate(zip(target, speed, change, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model.mujoco, data)
        found[k] = (data.qfrc_inverse + viscous * v) / gain
    return found
