"""With the arm in the loop: nothing moves without leave; what is ambiguous is moved for and asked again."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from daq.diagnosis import live
from daq.diagnosis.diagnose_result import DiagnoseRequest
from daq.diagnosis.live import LiveRequest, MotionRefused, run_live
from daq.recording.reader import read_capture
from daq.session.session_error import NotMoved
from daq.text.progress import Silent
from drivers.simulated import draw_truth
from drivers.simulated.scenario import Scenario
from robots import Robot
from tests.daq.diagnosis.offline_bench import OfflineBench
from trajectories import Trajectory, plan


@pytest.fixture(scope="module")
def arm() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def motion(arm: Robot) -> Trajectory:
    return plan(arm, cycle_time=arm.bus.cycle_time, duration=3.0, seed=4, evaluations=100, periods=1)


@dataclass
class Searches:
    """Stands for the search: ambiguous so many times, then named; remembers what it was asked."""

    motion: Trajectory
    ambiguous: int
    asked: list[DiagnoseRequest] = field(default_factory=list)

    def __call__(self, request: DiagnoseRequest, steps: Any) -> Any:
        self.asked.append(request)
        apart = SimpleNamespace(
            parts=("to fit", "to validate"),
            trajectories=(self.motion, self.motion),
            candidates=("payload (the arm)", "base tilt (the arm)"),
        )
        still = len(self.asked) <= self.ambiguous
        verdict = SimpleNamespace(verdict="ambiguous" if still else "named")
        return SimpleNamespace(apart=(apart,) if still else (), diagnosis=verdict, content={})


def request(arm: Robot, folder: Path, *, rounds: int = 2) -> LiveRequest:
    start = DiagnoseRequest((folder / "a.mcap",), (folder / "b.mcap",), robot="tx40")
    return LiveRequest(start, arm, folder, rounds=rounds)


def test_a_no_leaves_the_arm_at_rest_and_the_finding_ambiguous(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "run_diagnose", Searches(motion, ambiguous=9))
    bench, questions = OfflineBench(arm, draw_truth(arm, 1)), []

    def no(trajectory: Trajectory, path: Path, purpose: str) -> Path:
        questions.append(purpose)
        raise NotMoved("not confirmed")

    found = run_live(request(arm, tmp_path), no, Silent())
    assert bench.runs == 0
    assert found.refused == "to tell payload (the arm) from base tilt (the arm)"
    assert found.last.diagnosis.verdict == "ambiguous"
    assert questions == [found.refused]


def test_a_yes_records_the_motion_and_asks_the_search_again_with_it(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = Searches(motion, ambiguous=1)
    monkeypatch.setattr(live, "run_diagnose", searches)
    hidden = Scenario.from_dict({"format": 1, "payload": {"mass": 0.5, "centre": [0.0, 0.0, 0.05]}})
    bench = OfflineBench(arm, draw_truth(arm, 1), hidden)
    found = run_live(request(arm, tmp_path), bench.stream, Silent())
    assert (found.last.diagnosis.verdict, found.refused, bench.runs) == ("named", "", 2)
    fitted, judging = tmp_path / "tell-apart-1.mcap", tmp_path / "tell-apart-1-validate.mcap"
    assert found.recorded == (fitted, judging)
    assert [(asked.fit, asked.validation) for asked in searches.asked] == [
        ((tmp_path / "a.mcap",), (tmp_path / "b.mcap",)),
        ((tmp_path / "a.mcap", tmp_path / "b.mcap", fitted), (judging,)),
    ]
    assert len({asked.out for asked in searches.asked}) == 2
    assert found.request.fit == searches.asked[-1].fit
    recorded = read_capture(found.recorded[0]).samples
    half_count = np.abs(1.0 / arm.counts_per_output_unit).max()
    assert np.abs(recorded.reference - motion.position).max() < 2 * half_count


def test_the_rounds_end_it(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "run_diagnose", Searches(motion, ambiguous=9))
    bench = OfflineBench(arm, draw_truth(arm, 1))
    found = run_live(request(arm, tmp_path, rounds=1), bench.stream, Silent())
    assert bench.runs == 2
    assert (len(found.results), found.last.diagnosis.verdict, found.refused) == (2, "ambiguous", "")


def test_nothing_is_asked_again_where_the_part_that_judges_is_refused(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = Searches(motion, ambiguous=1)
    monkeypatch.setattr(live, "run_diagnose", searches)
    bench, questions = OfflineBench(arm, draw_truth(arm, 1)), []

    def once(trajectory: Trajectory, path: Path, purpose: str) -> Path:
        questions.append(purpose)
        if len(questions) == 2:
            raise NotMoved("not confirmed")
        return bench.stream(trajectory, path, purpose)

    found = run_live(request(arm, tmp_path), once, Silent())
    assert (bench.runs, len(searches.asked)) == (1, 1)
    assert found.refused == questions[0] and questions[1].endswith(questions[0])
    assert found.recorded == (tmp_path / "tell-apart-1.mcap",) and found.request.fit == (tmp_path / "a.mcap",)


def test_recordings_that_are_halved_judge_by_their_halves(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = Searches(motion, ambiguous=1)
    monkeypatch.setattr(live, "run_diagnose", searches)
    halved = DiagnoseRequest((tmp_path / "a.mcap",), robot="tx40", split_half=True)
    bench = OfflineBench(arm, draw_truth(arm, 1))
    run_live(replace(request(arm, tmp_path), diagnose=halved), bench.stream, Silent())
    assert len(searches.asked[-1].fit) == 3 and not searches.asked[-1].validation


def refused(trajectory: Trajectory, path: Path, purpose: str) -> Path:
    raise NotMoved(f"{purpose}: no")


def test_without_captures_two_are_recorded_or_nothing_happens(
    arm: Robot, motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = Searches(motion, ambiguous=0)
    monkeypatch.setattr(live, "run_diagnose", searches)
    nothing = replace(request(arm, tmp_path), duration=3.0, periods=1, evaluations=100)
    nothing = replace(nothing, diagnose=DiagnoseRequest((), robot="tx40"))
    bench = OfflineBench(arm, draw_truth(arm, 1))
    with pytest.raises(
        MotionRefused, match=r"nothing to diagnose: to record fit\.mcap: no; allowed: --yes, the answer yes"
    ):
        run_live(nothing, refused, Silent())
    assert (bench.runs, searches.asked) == (0, [])
    run_live(nothing, bench.stream, Silent())
    assert bench.runs == 2
    assert searches.asked[0].fit == (tmp_path / "fit.mcap",)
    assert searches.asked[0].validation == (tmp_path / "validation.mcap",)
