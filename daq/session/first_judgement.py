"""Does an arm answer its first motions as its description says? Judged by torque, joint by joint.

A drive reports positions in its own counts, so a wrong sign, gear or encoder cannot be seen in them. What a
described figure is *not* part of tells: the drive's own loop answers a following error with so much control
signal (eq. 4 with the described gains), gravity asks for so much torque at this posture, and friction for so
much against either direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio

from daq.session.first_friction import told_rows, turned_by, ways_of
from daq.session.first_motion import HALF_DEGREE, FirstMotion, Turn
from drivers.frames.samples import Samples
from robots import Robot, rigid_body_model
from robots.arrays import BoolArray, FloatArray
from robots.joint_description import Joint

GRAVITY_TOLERANCE = 0.3
"""Share of the described gravity torque that a described mass, centre or gain may be off by."""
OFFSET_SHARE = 0.03
"""Share of a joint's torque limit that a torque may be off by: offsets of the current measurement."""
STICTION = 1.5
"""At rest, friction may hold up to so many times the described Coulomb friction against or with gravity."""
TOUCH_RATIO = (0.8, 1.25)
MOVE_RATIO = (0.7, 1.4)
"""Of the control signal to what the described loop answers the following error with."""
SIZE_TOLERANCE = 0.15
"""Share of a joint's way that its reading may be off at the end of it."""
STRAY = 0.3
"""Share of a joint's way that any other joint may move meanwhile, besides what friction makes it lag."""
SETTLED = 0.25
"""Share of that lag which may be left when a joint has been held."""


@dataclass(frozen=True)
class Finding:
    """What one joint did otherwise than described, and where to look."""

    joint: str
    text: str

    def __str__(self) -> str:
        return f"{self.joint}: {self.text}"


def described_gravity(robot: Robot, posture: FloatArray) -> FloatArray:
    """(n,) torque that holds the described arm at a posture (n,), N·m or N."""
    model = rigid_body_model(robot)
    return np.asarray(pinocchio.computeGeneralizedGravity(model, model.createData(), posture))


def described_coulomb(robot: Robot) -> FloatArray:
    """(n,) Coulomb friction of each joint moving alone, N·m or N."""
    friction = np.array([drive.dynamics.coulomb for drive in robot.drive])
    return np.asarray(np.abs(robot.transmission_matrix).T @ friction)


def judge_rest(robot: Robot, samples: Samples) -> tuple[list[Finding], list[str]]:
    """The holding torques of an arm at rest beside the described gravity.

    Friction may hold with gravity or against it, so a torque within it says nothing of the sign.

    Returns:
        What is not as described, and the joints of which nothing can be said at rest.
    """
    gravity, friction = described_gravity(robot, samples.position[0]), described_coulomb(robot)
    torque = robot.joint_torque(np.median(samples.control_signal, axis=0))
    slack = STICTION * friction + OFFSET_SHARE * robot.torque_limits
    findings, unjudged = [], []
    for k, joint in enumerate(robot.joint):
        room = GRAVITY_TOLERANCE * abs(gravity[k]) + slack[k]
        if abs(torque[k] - gravity[k]) > room:
            findings.append(
                Finding(joint.name, _gravity_words("at rest", joint, torque[k], gravity[k], room))
            )
        elif 2 * abs(gravity[k]) <= room:
            unjudged.append(joint.name)  # the opposite of it would do as well
    if findings and (turned := _turned_drive(robot, samples.position[0], torque, slack)) is not None:
        drive, keys = turned
        text = f"with the other {keys} of drive[{drive + 1}] all is as described: the sign is likely wrong"
        findings.insert(0, Finding(robot.joint[drive].name, text))
    return findings, unjudged


_TURNS = {
    "sign": (-1.0, -1.0),
    "control_signal.sign": (1.0, -1.0),
    "sign (and control_signal.sign, so that torque is read as now)": (-1.0, 1.0),
}
"""What may be the other way round, and what that makes of a drive's position and of its torque."""


