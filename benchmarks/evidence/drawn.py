"""Logs of foreign plants drawn from seeds (:mod:`benchmarks.foreign_plant`), kept on disk once drawn.

A seed rules the arm, its controller, how its friction begins, how wrong the described gains are, motion and
repeats, what is known before, what is hidden and how large it is. A fifth of the logs hides nothing, a fifth
two effects, and one in ten something that the vocabulary does not have.
"""

from __future__ import annotations

import logging
import pickle
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import robots
from benchmarks.evidence import whole
from benchmarks.evidence.case import UNKNOWN, Case, Truth
from benchmarks.foreign_plant import ARMS, Arm, Effect, Settings, record
from benchmarks.foreign_plant.effects import OUTSIDE
from benchmarks.foreign_plant.files import write_description
from ident import Recording

_log = logging.getLogger(__name__)

_SHARES = {
    "viscous_friction": ("viscous", 0.4),
    "coulomb_friction": ("coulomb", 0.4),
    "asymmetric_friction": ("coulomb", 0.3),
    "stribeck_friction": ("coulomb", 0.5),
    "nonlinear_viscous_friction": ("coulomb", 0.3),
    "hysteresis": ("coulomb", 0.3),
    "torque_ripple": ("coulomb", 0.2),
    "current_offset": ("coulomb", 0.3),
    "rotor_inertia": ("rotor", 0.4),
    "gravity_spring": ("torque", 0.05),
    "eddy_brake": ("coulomb", 0.5),
    "dragging_brake": ("coulomb", 0.4),
}
"""Sizes as shares of a figure of the joint."""
_SIZES = {
    "load_dependent_friction": 0.15,
    "drifting_friction": 0.35,
    "position_dependent_friction": 0.4,
    "drive_gain_error": 0.06,
    "current_loop_lag": 0.003,
    "time_delay": 0.003,
    "payload": 1.0,
    "base_tilt": 0.03,
    "backlash": 0.002,
    "crosstalk": 0.1,
    "torque_constant_droop": 0.15,
}
"""Sizes in the effects' own units."""
_OUTSIDE = ("eddy_brake", "crosstalk")
_WHOLE_FROM = 96_000
"""Seeds from here on have every effect of the plant (:mod:`benchmarks.evidence.whole`)."""
_TAKEN_UP = (
    "viscous_friction",
    "coulomb_friction",
    "current_offset",
    "rotor_inertia",
    "gravity_spring",
    "drive_gain_error",
    "payload",
    "base_tilt",
)
"""What a refit takes up almost whole."""
_KINDS = (0.2, 0.5, 0.2, 0.1)
"""Chances: nothing, one effect, two, one that the vocabulary does not have."""

_ACCEPTED = 900_000
"""Seed of the clean log that an arm's prior is made of, and of nothing else."""


@dataclass(frozen=True)
class Draw:
    """How a log is made.

    Attributes:
        arm: its name.
        settings: motion, repeats, controller, friction, error of the described gains.
        refit: whether nothing is known before; else a model accepted on a clean log of the same arm.
    """

    arm: str
    settings: Settings
    refit: bool


def draw_of(seed: int) -> Draw:
    """What a seed rules but the effects."""
    random = np.random.default_rng([seed, 8])
    arm = str(random.choice(sorted(ARMS), p=(0.5, 0.25, 0.25)))
    settings = Settings(
        motion=random.choice(("waypoints", "multisine", "fourier"), p=(0.45, 0.3, 0.25)),
        periods=int(random.choice((3, 1), p=(0.75, 0.25))),
        law=random.choice(("p_pi", "pd", "pd_torque"), p=(0.5, 0.25, 0.25)),
        friction=random.choice(("tanh", "stick")),
        feed_forward=float(random.choice((1.0, 0.6))),
        gain_error=float(random.choice((0.0, 0.05, -0.05), p=(0.5, 0.25, 0.25))),
    )
    return Draw(arm, settings, bool(random.choice((False, True), p=(0.8, 0.2))))


