"""armhil jog on simulated drives: one joint alone, within its limits, slowly, asked for, recorded."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.recording.reader import read_capture
from daq.session.cell import cell_of
from daq.session.jog import JogRequest, jog, jog_motion
from daq.session.joints import distance_of, joint_index
from daq.session.recorded_runs import unconducted
from daq.session.session_error import NotMoved, SessionError
from daq.session.states import Conduct
from daq.session.streaming import Nobody
from daq.text.progress import Silent
from drivers import ArmSession, Channel, StreamResult
from robots import Robot
from tests.daq.calls import Call
from tests.daq.session.motions import order, refusing
from tests.daq.session.test_cell import BESIDE, POST
from trajectories import Trajectory

TX40 = robots.load("tx40")


@given(
    axis=st.integers(0, 5),
    share=st.floats(-1.0, 1.0).filter(lambda share: abs(share) > 1e-3),
    speed=st.floats(0.02, 0.1),
)
@settings(max_examples=15, deadline=None)
def test_one_joint_alone_within_every_limit_or_not_at_all(axis: int, share: float, speed: float) -> None:
    start = np.array(TX40.home)
    distance = share * float(TX40.upper[axis] - TX40.lower[axis])
    inside = TX40.lower[axis] <= start[axis] + distance <= TX40.upper[axis]
    if not inside:
        with pytest.raises(SessionError, match=r"would end at .*; allowed: "):
            jog_motion(TX40, start, axis, distance, speed)
        return
    motion = jog_motion(TX40, start, axis, distance, speed)
    away = np.abs(motion.position - start)
    assert np.delete(away, axis, axis=1).max() < 1e-9
    assert motion.position[-1, axis] - start[axis] == pytest.approx(distance, abs=1e-9)
    assert (np.abs(motion.velocity) <= speed * TX40.velocity_limits * (1 + 1e-6)).all()
    assert (np.abs(motion.acceleration) <= speed**2 * TX40.acceleration_limits * (1 + 1e-6)).all()


def test_what_stands_in_the_way_refuses_it(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(POST, encoding="utf-8")
    assert jog_motion(TX40, BESIDE, 0, 2.0, 0.1).position[-1, 0] == pytest.approx(1.0)
    with pytest.raises(SessionError, match="joint_1 cannot go there alone: something is in its way"):
        jog_motion(TX40, BESIDE, 0, 2.0, 0.1, cell_of(path))


@pytest.mark.parametrize(
    ("text", "axis", "distance"),
    [("0.05", 0, 0.05), ("-3deg", 0, -np.pi / 60), (" 0.1rad", 0, 0.1), ("1e-2", 0, 0.01)],
)
def test_ways_of_a_turning_joint(text: str, axis: int, distance: float) -> None:
    assert distance_of(TX40, axis, text) == pytest.approx(distance)


@pytest.mark.parametrize(("text", "distance"), [("2mm", 0.002), ("-0.01m", -0.01), ("0.01", 0.01)])
def test_ways_of_a_sliding_joint(emps: Robot, text: str, distance: float) -> None:
    assert distance_of(emps, 0, text) == pytest.approx(distance)


@pytest.mark.parametrize("text", ["", "far", "0", "nan", "inf", "3mm", "deg", "1e999"])
def test_what_is_no_way(text: str) -> None:
    with pytest.raises(SessionError, match=r"--by .*; allowed: a number other than 0 in rad or deg, such as"):
        distance_of(TX40, 0, text)


def test_joints_by_number_and_by_name() -> None:
    assert [joint_index(TX40, text) for text in ("1", "6", "joint_4")] == [0, 5, 3]
    for text in ("0", "7", "-1", "elbow", "1.0", "²"):
        with pytest.raises(SessionError, match=r"--joint .*; allowed: 1 to 6, joint_1, "):
            joint_index(TX40, text)


@pytest.mark.parametrize("speed", [0.0, -0.1, 0.11, 1.0, float("nan")])
def test_a_jog_is_slow(emps: Robot, channel: Channel, tmp_path: Path, speed: float) -> None:
    with pytest.raises(SessionError, match=r"--speed \S+; allowed: above 0, up to 0.1"):
        JogRequest(order(emps, channel), tmp_path, speed, joint="1", by="0.01")


@pytest.mark.slow
def test_asked_for_refused_driven_and_stopped(
    emps: Robot, bench: Channel, tmp_path: Path, passed: None
) -> None:
    asked: list[str] = []

    with Catalogue() as catalogue:
        request = JogRequest(
            order(emps, bench),
            tmp_path,
            0.1,
            joint="1",
            by="-8mm",
            catalogue=catalogue,
            confirm=refusing(asked),
            note="a look",
        )
        with pytest.raises(NotMoved, match="not confirmed, nothing moved"):
            jog(request, Silent(), Nobody(), unconducted)
        assert asked[0].startswith("emps is going to move for ") and not list(tmp_path.glob("*.mcap"))
        far = replace(request, by="40", confirm=lambda question: True)
        with pytest.raises(SessionError, match=r"would end at \S+ m; allowed: "):
            jog(far, Silent(), Nobody(), unconducted)
        assert runs.every(catalogue, kind="run") == ()

        result = jog(replace(request, confirm=lambda question: True), Silent(), Nobody(), unconducted)
        assert result.stream.outcome == "completed" and result.end - result.start == pytest.approx(-0.008)
        way = read_capture(result.capture).samples
        assert way.position[-1, 0] - way.position[0, 0] == pytest.approx(-0.008, abs=1e-3)
        speed = np.abs(np.diff(way.reference, axis=0)).max() / emps.bus.cycle_time
        assert speed <= 0.1 * emps.velocity_limits[0] + 1e-6
        (run,) = runs.every(catalogue, kind="run")
        assert (run.id, run.kind, run.stage, run.note) == (result.run, "run", "jog", "a look")

        class Stopper(Nobody):
            def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
                conduct.begin()
                conduct.wish("abort", "too near")

        again = replace(request, by="8mm", folder=tmp_path / "again", confirm=lambda question: True)
        again.folder.mkdir()
        stopped = jog(again, Silent(), Stopper(), unconducted)
        assert (stopped.stream.outcome, stopped.stream.reason) == ("stopped", "too near")


def test_the_command(
    emps: Robot,
    bench: Channel,
    tmp_path: Path,
    armhil: Call,
    passed: None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arrives: list[object] = []
    stream = ArmSession.stream

    def note(self: ArmSession, *arguments: Any, **options: Any) -> StreamResult:
        arrives.append(options.get("arrive"))
        return stream(self, *arguments, **options)

    monkeypatch.setattr(ArmSession, "stream", note)

    def call(*options: object) -> tuple[int, str, str]:
        arguments = ["jog", "emps", "--joint", "1", "--channel", bench.name, "--speed", "0.1", *options]
        return armhil(*arguments)

    code, _, err = call("--by", "-5mm", "--out", tmp_path / "a")
    told = "asks before the arm moves; give --yes where nobody can answer"
    assert (code, err.splitlines()[-1]) == (2, f"armhil: {told}")
    code, out, err = call("--by", "-5mm", "--out", tmp_path / "b", "--yes", "--json")
    assert code == 0, err
    answer: dict[str, Any] = json.loads(out)
    assert answer["joint"] == emps.joint[0].name and answer["outcome"] == "completed"
    assert answer["to"] - answer["from"] == pytest.approx(-0.005)
    assert (tmp_path / "b" / "capture.mcap").stat().st_size > 0
    assert arrives == [True], "a jog ends where it was sent, or says why not"
