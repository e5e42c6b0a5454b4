"""Where a log's torque comes from: at the joint, at the motor through a ratio, or a current through a gain.

Decided on the data: the torque that the URDF's bodies ask for, beside the one that was logged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import Sampled
from daq.importing.proof import TorqueProof
from daq.recording.errors import CaptureError
from ident.listing import listed, short
from robots import Robot
from robots.arrays import BoolArray, FloatArray
from robots.loose_urdf import LooseUrdf

_SEEN = 5.0
"""Deviations that a share must have to say something."""
_NEAR = 2.5
"""A factor by which a URDF's masses may be wrong: what is farther off is in another unit."""
_UNTOLD = 0.5
"""Share of its variance that a motion may leave of a torque that is its joint's."""
_BETTER = 2.0
"""Times less that the right motion leaves of a torque than a wrong one."""
_AXES = 8
"""Joints that a message names all, if their names are short."""
_MILLI = {"mnm"}
_OF_LIBFRANKA = {"tau", "ext", "hat", "filtered"}


@dataclass(frozen=True)
class LogHints:
    """What a user may say of a log beside the guesses; None (or empty) where it is to be guessed.

    Attributes:
        sample_rate: samples per second, where no column has the time.
        ratio: motor turns per turn of the joint, one per joint.
        gain: torque at the joint, N·m or N, per unit of the logged current or signal.
        offset: added to the joint positions, rad or m.
        sensor: torques are those of sensors at the links.
    """

    sample_rate: float | None = None
    ratio: tuple[float, ...] = ()
    gain: tuple[float, ...] = ()
    offset: tuple[float, ...] = ()
    sensor: bool = False


def with_sensors(channels: Sequence[Channels], hints: LogHints) -> LogHints:
    """What the user says, and that torques are of sensors at the links where libfranka wrote the log.

    Its ``tau_J`` is documented so. Those letters alone may be "torque of joint 1" elsewhere; the name of its
    estimate ``tau_ext_hat_filtered``, which stands beside it, nobody else has.
    """
    written = any({*c.words} >= _OF_LIBFRANKA for c in channels)
    return replace(hints, sensor=True) if written else hints


