"""armhil jog without a way, on simulated drives: a joint moves while its key is held, and not longer."""

from __future__ import annotations

import io
import tomllib
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from rich.console import Console

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.recording.reader import read_capture
from daq.session.cell import cell_of
from daq.session.held_keys import HeldKeys
from daq.session.hold_to_run import _way, hold_to_run
from daq.session.hold_view import HoldView
from daq.session.jog import HandRequest
from daq.session.questions import QUIET
from daq.session.session_error import NotMoved, SessionError
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from tests.daq.calls import Call
from tests.daq.session.motions import order, refusing
from tests.daq.session.test_cell import BESIDE, POST
from trajectories import TrajectoryError

TX40 = robots.load("tx40")


class Fingers:
    """Somebody at the keys: holds, one after the other, until the joint has gone a way; then presses."""

    def __init__(self, view: HoldView, *presses: str, hold: str = "", way: float = 0.0) -> None:
        self._view, self._presses, self._hold, self._way = view, list(presses), hold, way
        self._start: float | None = None
        self.gone = False

    def __enter__(self) -> Fingers:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def held(self) -> str:
        here = float(self._view.position[0])
        self._start = here if self._start is None else self._start
        if abs(here - self._start) >= self._way:
            self._hold = ""
        return self._hold

    def pressed(self, seconds: float) -> str:
        return self._presses.pop(0) if self._presses else "q"

    def forget(self) -> None:
        pass


def view_of(robot: Robot) -> HoldView:
    return HoldView(Console(file=io.StringIO(), width=80, force_terminal=True), robot)


@pytest.mark.slow
def test_it_moves_while_the_key_is_held(emps: Robot, bench: Channel, tmp_path: Path, passed: None) -> None:
    asked: list[str] = []
    view = view_of(emps)
    with Catalogue() as catalogue:
        request = HandRequest(order(emps, bench), tmp_path, 0.1, catalogue=catalogue, confirm=refusing(asked))
        keys = cast(HeldKeys, Fingers(view, "t", hold="-", way=0.004))
        with pytest.raises(NotMoved, match="not confirmed, nothing moved"):
            hold_to_run(request, Silent(), keys, view)
        assert "while an arrow key is held" in asked[0] and not list(tmp_path.iterdir())

        request = HandRequest(order(emps, bench), tmp_path, 0.1, catalogue=catalogue)
        result = hold_to_run(request, Silent(), keys, view)
        (run,) = runs.every(catalogue, kind="run")
    (capture,) = result.captures
    assert (run.stage, run.outcome, run.reason) == ("jog", "stopped", "the key was let go")
    way = read_capture(capture).samples
    gone = float(way.position[0, 0] - way.position[-1, 0])
    # Samples come every 0.05 s, the key is looked at every 0.01 s; then a ramp, which is short.
    assert 0.004 <= gone <= 0.004 + QUIET * 0.1 * emps.velocity_limits[0]
    assert np.abs(np.diff(way.reference[-2:, 0])).max() == 0.0, "it ends at rest"
    (posture,) = tomllib.loads((tmp_path / "postures.toml").read_text())["posture"]
    assert posture["position"] == pytest.approx(result.postures[0], abs=1e-4)
    assert result.postures[0] == pytest.approx(way.position[-1], abs=1e-3), "taught where it came to rest"


@pytest.mark.slow
def test_keys_choose_joint_and_speed_and_nothing_moves(
    emps: Robot, bench: Channel, tmp_path: Path, passed: None
) -> None:
    view = view_of(emps)
    keys = cast(HeldKeys, Fingers(view, "7", "1", "+", "up", "down", "down", "down", "down", "down"))
    with Catalogue() as catalogue:
        request = HandRequest(order(emps, bench), tmp_path, 0.05, catalogue=catalogue)
        result = hold_to_run(request, Silent(), keys, view)
    assert (result.captures, result.postures) == ((), ())
    assert (view.axis, view.speed, view.message) == (
        0,
        0.01,
        "Hold the key: the joint moves while it is held.",
    )


@pytest.mark.parametrize("direction", [1, -1])
def test_a_way_ends_at_the_limit(direction: int) -> None:
    start = np.array(TX40.home)
    start[2] = 0.6
    motion = _way(TX40, start, 2, direction, 0.1, cell_of(None))
    assert motion.position[-1, 2] == pytest.approx(
        TX40.upper[2] if direction > 0 else TX40.lower[2], abs=1e-6
    )
    start[2] = motion.position[-1, 2]
    with pytest.raises(SessionError, match="joint_3 is at its limit; the other direction is free"):
        _way(TX40, start, 2, direction, 0.1, cell_of(None))


def test_a_way_ends_before_what_stands_there(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(POST, encoding="utf-8")
    cell = cell_of(path)
    motion = _way(TX40, BESIDE, 0, 1, 0.1, cell)
    end = float(motion.position[-1, 0])
    assert BESIDE[0] < end < 0.0, "short of the post"
    assert not cell.conditions.judge(TX40, start=BESIDE).judge(motion.motion).problems
    near = BESIDE.copy()
    near[0] = end
    with pytest.raises(TrajectoryError, match=r"the motion puts link_6 .* into post"):
        _way(TX40, near, 0, 1, 0.1, cell)


def test_nobody_at_a_terminal_holds_no_key(armhil: Call, tmp_path: Path) -> None:
    code, _, err = armhil("jog", "tx40", "--simulated", "--out", tmp_path / "out")
    told = "keys are held at a terminal; elsewhere give --joint and --by"
    assert (code, err.splitlines()[-1]) == (2, f"armhil: {told}")
    code, _, err = armhil("jog", "tx40", "--simulated", "--joint", 3)
    assert code == 2 and "--joint and --by go together" in err.splitlines()[-1]


def test_the_picture_fits_eighty_columns() -> None:
    console = Console(file=io.StringIO(), width=80, record=True)
    view = HoldView(console, TX40)
    view.position, view.speed, view.message = np.array(TX40.home) - 1e-6, 0.05, "Posture 1 kept"
    console.print(view.picture())
    text = console.export_text()
    assert max(map(len, text.splitlines())) <= 80 and "q leave" in text
    assert "0.0000 rad (0.00°)" in text and "-0.00" not in text
    assert "▶  joint_1" in text and "5 % of the joint's speed" in text and "Posture 1 kept" in text
