"""armhil home: drives that forgot search, somebody looks, and what was said is kept and asked for again."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm
from daq.session.attestation import attested_words, keep_attestation, last_attestation
from daq.session.home import HomeRequest, home, searches_of
from daq.session.recorded_runs import unconducted
from daq.session.session_error import NotMoved, RunFailed, RunInterrupted, SessionError
from daq.session.states import Conduct
from daq.text.progress import Silent
from drivers import Channel, DriveError
from drivers.simulated import SimulatedArm
from robots import Robot
from robots.arrays import FloatArray
from tests.daq.calls import Call
from tests.daq.catalogue.entries import identity
from tests.daq.session.motions import order


def forgetful(folder: Path, **search: object) -> Robot:
    """The one-axis arm with a drive that loses its position with the supply, and searches its home so."""
    shutil.copytree(robots.load("emps").folder, folder)
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    entries = ", ".join(f"{key} = {value}" for key, value in search.items())
    keys = f'[[drive]]\nposition_reference = "homing"\nhoming = {{ {entries} }}\n'
    (folder / "robot.toml").write_text(text.replace("[[drive]]\n", keys), encoding="utf-8")
    return robots.load(folder / "robot.toml")


@pytest.fixture
def forgot(tmp_path: Path, new_channel: Callable[[], Channel]) -> Iterator[tuple[Robot, Channel]]:
    """Its drive on a bus, just switched on: it finds home where it stands (method 37)."""
    robot = forgetful(tmp_path / "arm", method=37, position=robots.load("emps").home[0], travel=0.001)
    channel = new_channel()
    with SimulatedArm(str(robot.folder), channel, 2):
        yield robot, channel


@pytest.mark.slow
def test_it_searches_is_looked_at_and_what_was_said_is_kept(
    forgot: tuple[Robot, Channel], tmp_path: Path
) -> None:
    robot, channel = forgot
    asked: list[str] = []
    seen: list[FloatArray] = []

    def yes(question: str) -> bool:
        asked.append(question)
        return True

    with Catalogue() as catalogue:
        request = HomeRequest(
            order(robot, channel, str(robot.folder), not_commissioned=True),
            tmp_path,
            catalogue=catalogue,
            confirm=yes,
            look=yes,
            show=seen.append,
            note="first time",
        )
        result = home(request, Silent(), unconducted)
        (joint,) = robot.joint
        assert [(name, found.outcome) for name, found in result.searches] == [(joint.name, "completed")]
        np.testing.assert_allclose(result.posture, robot.home, atol=1e-3)
        assert asked[0].startswith(
            f"The drive of {joint.name} is going to search its home by itself: method 37"
        )
        assert asked[1:] == ["Look at the arm and its marks.\nDoes it stand so?"]
        np.testing.assert_array_equal(seen[0], result.posture)
        (run,) = runs.every(catalogue)
        assert (run.id, run.kind, run.stage, run.note) == (result.run, "commission", "home", "first time")
        assert json.loads(run.facts["posture"]) == pytest.approx(robot.home, abs=1e-3)

        # Who looks and says no has attested nothing; neither has a posture that is another.
        with pytest.raises(NotMoved, match="not attested"):
            home(replace(request, joints=(), look=lambda question: False), Silent(), unconducted)
        elsewhere = replace(request.arm, stands_at=(robot.home[0] + 0.05,))
        with pytest.raises(DriveError, match=f"joint {joint.name} stands at .* but its drive says"):
            home(replace(request, joints=(), arm=elsewhere), Silent(), unconducted)
        assert len(runs.every(catalogue)) == 1

        # No eyes are needed where somebody has written down what they saw.
        there = replace(request.arm, stands_at=tuple(robot.home))
        again = home(replace(request, joints=(), arm=there, look=_never), Silent(), unconducted)
        assert again.searches == () and again.run == 2


def _never(question: str) -> bool:
    raise AssertionError(f"asked: {question}")


@pytest.mark.slow
def test_a_search_that_finds_nothing_or_is_stopped_attests_nothing(
    tmp_path: Path, new_channel: Callable[[], Channel]
) -> None:
    robot = forgetful(tmp_path / "arm", method=17, position=0.0, travel=0.001)
    channel = new_channel()

    @contextmanager
    def halted() -> Iterator[Conduct]:
        conduct = Conduct()
        conduct.control.halt("key h: halt")
        yield conduct

    with Catalogue() as catalogue, SimulatedArm(str(robot.folder), channel, 2):
        request = HomeRequest(
            order(robot, channel, str(robot.folder), not_commissioned=True),
            tmp_path,
            catalogue=catalogue,
            look=_never,
        )
        with pytest.raises(
            RunInterrupted, match=r"^stopped \(key h: halt\): the arm is at rest and its torque is off"
        ):
            home(request, Silent(), halted)
        with pytest.raises(NotMoved, match="was not confirmed; nothing is attested"):
            home(replace(request, confirm=lambda question: False), Silent(), unconducted)
        with pytest.raises(RunFailed, match=r"ended: .* reports a homing error .*; nothing is attested"):
            home(request, Silent(), unconducted)
        assert runs.every(catalogue) == ()
    assert len(list(tmp_path.glob("fault-*.mcap"))) == 1, "of the search that failed"


def test_which_drives_search(emps: Robot, tmp_path: Path) -> None:
    assert searches_of(emps, None) == () and searches_of(emps, ()) == ()
    with pytest.raises(DriveError, match=r"has no search for home; give it \[drive.homing\] in robot.toml"):
        searches_of(emps, ("1",))
    with pytest.raises(SessionError, match="--joint 2; allowed: 1 to 1"):
        searches_of(emps, ("2",))
    robot = forgetful(tmp_path / "arm", method=34, position=0.1, travel=0.02, speed=0.01, seconds=5.0)
    (found,) = searches_of(robot, None)
    assert (found.method, found.position, found.travel, found.share, found.seconds) == (
        34,
        0.1,
        0.02,
        0.01,
        5,
    )
    assert searches_of(robot, ("1",)) == (found,)


@pytest.mark.parametrize(
    ("search", "told"),
    [
        ({"method": 0}, "method: 0 is no method; allowed: 1 to 37, or a maker's own"),
        ({"method": 38}, "method"),
        ({"travel": 0.0}, "travel"),
        ({"speed": 0.06}, "speed"),
    ],
)
def test_a_search_that_cannot_be_described(tmp_path: Path, search: dict[str, object], told: str) -> None:
    described = {"method": 34, "position": 0.0, "travel": 0.1, **search}
    with pytest.raises(robots.RobotFileError, match=rf"robot\.toml:\d+: drive\[1\]\.homing\.{told}"):
        forgetful(tmp_path / "arm", **described)


def test_an_attestation_counts_for_these_drives_and_this_description(emps: Robot, channel: Channel) -> None:
    arm = order(emps, channel)
    known = replace(identity(), name="emps")
    with Catalogue() as catalogue:
        with pytest.raises(
            SessionError, match=r"nobody has compared .*: `armhil home emps`, or give --stands-at"
        ):
            attested_words(catalogue, known, arm)
        number = keep_attestation(catalogue, known, np.array(emps.home), arm, "")
        found = last_attestation(catalogue, known)
        assert found is not None and found.id == number
        assert attested_words(catalogue, known, arm).endswith(f"in run {number}")
        for other in (replace(known, description_sha256="0" * 64), replace(known, serials=(7,))):
            assert last_attestation(catalogue, other) is None
    assert "--stands-at" in attested_words(None, known, replace(arm, stands_at=(0.0,)))
    assert "simulated" in attested_words(None, known, replace(arm, simulated=True))
    with pytest.raises(SessionError, match="nobody has compared"):
        attested_words(None, identity_of_arm(emps), arm)


def test_the_command(
    emps: Robot,
    bench: Channel,
    tmp_path: Path,
    armhil: Call,
) -> None:
    def call(*options: object) -> tuple[int, str, str]:
        arguments = ["home", "emps", "--channel", bench.name, "--out", tmp_path, *options]
        return armhil(*arguments)

    told = "somebody has to look at the arm; give --stands-at where nobody can answer"
    code, _, err = call("--yes")
    assert (code, err.splitlines()[-1]) == (2, f"armhil: {told}"), "--yes has no eyes"
    code, out, err = call("--stands-at", str(emps.home[0]), "--json")
    assert code == 0, err
    answer = json.loads(out)
    assert answer["searches"] == [] and answer["run"] == 1
    assert answer["posture"] == pytest.approx(emps.home, abs=0.02)
    assert "drives say" in err and "keeps" in err