def torque_table(
    torque: Channels,
    log: Sampled,
    robot: Robot,
    offset: FloatArray,
    constants: dict[str, FloatArray],
    hints: LogHints,
    arm: LooseUrdf,
) -> tuple[dict[str, Any], list[str]]:
    """What the map says of the torque, and the sentences on it.

    Args:
        torque: the channel.
        log: its motion.
        robot: the arm.
        offset: of the positions.
        constants: vectors of the log with one number per joint.
        hints: what the user says.
        arm: the URDF as it was read.

    Raises:
        CaptureError: nothing says in which unit it is.
    """
    given, key = given_factor(hints, log)
    logged = log.even(torque.values[:, log.moving])
    at_joints = np.asarray((logged * given) @ robot.transmission_matrix)
    proof = TorqueProof.of(robot, log.position, at_joints, log.period, log.cutoff)
    share, sigma = proof.shares(offset)
    turned = proof.turned(offset, (share < -_SEEN * sigma) & arm.has_masses)
    signs = np.ones(robot.n)
    signs[turned] = -1.0
    raw = TorqueProof.of(robot, log.position, logged, log.period, log.cutoff)
    words = [f"torque: {torque.label}", *exchanged(robot, raw.explained(offset))]
    if turned:
        names = listed([robot.joint[k].name for k in turned], few=_AXES)
        words.append(
            f"torque of {names}: turned round, as friction or bodies would drive the motion otherwise"
        )
    share = share * signs
    seen = (share > _SEEN * sigma) & arm.has_masses
    slides = [joint.kind == "prismatic" for joint in robot.joint]
    unit, mixed = "N" if all(slides) else "N*m", any(slides) and not all(slides)
    if key == "gain" or (key == "ratio" and _nearer(share, given, seen)):
        odd = "" if _agree(1.0, share, seen) else "; look it over"
        words.append(f"torque: times the {key} that was given{_beside(robot, share, seen)}{odd}")
        words += _doubts(robot, arm, share, sigma, f"the {key} that was given")
        return _table(key, given * signs, unit), words
    share, sigma = share / np.abs(given), sigma / np.abs(given)
    signs = signs * np.sign(given)
    milli = bool(_MILLI & set(torque.words))
    scaled = np.where(np.array(slides) | (not milli), 1.0, 1e-3)
    if hints.sensor:
        beside = _beside(robot, scaled * share, seen)
        words.append(f"torque: of sensors at the links, so without the rotors' inertia{beside}")
        words += _doubts(robot, arm, scaled * share, scaled * sigma, "its column's name")
        if not turned:
            return {"unit": "mN*m" if (scaled != 1.0).any() else unit, "side": "sensor"}, words
        return _table("gain", scaled * signs, unit), words
    if torque.kind == "torque" and _agree(scaled, share, seen):
        said = "N*m and N" if mixed else unit
        words.append(f"torque: in {said} at the joints{_beside(robot, scaled * share, seen)}")
        words += _doubts(robot, arm, scaled * share, scaled * sigma, "its column's name")
        if not turned:
            return {"unit": "mN*m" if (scaled != 1.0).any() else unit}, words
        return _table("gain", scaled * signs, unit), words
    found = _constant(constants, share, seen)
    if found:
        values = constants[found]
        words.append(
            f"torque: times {found}, which makes it that of the URDF{_beside(robot, values * share, seen)}"
        )
        words += _doubts(robot, arm, values * share, values * sigma, found)
        return _table("gain" if torque.kind != "torque" else "ratio", constants[found] * signs, unit), words
    if not seen.any():
        raise CaptureError(
            f"{log.name}: no mass of the URDF is seen in {torque.label}; give --ratio or --gain"
        )
    return _from_masses(raw, offset, share, seen, signs, unit, words)


def exchanged(robot: Robot, explained: FloatArray) -> list[str]:
    """A sentence where columns of torques stand in the place of others.

    Of all orders of the columns the likeliest is taken, by what each joint's motion leaves of the torque
    beside it. It counts where every joint foretells the torque that stands elsewhere far better than its own.

    Args:
        robot: names of the joints.
        explained: (n, n) share of the torque in row i that the motion of joint j foretells.
    """
    if not np.isfinite(explained).all():
        return []  # the log has values that are no numbers, which loading it refuses
    from scipy.optimize import linear_sum_assignment  # takes time to load

    left = np.maximum(1.0 - explained, np.finfo(float).eps)
    torques, joints = linear_sum_assignment(np.log(left))
    moved = [(i, j) for i, j in zip(torques, joints, strict=True) if i != j]
    if not moved or not all(left[i, j] < min(_UNTOLD, left[i, i] / _BETTER) for i, j in moved):
        return []
    names = listed([robot.joint[i].name for i, _ in moved], few=_AXES)
    found = listed([f"{100 * explained[i, j]:.0f} % by {robot.joint[j].name}" for i, j in moved], few=2)
    return [f"torques of {names}: other joints' motion foretells them ({found}); exchanged? look it over"]


def given_factor(hints: LogHints, log: Sampled) -> tuple[FloatArray, str]:
    """Gain or ratio of the joints that move, and which of both it is; ones where none was given."""
    for key, values in (("gain", hints.gain), ("ratio", hints.ratio)):
        if values:
            if max(log.moving) >= len(values):
                raise CaptureError(f"--{key} has {len(values)} numbers; allowed: one per joint of the log")
            return np.array(values)[log.moving], key
    return np.ones(len(log.moving)), ""


def _nearer(share: FloatArray, ratio: FloatArray, seen: BoolArray) -> bool:
    """Whether the torques are the motors': the ratio takes them nearer to those of the URDF's bodies."""
    if not seen.any():
        return True
    with_ratio = np.median(np.abs(np.log(share[seen])))
    return bool(with_ratio <= np.median(np.abs(np.log(share[seen] / np.abs(ratio[seen])))))


