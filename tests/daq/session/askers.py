"""Every question before a motion, and those whose yes a motion rests on, up to what follows the answer."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.cli.acknowledge import acknowledge
from daq.cli.common import asking, looking
from daq.diagnosis.bench import LiveArm
from daq.session import acknowledgement, first_stage, home, jog, run
from daq.session.cell import Cell
from daq.session.commission import Walk
from daq.session.dry_run import CommissionRequest, plan_commission
from daq.session.recorded_runs import unconducted
from daq.session.session_error import NotMoved, SessionError
from daq.session.streaming import Nobody
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from tests.daq.session.motions import order, there_and_back, written
from tests.daq.session.test_home import forgetful

DICE = random.Random(17)


def take_your_time() -> None:
    """As the set-up of drives does."""
    time.sleep(DICE.uniform(0.0, 0.02))


def standing(emps: Robot, moved: list[str]) -> Any:
    def search(*_: object) -> None:
        moved.append("home")
        raise NotMoved("this test looks no further")

    return SimpleNamespace(
        actual_position=lambda: np.array(emps.home),
        robot=emps,
        drives=(),
        home=search,
        channel=Channel("virtual", "asked"),
    )


ASK = asking(yes=False, simulated=False, as_json=False)


def jog_asks(emps: Robot, folder: Path, arm: Any) -> Callable[[], object]:
    request = jog.JogRequest(
        order(emps, Channel("virtual", "asked")), folder, joint="1", by="5mm", confirm=ASK
    )
    return lambda: jog.jog(request, Silent(), Nobody(), unconducted)


def run_asks(emps: Robot, folder: Path, arm: Any) -> Callable[[], object]:
    path = written(folder, emps, there_and_back(emps, distance=0.01, speed=1.0))
    request = run.RunRequest(order(emps, Channel("virtual", "asked")), path, folder, confirm=ASK)
    return lambda: run.run_trajectory(request, Silent(), Nobody(), unconducted)


def home_asks(emps: Robot, folder: Path, arm: Any) -> Callable[[], object]:
    robot = forgetful(folder / "arm", method=37, position=emps.home[0], travel=0.001)
    request = home.HomeRequest(order(robot, Channel("virtual", "asked")), folder, confirm=ASK)
    return lambda: home.home(request, Silent(), unconducted)


def commission_asks(emps: Robot, folder: Path, arm: Any) -> Callable[[], object]:
    path = written(folder, emps, there_and_back(emps, distance=0.01, speed=1.0))
    request = CommissionRequest(order(emps, Channel("virtual", "asked")), folder, path, confirm=ASK)
    planned = plan_commission(request, Silent())
    walk = Walk(request, planned, arm, Silent(), Nobody(), unconducted)
    motion = walk.motion("warm-up")
    assert motion is not None

    def ask() -> object:
        take_your_time()
        return walk._drive("warm-up", motion)

    return ask


def live_asks(emps: Robot, folder: Path, arm: Any) -> Callable[[], object]:
    motion = there_and_back(emps, distance=0.01, speed=1.0)
    asked_order = order(emps, Channel("virtual", "asked"))
    live = LiveArm(arm, asked_order, None, Cell(), ASK, Nobody(), unconducted)

    def ask() -> object:
        take_your_time()
        return live.drive(motion, folder / "fit.mcap", "to record fit.mcap")

    return ask


def went_asks(emps: Robot, patch: pytest.MonkeyPatch, moved: list[str]) -> Callable[[], object]:
    """After the half degree of the first move: did the joint go the way that it should?"""
    for name in ("judge_loop", "judge_move"):
        patch.setattr(first_stage, name, lambda *_: [])
    patch.setattr(first_stage, "judge_rest", lambda *_: ([], []))
    patch.setattr(first_stage, "read_capture", lambda _: SimpleNamespace(samples=None))
    patch.setattr(first_stage, "require_completed", lambda *_: None)
    recording: Any = SimpleNamespace(record=lambda *_, **__: (None, None))
    arm: Any = SimpleNamespace(session=standing(emps, moved))

    def ask() -> None:
        take_your_time()
        try:
            first_stage.first_move(arm, recording, lambda name: Path(name), {}, ASK)
        except SessionError as refused:
            raise NotMoved(str(refused)) from None
        moved.append("passed")

    return ask


def stands_asks(emps: Robot, patch: pytest.MonkeyPatch, moved: list[str]) -> Callable[[], object]:
    """Does the arm stand where its drives say?"""
    look = looking(as_json=False)

    def ask() -> None:
        take_your_time()
        if look(emps, np.array(emps.home)):
            moved.append("attested")

    return ask


def acknowledge_asks(emps: Robot, patch: pytest.MonkeyPatch, moved: list[str]) -> Callable[[], object]:
    """Has somebody looked at the arm, and is the cause gone?"""

    def reset(robot: Robot, channel: Channel, looked: Callable[[tuple[str, ...]], bool]) -> bool:
        take_your_time()
        if not looked(("the stream was cut off",)):
            raise NotMoved("nobody has looked")
        moved.append("acknowledged")
        return True

    patch.setattr(acknowledgement, "acknowledge", reset)
    return lambda: acknowledge("emps", None, None, yes=False)
