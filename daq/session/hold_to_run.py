"""``armhil jog`` without a way: a joint moves while its key is held, and stops when it is let go.

Each time a key is held is a motion of its own, from rest to rest: planned as far as the joint's limit or what
is in the way, at most at a tenth of its speed, recorded, and ended on a ramp once the key is let go. So what
holds for every motion holds for it; see :mod:`daq.session.jog`. (Hold-to-run control: ISO 10218-1.)
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.session.bench import OpenArm, opened
from daq.session.cell import Cell
from daq.session.estimates import estimate, require_room
from daq.session.held_keys import HeldKeys
from daq.session.hold_view import HoldView
from daq.session.jog import HandRequest
from daq.session.motion_words import percent
from daq.session.questions import QUIET
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.session_error import NotMoved, SessionError
from daq.session.states import Conduct
from daq.text.progress import Steps
from drivers import StreamResult
from drivers.session.jog import JOG_SHARE
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory, TrajectoryError, as_far_as_clear

SPEEDS = (0.01, 0.02, 0.05, JOG_SHARE)
"""Shares of a joint's speed that the keys step through."""

DIRECTIONS: Mapping[str, int] = {"right": 1, "+": 1, "=": 1, "left": -1, "-": -1}
"""Keys that move the chosen joint while they are held; = is + without shift."""

LET_GO = "the key was let go"

_LOOK = 0.01
"""Between two looks at whether the key is still held, s."""
_SHORTEST = 1e-3
"""rad or m: nearer than this to where it can go, a joint is there."""


@dataclass(frozen=True)
class HoldResult:
    """What came of it: recordings, and postures (n,) that were kept, rad or m."""

    captures: tuple[Path, ...]
    postures: tuple[FloatArray, ...]


def hold_to_run(request: HandRequest, steps: Steps, keys: HeldKeys, view: HoldView) -> HoldResult:
    """Open the arm, ask once, then follow the keys until q.

    Raises:
        BusError, DriveError, ArmMismatch, LeaseHeld, SessionError: the arm cannot be had.
        CaptureError: a recording cannot be written.
        RunFailed: the arm ended a motion by itself.
        RunInterrupted: Ctrl-C while it moved.
        NotMoved: it was not confirmed.
    """
    with opened(request.arm, request.catalogue, steps, "drive", request.cell) as arm:
        if not request.confirm(_question(request.arm.robot)):
            raise NotMoved("not confirmed, nothing moved")
        with keys, view:
            return _Jogging(request, arm, keys, view).until_left()


def _question(robot: Robot) -> str:
    return (
        f"{robot.name} is going to move while an arrow key is held: one joint at a time, as far as its limits"
        f" and what is in the way allow, at up to {percent(JOG_SHARE)} of its speed. A key that is let go"
        f" stops it within {QUIET:g} s, any other key does, too.\nGo on?"
    )


class _Jogging:
    """One arm under the keys: which joint, how fast, where it stands."""

    def __init__(self, request: HandRequest, arm: OpenArm, keys: HeldKeys, view: HoldView) -> None:
        self._request, self._arm, self._keys, self._view = request, arm, keys, view
        self._robot = request.arm.robot
        self._captures: list[Path] = []
        self._postures: list[FloatArray] = []
        view.speed = request.speed
        view.position = arm.session.actual_position()

    def until_left(self) -> HoldResult:
        while not self._keys.gone:
            held = self._keys.held()
            if held in DIRECTIONS:
                self._move(held)
                self._keys.forget()
            elif (key := self._keys.pressed(_LOOK)) == "q":
                break
            elif key:
                self._choose(key)
        return HoldResult(tuple(self._captures), tuple(self._postures))

    def _choose(self, key: str) -> None:
        if key.isdecimal() and 1 <= int(key) <= self._robot.n:
            self._view.axis = int(key) - 1
        elif key == "up":
            self._view.speed = min((s for s in SPEEDS if s > self._view.speed), default=self._view.speed)
        elif key == "down":
            self._view.speed = max((s for s in SPEEDS if s < self._view.speed), default=self._view.speed)
        elif key == "t":
            self._teach()
        elif key in DIRECTIONS:
            self._view.message = "Hold the key: the joint moves while it is held."

    def _teach(self) -> None:
        """Keep the posture in which the arm stands, in a file that is whole after each."""
        self._postures.append(self._arm.session.actual_position())
        path = self._request.folder / "postures.toml"
        rows = (f"[[posture]]\nposition = [{numbers(posture, ', ')}]\n" for posture in self._postures)
        path.write_text("# rad or m, joint by joint\n" + "".join(rows), encoding="utf-8")
        self._view.message = f"Posture {len(self._postures)} kept in {path}"

    def _move(self, key: str) -> None:
        """Plan, stream and record while the key is held."""
        axis, robot = self._view.axis, self._robot
        start = self._arm.session.actual_position()
        try:
            motion = _way(robot, start, axis, DIRECTIONS[key], self._view.speed, self._request.cell)
            self._arm.admission.admit(robot, motion)
        except (TrajectoryError, SessionError) as refusal:
            self._view.message = str(refusal)
            return
        require_room(self._request.folder, estimate(robot, motion.duration))
        path = self._request.folder / f"jog-{len(self._captures) + 1:03d}.mcap"
        request = self._request
        recording = Recording(
            self._arm, request.arm, request.catalogue, self._view, self._while_held(key), request.note
        )
        title = f"Jog {robot.joint[axis].name}"
        _, result = recording.record("run", title, motion, path, stage="jog")
        self._captures.append(path)
        self._view.position = self._arm.session.actual_position()
        self._view.message = "" if result.reason == LET_GO else result.reason
        if not _as_asked(result):
            require_completed(result, path)

    def _while_held(self, key: str) -> Conducting:
        """Conducts a stream: it is to end once the key is no longer held."""

        @contextmanager
        def conducting() -> Iterator[Conduct]:
            conduct, over = Conduct(), threading.Event()

            def watch() -> None:
                while not over.wait(_LOOK):
                    if self._keys.held() != key:
                        conduct.wish("abort", LET_GO)
                        return

            watcher = threading.Thread(target=watch, name="held key", daemon=True)
            watcher.start()
            try:
                yield conduct
            finally:
                over.set()
                watcher.join()

        return conducting


def _as_asked(result: StreamResult) -> bool:
    """Whether it ended where it was to, or since the key was let go."""
    return result.outcome == "completed" or (result.outcome == "stopped" and result.reason == LET_GO)


def _way(robot: Robot, start: FloatArray, axis: int, direction: int, speed: float, cell: Cell) -> Trajectory:
    """One joint towards its limit, as far as the way is clear.

    Raises:
        SessionError: it is there already.
        TrajectoryError: something is in the way right here.
    """
    goal = np.array(start, dtype=np.float64)
    goal[axis] = robot.upper[axis] if direction > 0 else robot.lower[axis]
    name = robot.joint[axis].name
    if (goal[axis] - start[axis]) * direction < _SHORTEST:
        raise SessionError(f"{name} is at its limit; the other direction is free")
    return as_far_as_clear(robot, start, goal, robot.bus.cycle_time, speed, cell.conditions)


def numbers(posture: FloatArray, between: str) -> str:
    """A posture (n,) as it is typed, to 0.1 mrad or 0.1 mm."""
    return between.join(f"{round(float(position), 4) + 0.0:.4f}" for position in posture)