def drawn(seed: int, folder: Path) -> Case:
    """The case of a seed, validated on one period of another motion; ``folder`` keeps the logs."""
    draw = draw_of(seed)
    arm, settings, effects = ARMS[draw.arm], draw.settings, hidden(seed)
    same = replace(settings, motion="waypoints", periods=3)
    kind = f"{arm.name}-{same.law}-{same.friction}-{same.feed_forward}-{same.gain_error}"
    own = folder / kind
    if not (own / "robot.toml").exists():
        write_description(own, arm, settings)
    robot = robots.load(str(own))
    clean = None if draw.refit else _kept(folder / f"{kind}.pkl", arm, same, (), _ACCEPTED, 0)
    fit, held = (
        _kept(folder / f"seed-{seed}-{part}.pkl", arm, one, effects, seed, part)
        for part, one in enumerate((settings, replace(settings, periods=1)))
    )
    return Case(f"seed {seed}", "foreign", robot, fit, held, truth_of(effects), clean)


def hidden(seed: int) -> tuple[Effect, ...]:
    """None, one or two effects of the plant at joints of their own; sizes vary by a third."""
    draw, random = draw_of(seed), np.random.default_rng(seed)
    arm, kind = ARMS[draw.arm], int(random.choice(4, p=_KINDS))
    if seed >= _WHOLE_FROM:
        return _of_whole(seed, draw, random, kind)
    inside = sorted({*_SHARES, *_SIZES} - set(_OUTSIDE) - set(_TAKEN_UP if draw.refit else ()))
    if kind == 3:
        names = [str(random.choice(_OUTSIDE))]
    else:
        names = [str(one) for one in random.choice(inside, size=kind, replace=False)]
    joints = random.choice(arm.n, size=len(names), replace=False)
    return tuple(_sized(random, name, int(joint), arm) for name, joint in zip(names, joints, strict=True))


def _of_whole(seed: int, draw: Draw, random: np.random.Generator, kind: int) -> tuple[Effect, ...]:
    """As :func:`hidden`, of every effect that the plant has; what does not show is drawn again."""
    arm, count = ARMS[draw.arm], (0, 1, 2, 1)[kind]
    known = OUTSIDE if kind == 3 else whole.names(_TAKEN_UP if draw.refit else ())
    found: list[Effect] = []
    joints = random.permutation(arm.n)
    while len(found) < count:
        name = str(random.choice(known))
        if name in (one.name for one in found):
            continue
        try:
            joint = int(joints[len(found)])
            found.append(whole.effect_of(random, name, joint, arm, draw.settings, seed, draw.refit))
        except RuntimeError as error:
            _log.info("%s", error)
    return tuple(found)


def truth_of(effects: tuple[Effect, ...]) -> Truth:
    """As armhil says it: joints from 1, none for the whole arm."""
    return tuple(
        (UNKNOWN if one.name in OUTSIDE else one.name, () if one.joint < 0 else (one.joint + 1,))
        for one in effects
    )


def _sized(random: np.random.Generator, name: str, joint: int, arm: Arm) -> Effect:
    factor = float(np.exp(random.normal(0.0, 0.3)))
    place = -1 if name in ("payload", "base_tilt") else joint
    if name in _SIZES:
        return Effect(name, place, _SIZES[name] * factor)
    figure, share = _SHARES[name]
    return Effect(name, place, share * factor * float(getattr(arm.links[joint], figure)))


def _kept(
    path: Path, arm: Arm, settings: Settings, effects: tuple[Effect, ...], seed: int, part: int
) -> Recording:
    if path.exists():
        return Recording(*pickle.loads(path.read_bytes()))
    log = record(arm, settings, effects, seed, part)
    values = (path.stem, log.time, log.reference, log.position, log.control_signal)
    path.write_bytes(pickle.dumps(values))
    return Recording(*values)