def _agree(scale: float | FloatArray, share: FloatArray, seen: BoolArray) -> bool:
    """Whether torques with that scale are those of the URDF's bodies, as far as they are seen."""
    if not seen.any():
        return True
    off = np.abs(np.log(np.abs(np.broadcast_to(scale, share.shape)[seen] * share[seen])))
    return bool(np.median(off) < np.log(_NEAR))


def _constant(constants: dict[str, FloatArray], share: FloatArray, seen: BoolArray) -> str:
    """Name of the vector of the log that takes its torques to the URDF's; empty where there is none."""
    if not seen.any():
        return ""
    off = {
        name: float(np.median(np.abs(np.log(values[seen] * share[seen]))))
        for name, values in constants.items()
        if (values > 0).all() and np.median(values) > 1.0
    }
    best = min(off, key=lambda name: off[name], default="")
    return best if best and off[best] < np.log(_NEAR) else ""


def _beside(robot: Robot, share: FloatArray, seen: BoolArray) -> str:
    """How it compares with the URDF's masses, in words: the least and the most of the joints they show at."""
    if not seen.any():
        return "; the URDF's masses do not show in it"
    known = np.flatnonzero(seen)
    ends = known[np.argsort(share[known])][[0, -1]] if known.size > 2 else known
    names = ["" if robot.n == 1 else f" ({short(joint.name)})" for joint in robot.joint]
    each = (" to " if known.size > 2 else ", ").join(f"{100 * share[k]:.0f} %{names[k]}" for k in ends)
    return f"; {each} of what the URDF's bodies ask for"


def _doubts(robot: Robot, arm: LooseUrdf, share: FloatArray, sigma: FloatArray, by: str) -> list[str]:
    """A sentence for each joint whose torque cannot be that of the URDF's bodies, and one on those unseen.

    A torque that is too small by a factor has a deviation that is too small by the same, so it need not
    be seen in the torque that it is not of the bodies.

    Args:
        robot: names of the joints.
        arm: whether its bodies have masses.
        share, sigma: (n,) torque per torque of the URDF's bodies, and its deviation.
        by: what says the torque's scale.
    """
    if not arm.has_masses:
        return []
    least, most = share - _SEEN * sigma, share + _SEEN * sigma
    small, large = most < 1 / _NEAR, least > _NEAR
    words = []
    for k in np.flatnonzero(small | large):
        bound = f"at most {100 * most[k]:.2g}" if small[k] else f"at least {100 * least[k]:.3g}"
        words.append(
            f"torque of {robot.joint[k].name}: {bound} % of what the URDF's bodies ask for:"
            " another unit, or a counterbalance? look it over"
        )
    unseen = listed([robot.joint[k].name for k in np.flatnonzero(~(small | large | (least > 0)))], few=_AXES)
    if unseen and (least > 0).any():
        words.append(f"scale of the torque of {unseen}: by {by} alone, no mass shows it; look it over")
    return words


def _table(key: str, values: FloatArray, unit: str) -> dict[str, Any]:
    side = "motor" if key == "ratio" else "current"
    return {
        "side": side,
        key: [float(f"{value:.8g}") for value in values],
        **({"unit": unit} if key == "ratio" else {}),
    }


def _from_masses(
    proof: TorqueProof,
    offset: FloatArray,
    share: FloatArray,
    seen: BoolArray,
    signs: FloatArray,
    unit: str,
    words: list[str],
) -> tuple[dict[str, Any], list[str]]:
    """Gains that make one set of bodies explain all joints, scaled by the URDF's masses."""
    usual = float(np.exp(np.median(-np.log(share[seen]))))
    start = np.where(seen, 1 / np.where(seen, share, 1.0), usual) * signs
    gains = proof.gains(offset, start)
    found = " ".join(f"{gain:.4g}" for gain in gains)
    words.append(
        f"torque: gain {found} {unit} per unit, found from the URDF's masses: known no better than those"
    )
    return _table("gain", gains, unit), words
