"""``armhil check`` on simulated drives: from no baseline to a verdict, and killed at every stage."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from daq.catalogue import arms, baselines, checks, leases, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description
from daq.catalogue.values import ArmIdentity, ArmMismatch, LeaseHeld
from daq.check.errors import CheckError
from daq.check.fleet import FleetFileError, read_fleet
from daq.check.recorded import require_own_baseline
from daq.check.request import Verdict
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from drivers import Channel
from tests.daq.captures import samples_in
from tests.daq.service.filled import fill

SHORT = ["--duration", "5", "--evaluations", "300"]


def command(channel: Channel, *more: str) -> list[str]:
    where = ["--interface", channel.interface, "--channel", channel.name]
    return [sys.executable, "-m", "daq", "check", "emps", "--simulated", *where, *SHORT, *more]


def call(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "daq", *words], capture_output=True, text=True, check=False)


def check(channel: Channel, out: Path, *more: str) -> tuple[int, dict[str, object], str]:
    words = command(channel, "--quiet", "--json", "--out", str(out), *more)
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1, 2, 3) and done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout), done.stderr


@pytest.mark.slow
def test_from_no_baseline_to_a_verdict(channel: Channel, tmp_path: Path, no_leftovers: None) -> None:
    code, first, _ = check(channel, tmp_path / "one")
    assert code == 3 and first["verdict"] == "unknown" and "baseline accept 1" in str(first["sentence"])
    accepted = call("baseline", "accept", "1", "--reason", "first", "--author", "Ada", "--json")
    events = json.loads(accepted.stdout)["baselines"][0]["events"]
    assert (events[0]["author"], events[0]["reason"]) == ("Ada", "first")
    assert events[0]["report"] == str(tmp_path / "one" / "report.html")

    code, second, _ = check(channel, tmp_path / "two")
    assert code == 0 and second["verdict"] == "ok" and second["previous_verdict"] == "unknown"
    compared = second["comparison"]
    assert isinstance(compared, dict) and compared["stage"] == "learning" and compared["state"] == "unchanged"
    with Catalogue() as catalogue:
        one, two = runs.get(catalogue, 1), runs.get(catalogue, 2)
        assert one.facts["trajectory_sha256"] == two.facts["trajectory_sha256"]  # the accepted motion
        arm = arms.by_label(catalogue, "emps-sim")
        assert leases.holder_of(catalogue, arm.id) is None
        assert [record.verdict for record in checks.of_arm(catalogue, arm.id)] == ["ok", "unknown"]

    again = call("rerun", "2", "--analysis", "check", "--json")
    found = json.loads(again.stdout)
    assert (again.returncode, found["sameness"], found["differs"]) == (0, "identical", [])
    assert found["comparison"] == compared and found["check_verdict"] == "ok"
    assert (
        call("baseline", "suspect", "emps-sim", "--reason", "wrong tool", "--author", "Bob").returncode == 0
    )
    noise = str(two.facts["noise_seed"])
    code, third, said = check(channel, tmp_path / "three", "--noise-seed", noise)
    assert code == 1 and third["verdict"] == "warning"
    assert "WARNING: the baseline of arm emps-sim is SUSPECT: wrong tool (Bob" in said
    one_night, *repeated = (
        read_capture(tmp_path / name / "capture.mcap") for name in ("one", "two", "three")
    )
    _nights_differ(one_night, repeated[0])
    while _best_pair(repeated)[0] < 20 and len(repeated) < 5:  # a machine that stands still loses cycles
        out = tmp_path / f"repeat-{len(repeated)}"
        check(channel, out, "--noise-seed", noise)
        repeated.append(read_capture(out / "capture.mcap"))
    _nights_agree(*_best_pair(repeated))


def _nights_differ(one: Capture, two: Capture) -> None:
    np.testing.assert_array_equal(one.samples.reference, two.samples.reference)
    assert (one.samples.control_signal != two.samples.control_signal).mean() > 0.5
    assert one.run["seed"] == two.run["seed"] and one.run["noise_seed"] != two.run["noise_seed"]


def _best_pair(captures: list[Capture]) -> tuple[int, Capture, Capture]:
    """The two captures that both lost nothing for longest, with the number of those cycles."""
    first, second = sorted(captures, key=_whole_cycles, reverse=True)[:2]
    return _whole_cycles(second), first, second


def _nights_agree(cycles: int, one: Capture, again: Capture) -> None:
    """The same noise seed is the same night, until the machine loses a cycle."""
    assert one.run["noise_seed"] == again.run["noise_seed"]
    assert cycles >= 20
    for name in ("position", "control_signal"):
        expected, found = getattr(one.samples, name)[:cycles], getattr(again.samples, name)[:cycles]
        np.testing.assert_array_equal(found, expected)


def _whole_cycles(capture: Capture) -> int:
    """Cycles before the first one that was missed or not answered in time."""
    lost = (capture.samples.lateness > 0.5 * capture.period) | ~capture.samples.complete.all(axis=1)
    return int(np.argmax(lost)) if lost.any() else len(capture.samples)


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["Configure drives", "Stream and record", "Identify and test"])
def test_killed_at_any_stage(
    stage: str, channel: Channel, tmp_path: Path, no_leftovers: None, own_catalogue: Path
) -> None:
    """The lease is given back, the run is marked, the drives are gone, the next check has the arm."""
    out = tmp_path / "killed"
    process = _begun(channel, tmp_path / "steps", out, lambda: stage in _steps(tmp_path / "steps"))
    assert stage in _steps(tmp_path / "steps")
    if stage == "Stream and record":
        while not (out / "capture.mcap").exists():
            time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with Catalogue() as catalogue:
        runs.settle_abandoned(catalogue)
        leases.free_dead(catalogue, "emps")
        for arm in arms.every(catalogue):
            assert leases.holder_of(catalogue, arm.id) is None
        states = {run.state for run in runs.every(catalogue)}
        assert states <= {"abandoned", "finished"}
        if stage == "Stream and record":
            assert "abandoned" in states
        assert not checks.of_arm(catalogue, 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "stage", "said", "state"),
    [
        (signal.SIGTERM, "Stream and record", "stopped (SIGTERM): the arm is at rest", "stopped"),
        (signal.SIGINT, "Identify and test", "interrupted", "completed"),
    ],
)
def test_asked_to_end(
    number: int,
    stage: str,
    said: str,
    state: str,
    channel: Channel,
    tmp_path: Path,
    no_leftovers: None,
    own_catalogue: Path,
) -> None:
    """As a service manager or somebody at the terminal does: one line, 130, no verdict, the arm is free."""
    out = tmp_path / "ended"
    process = _begun(channel, tmp_path / "steps", out, lambda: _has_come_to(stage, tmp_path / "steps", out))
    process.send_signal(number)
    assert process.wait(60) == 130
    last = [line for line in _steps(tmp_path / "steps").splitlines() if line.strip()]
    assert said in " ".join(last) and "Traceback" not in " ".join(last)
    with Catalogue() as catalogue:
        (arm,) = arms.every(catalogue)
        assert leases.holder_of(catalogue, arm.id) is None, "given back, not only found to be dead"
        run = runs.every(catalogue)[0]
        assert (run.state, run.outcome) == ("finished", state)
        assert not checks.of_arm(catalogue, arm.id)


def _begun(channel: Channel, steps: Path, out: Path, has_come: Callable[[], bool]) -> subprocess.Popen[bytes]:
    """A check in a process of its own, once it has come as far as is asked for."""
    with steps.open("w") as said:
        process = subprocess.Popen(
            command(channel, "--out", str(out)), stdin=subprocess.DEVNULL, stdout=said, stderr=said
        )
    deadline = time.monotonic() + 150
    while time.monotonic() < deadline and not has_come():
        assert process.poll() is None
        time.sleep(0.02)
    return process


def _has_come_to(stage: str, steps: Path, out: Path) -> bool:
    if stage not in _steps(steps):
        return False
    return stage != "Stream and record" or samples_in(out / "capture.mcap") > 0


def _steps(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def test_a_lease_of_a_living_process_is_left_alone(caplog: pytest.LogCaptureFixture) -> None:
    identity = ArmIdentity("emps", (7,), "0" * 64)
    with Catalogue() as catalogue:
        arm = arms.register(catalogue, identity)
        with leases.leased(catalogue, arm.id, 60.0):
            assert leases.free_dead(catalogue, "emps") == ()
            assert leases.holder_of(catalogue, arm.id) is not None
            with pytest.raises(LeaseHeld):
                leases.take(catalogue, arm.id, 60.0, holder="host:1:2")
        dead = subprocess.run([sys.executable, "-c", _TAKE], capture_output=True, text=True, check=False)
        assert dead.returncode == -signal.SIGKILL, dead.stderr
        assert leases.holder_of(catalogue, arm.id) is not None
        assert leases.free_dead(catalogue, "emps") == (arm.label,)
        assert f"arm {arm.label}: the process that held it is gone; its lease was given back" in caplog.text
        assert leases.holder_of(catalogue, arm.id) is None


_TAKE = """
import os, signal
from daq.catalogue import arms, leases
from daq.catalogue.database import Catalogue
catalogue = Catalogue()
leases.take(catalogue, arms.every(catalogue)[0].id, 600.0)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_baseline_of_another_description_is_refused(tmp_path: Path) -> None:
    with Catalogue() as catalogue:
        fill(catalogue, tmp_path, nights=2)
        arm = arms.every(catalogue)[0]
        baseline = baselines.current(catalogue, arm.id)
        assert baseline is not None
        require_own_baseline(catalogue, arm, baseline, Description("0" * 64, {}))
        with pytest.raises(ArmMismatch, match=r"baseline of run 1: was made with description .* put the"):
            require_own_baseline(catalogue, arm, baseline, Description("1" * 64, {}))