def _turned_drive(
    robot: Robot, posture: FloatArray, torque: FloatArray, slack: FloatArray
) -> tuple[int, str] | None:
    """The one drive (from 0) that makes all torques as described with a sign turned, and which sign.

    None where more than one drive would do.
    """
    coupling = robot.transmission_matrix
    drives = np.linalg.solve(coupling.T, torque)
    fitting: dict[int, list[str]] = {}
    for drive in range(robot.n):
        for keys, (of_position, of_torque) in _TURNS.items():
            there, held = coupling @ posture, drives.copy()
            there[drive] *= of_position
            held[drive] *= of_torque
            gravity = described_gravity(robot, np.asarray(np.linalg.solve(coupling, there), dtype=np.float64))
            off = np.abs(coupling.T @ held - gravity)
            if (off <= GRAVITY_TOLERANCE * np.abs(gravity) + slack).all():
                fitting.setdefault(drive, []).append(keys)
    if len(fitting) != 1:
        return None
    ((turned, found),) = fitting.items()
    return turned, " or ".join(found)


def judge_loop(
    robot: Robot, samples: Samples, motion: FirstMotion, bounds: tuple[float, float] = TOUCH_RATIO
) -> list[Finding]:
    """The control signals beside the following errors, through the described loop, in each joint's turn."""
    answer = described_answer(robot, samples)
    findings = []
    for turn in motion.turns:
        for drive in turned_by(robot, turn.joint):
            ratio, share = _ratio(samples.control_signal[turn.rows, drive], answer[turn.rows, drive])
            if not bounds[0] <= ratio <= bounds[1] or share < 0.5:
                findings.append(Finding(robot.joint[turn.joint].name, _loop_words(int(drive), ratio, share)))
    return findings


def judge_move(robot: Robot, samples: Samples, motion: FirstMotion) -> list[Finding]:
    """Loop, direction, size, gravity and friction of each joint's half degree."""
    gravity = described_gravity(robot, samples.position[0])
    torque = robot.joint_torque(samples.control_signal)
    findings = judge_loop(robot, samples, motion, MOVE_RATIO)
    for turn in motion.turns:
        name = robot.joint[turn.joint].name
        words = [*_size_words(robot, samples, turn), *_torque_words(robot, samples, torque, gravity, turn)]
        findings += [Finding(name, text) for text in words]
    return findings


def described_answer(robot: Robot, samples: Samples) -> FloatArray:
    """Rows × n: control signals with which the described loops answer the recorded following errors.

    Eq. 4 at the SYNC period instead of the controller's, which is as good for motions as slow as these. A
    set-point has arrived one period after it was sent.
    """
    controller, period = robot.controller, robot.bus.cycle_time
    to_drive = robot.transmission_matrix.T
    reference = np.vstack([samples.reference[:1], samples.reference[:-1]]) @ to_drive
    position = samples.position @ to_drive
    k_p, k_v, k_i, forward = (
        np.array(gains)
        for gains in (
            controller.position_gain,
            controller.velocity_gain,
            controller.integral_gain,
            controller.velocity_feed_forward,
        )
    )
    error = reference - position
    slip = forward * np.gradient(reference, period, axis=0) - np.gradient(position, period, axis=0)
    if controller.type == "cascade_p_pi":
        speed = k_p * error + slip
        return np.asarray(k_v * (speed + k_i * period * np.cumsum(speed, axis=0)))
    return np.asarray(k_p * error + k_v * slip + k_i * period * np.cumsum(error, axis=0))


def _ratio(measured: FloatArray, described: FloatArray) -> tuple[float, float]:
    """Slope of the measured over the described signal, and the share of the measured one that it explains.

    A trend is left out of both: the integral of a small offset of the position.
    """
    rows = np.linspace(-1.0, 1.0, len(measured))
    trend = np.column_stack([np.ones_like(rows), rows])
    one, other = (y - trend @ np.linalg.lstsq(trend, y, rcond=None)[0] for y in (measured, described))
    power = float(other @ other)
    slope = float(one @ other) / power if power > 0.0 else 0.0
    total = float(one @ one)
    return slope, (1.0 - float(np.sum((one - slope * other) ** 2)) / total if total > 0.0 else 0.0)


def _loop_words(drive: int, ratio: float, share: float) -> str:
    if share < 0.5:
        return (
            f"the control signal of drive[{drive + 1}] does not follow its following error: the order of"
            " node_id, or control_signal (object, per_count)"
        )
    if ratio < 0.0:
        return (
            f"drive[{drive + 1}] pushes against its following error, it counts torque and position in other"
            " senses than described: the sign is likely wrong (control_signal.sign, or sign where the joint"
            " went the other way, too), or the order of node_id"
        )
    return (
        f"drive[{drive + 1}] answers a following error with {ratio:.2g} times the described control signal:"
        " gear, encoder_counts, control_signal.per_count, the order of node_id, or the controller's gains"
    )


