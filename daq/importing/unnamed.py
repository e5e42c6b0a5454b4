"""Columns whose names say nothing, or that have none: told apart by what they do.

Time rises evenly. A velocity is the derivative of a position, which stays within the limits of the URDF. A
torque is foretold by the motion, and friction brakes in it. Of two that are the same, the rougher one was
measured. Where two readings fit as well as each other none is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_position import counts_of_joints, in_si, joints_of
from daq.importing.guess_torque import LogHints
from daq.importing.guess_which import Sampled
from daq.importing.log_arm import write_description
from daq.importing.proof import TorqueProof
from daq.importing.unnamed_columns import Block, UnnamedColumns
from daq.recording.errors import CaptureError
from robots import Robot
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf

_FORETOLD = 0.5
"""Share of its variance from which on a torque is one."""
_NEAR = 0.1
"""Share by which a reading may be worse than the best and still be as good."""
_ROUGHER = 1.5
"""Times: a measurement beside what it was to be."""
_QUANTITIES = 3
"""Quantities that a log without velocities may have: of more there are too many readings to try."""
_REMEDY = "write a header line (t,q1,…,tau1,…) into it, or a column map"


@dataclass(frozen=True)
class _Reading:
    """What columns may be.

    Attributes:
        position, torque, velocity: the columns; no velocity where the log has none.
        share: of the torque's variance that the motion foretells, the joints' median.
        brakes: whether friction is in the torque, and brakes.
    """

    position: Block
    velocity: Block | None
    torque: Block
    share: float
    brakes: bool


def told_apart(
    path: Path, columns: dict[str, FloatArray], arm: LooseUrdf, hints: LogHints
) -> tuple[list[Channels], list[str]]:
    """The channels of a log whose names say nothing, and sentences on why they are taken for it.

    Raises:
        CaptureError: nothing fits, or two readings fit as well as each other.
    """
    log = UnnamedColumns(path, columns, hints.sample_rate)
    with TemporaryDirectory(prefix="armhil-") as folder:
        for n in counts_of_joints(arm):
            if len(log.names) >= 2 * n and (readings := _readings(log, n, arm, hints, Path(folder))):
                return _chosen(log, readings)
    raise CaptureError(
        f"{path}: the names of its columns say nothing, and no {len(arm.moving)} of them are a position whose"
        f" motion foretells a torque; {_REMEDY}"
    )


def _readings(log: UnnamedColumns, n: int, arm: LooseUrdf, hints: LogHints, folder: Path) -> list[_Reading]:
    """All that the columns may be for an arm of n joints, best first; the folder takes descriptions."""
    blocks = list(log.blocks(n))
    pairs = [(p, v) for p in blocks for v in blocks if not p.overlaps([v]) and log.is_derivative(p, v)]
    rates = [rate for _, rate in pairs]
    tried: list[tuple[Block, Block | None]] = [pair for pair in pairs if pair[0] not in rates]
    heads = [position for position, _ in tried]
    if not tried and len(log.names) <= _QUANTITIES * n:
        tried = [(block, None) for block in log.side_by_side(blocks, n)]
    found = []
    for position, velocity in tried:
        motion = _motion(log, position, arm, hints, folder)
        torques = [b for b in blocks if not b.overlaps([position, *rates, *heads])]
        for torque in torques if motion is not None else []:
            assert motion is not None
            share, brakes = _foretold(log, *motion, torque)
            if share > _FORETOLD:
                found.append(_Reading(position, velocity, torque, share, brakes))
    return sorted(found, key=lambda reading: (-reading.brakes, -reading.share))


def _motion(
    log: UnnamedColumns, position: Block, arm: LooseUrdf, hints: LogHints, folder: Path
) -> tuple[Robot, Sampled] | None:
    """The arm and its motion where the columns are its position; None where they cannot be."""
    channel = log.channel(position, "position", "measured")
    try:
        names = joints_of(channel, arm)
        values, _, _ = in_si(log.path, channel, arm, names, hints, [])
    except CaptureError:
        return None
    motion = Sampled.of(log.path.name, log.stamps, values, list(range(len(names))))
    speed = np.abs(motion.velocity).max(axis=0)
    seen = (values.min(axis=0), values.max(axis=0), speed, np.full(len(names), 1e3))
    held = {joint.name: 0.0 for joint in arm.moving if joint.name not in names}
    settings: dict[str, object] = {"cutoff_hz": motion.cutoff, "decimation": 1}
    return write_description(Path(mkdtemp(dir=folder)), arm, names, held, seen, settings), motion


def _foretold(log: UnnamedColumns, robot: Robot, motion: Sampled, torque: Block) -> tuple[float, bool]:
    """Share of the torque's variance that the motion foretells (the joints' median), whether it brakes."""
    places = list(torque.places)
    live = log.moves[places]
    if not live.any():
        return 0.0, False
    columns = motion.even(log.values[:, places])
    proof = TorqueProof.of(robot, motion.position, columns, motion.period, motion.cutoff)
    share = float(np.median(np.diag(proof.explained(np.zeros(robot.n)))[live]))
    return share, share > _FORETOLD and proof.brakes(np.zeros(robot.n))


def _chosen(log: UnnamedColumns, readings: list[_Reading]) -> tuple[list[Channels], list[str]]:
    readings = _of_the_motion(log, readings)
    best = readings[0]
    rivals = [r for r in readings if r.brakes == best.brakes and r.share > best.share - _NEAR]
    position = _measured(log, [r.position for r in rivals], "position")
    torque = _measured(log, [r.torque for r in rivals if r.position == position], "torque")
    taken = next(r for r in rivals if (r.position, r.torque) == (position, torque))
    found = [log.channel(position, "position", "measured"), log.channel(torque, "torque")]
    found += [] if log.time is None else [log.time]
    words = ["the columns' names say nothing; told apart on the data:"]
    if taken.velocity is not None:
        found.append(log.channel(taken.velocity, "velocity"))
        words.append(f"- position: {found[0].label}, of which {found[-1].label} is the derivative")
    else:
        words.append(f"- position: {found[0].label}, whose motion foretells the torque")
    for block in dict.fromkeys(r.position for r in readings):
        if block != position and log.same(block, position):
            found.append(log.channel(block, "position", "reference"))
            words.append(f"- reference: {found[-1].label}, the same without noise")
    brakes = ", and friction brakes" if taken.brakes else ""
    share = f"the motion foretells {100 * taken.share:.0f} % of it{brakes}"
    words.append(f"- torque: {found[1].label}; {share}")
    others = [r for r in readings if r.position == position and r.torque != torque]
    for other in (r for r in others if r.share > best.share - _NEAR):
        why = "smoother" if other.brakes == taken.brakes else "without friction"
        words.append(f"- computed, not measured: {log.channel(other.torque, '').label}, {why}")
    return found, words


def _of_the_motion(log: UnnamedColumns, readings: list[_Reading]) -> list[_Reading]:
    """Without those whose motion is another one than that which foretells most, and foretells clearly less.

    Positions beside torques in one block foretell something too, and something in it brakes.
    """
    most = max(readings, key=lambda reading: reading.share)
    return [
        r
        for r in readings
        if r.share > most.share - _NEAR or r.position == most.position or log.same(r.position, most.position)
    ]


def _measured(log: UnnamedColumns, blocks: Sequence[Block], what: str) -> Block:
    """The one that was measured of several that fit.

    Raises:
        CaptureError: nothing tells.
    """
    first, *others = sorted(dict.fromkeys(blocks), key=lambda b: -float(np.median(log.rough[list(b.places)])))
    for other in others:
        if not log.same(first, other) or log.rougher(first, other) < _ROUGHER:
            labels = " and ".join(log.channel(b, "").label for b in (first, other))
            raise CaptureError(
                f"{log.path}: the names of its columns say nothing, and {labels} fit equally as the {what};"
                f" {_REMEDY}"
            )
    return first