def test_exit_codes_are_those_of_nagios() -> None:
    assert [Verdict(word).exit_code for word in ("ok", "warning", "failed", "unknown")] == [0, 1, 2, 3]


@pytest.mark.slow
def test_baseline_commands_refuse_in_one_line(tmp_path: Path) -> None:
    with Catalogue() as catalogue:
        fill(catalogue, tmp_path, nights=2)
        assert models.latest_of(catalogue, 1).covariance is not None
    for words, said in (
        (("accept", "99", "--reason", "x"), "run 99: is not in the catalogue"),
        (("accept", "1", "--reason", "  "), "--reason is empty"),
        (("accept", "1", "--reason", "x", "--report", "/none.html"), "there is no such file"),
        (("suspect", "nobody", "--reason", "x"), "arm nobody: is not in the catalogue"),
    ):
        done = call("baseline", *words)
        assert done.returncode == 2 and said in done.stderr and len(done.stderr.splitlines()) == 1


def test_rollback_makes_the_one_before_count(tmp_path: Path) -> None:
    with Catalogue() as catalogue:
        label = fill(catalogue, tmp_path, nights=3)
    assert call("baseline", "accept", "2", "--reason", "new gear").returncode == 0
    back = json.loads(call("baseline", "rollback", label, "--reason", "no", "--json").stdout)["baselines"]
    assert [(one["run"], one["state"]) for one in back] == [(2, "rolled_back"), (1, "accepted")]
    shown = call("baseline", "show", label)
    assert "run 1, accepted (counts)" in shown.stdout and "new gear" in shown.stdout


def test_fleet_files(tmp_path: Path, new_channel: Callable[[], Channel]) -> None:
    file = tmp_path / "fleet.toml"
    with pytest.raises(CheckError, match="there is no fleet"):
        read_fleet(file)
    bus = 'interface = "udp_multicast"\nchannel = "239.74.1.1:20001"\n'
    arm = f'[[arm]]\nrobot = "emps"\n{bus}simulated = true\n'
    file.write_text(f"format = 1\n{arm}")
    (one,) = read_fleet(file).arm
    assert one.order().channel == Channel("udp_multicast", "239.74.1.1:20001") and one.order().simulated
    file.write_text(f"format = 1\n{arm}{arm}")
    with pytest.raises(FleetFileError, match="two arms on udp_multicast"):
        read_fleet(file)
    file.write_text(f"format = 1\n{arm}speed = 2\n")
    with pytest.raises(FleetFileError, match=r"fleet\.toml:7: .*speed"):
        read_fleet(file)