def _gravity_words(when: str, joint: Joint, torque: float, gravity: float, room: float) -> str:
    turned = abs(torque + gravity) <= room < abs(torque - gravity)
    where = (
        "the sign is likely wrong (control_signal.sign or sign, gravity, or the zero of the joint)"
        if turned
        else "gain, control_signal.per_count, node_id, sign or zero of a joint, or the URDF's masses"
    )
    return (
        f"{when} it holds {torque:.3g} {joint.torque_unit}, described gravity asks for {gravity:.3g}: {where}"
    )


def _size_words(robot: Robot, samples: Samples, turn: Turn) -> list[str]:
    """Did this joint, and only this one, go as far and the way it was told?"""
    position = samples.position[turn.rows] - samples.position[turn.rows][0]
    wanted = samples.reference[turn.rows] - samples.reference[turn.rows][0]
    own = slice(turn.joint, turn.joint + 1)
    size, lag = max(turn.above, turn.below), _friction_lag(robot)
    words = []
    for end in (int(wanted[:, turn.joint].argmax()), int(wanted[:, turn.joint].argmin())):
        there = _settled(wanted[:, turn.joint], end)
        told, went = float(wanted[end, turn.joint]), float(np.median(position[there, own]))
        room = SIZE_TOLERANCE * size + SETTLED * lag[turn.joint]
        if abs(told) > 0.5 * size and abs(went - told) > room:
            words.append(f"was told to move {told:.3g} {robot.joint[turn.joint].unit} and moved {went:.3g}")
    others = np.ptp(np.delete(position, turn.joint, axis=1), axis=0)
    ways = np.array([HALF_DEGREE[joint.kind] for joint in robot.joint])
    limits = np.delete(STRAY * ways + lag, turn.joint)
    for k in np.flatnonzero(others > limits):
        other = [joint for joint in robot.joint if joint is not robot.joint[turn.joint]][k]
        moved = f"{other.name} moved with it, by {others[k]:.3g} {other.unit}"
        words.append(f"{moved}: transmission, or node_id")
    return words


def _friction_lag(robot: Robot) -> FloatArray:
    """(n,) how far friction holds each joint from its set-point before the described loops overcome it."""
    controller = robot.controller
    stiffness = np.array(controller.position_gain) * robot.gains
    if controller.type == "cascade_p_pi":
        stiffness = stiffness * np.array(controller.velocity_gain)
    lag = np.array([drive.dynamics.coulomb for drive in robot.drive]) / stiffness
    return np.asarray(np.abs(np.linalg.inv(robot.transmission_matrix)) @ lag)


def _settled(wanted: FloatArray, end: int) -> BoolArray:
    """Rows of the second half of the pause at the end of a way."""
    rows = np.flatnonzero(np.abs(wanted - wanted[end]) <= 1e-3 * max(abs(wanted[end]), 1e-12))
    chosen = np.zeros(len(wanted), dtype=np.bool_)
    chosen[rows[len(rows) // 2 :]] = True
    return chosen


def _torque_words(
    robot: Robot, samples: Samples, torque: FloatArray, gravity: FloatArray, turn: Turn
) -> list[str]:
    """Gravity and friction from the torques in both directions; friction is symmetric, gravity is not."""
    k, coupling = turn.joint, robot.transmission_matrix
    ways = {int(drive): ways_of(robot, samples, turn, drive) for drive in turned_by(robot, k)}
    up = np.logical_and.reduce([way.up for way in ways.values()])
    down = np.logical_and.reduce([way.down for way in ways.values()])
    if not (up.any() and down.any()):
        up, down = told_rows(robot, samples, turn)
    forward, backward = (float(np.mean(torque[turn.rows, k][rows])) for rows in (up, down))
    mean = (forward + backward) / 2
    described = np.array([way.described for way in ways.values()])
    room = GRAVITY_TOLERANCE * (abs(gravity[k]) + float(np.abs(coupling[list(ways), k]) @ described))
    room += OFFSET_SHARE * robot.torque_limits[k]
    words = []
    if abs(mean - gravity[k]) > room:
        words.append(_gravity_words("in motion", robot.joint[k], mean, float(gravity[k]), room))
    # Drive by drive: in the sum of a coupled joint the others hide the one that is wrong.
    units = [joint.torque_unit for joint in robot.joint]
    said = [way.words(drive, units[drive]) for drive, way in ways.items()]
    return words + [text for text in said if text is not None]


def summary(findings: Sequence[Finding]) -> str:
    """All findings in one line."""
    return "; ".join(str(finding) for finding in findings)
