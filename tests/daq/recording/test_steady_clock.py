"""The host's clock is set during a run, by hours: what is recorded stays in order and as long as it was."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from daq.catalogue import findings, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, Run
from daq.recording import listener as listening
from daq.recording import steady_clock
from daq.recording.frames import Frames
from daq.recording.listener import FrameListener
from daq.recording.mcap_scan import scan
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.steady_clock import SteadyClock
from daq.recording.temperatures import Temperature
from daq.recording.topics import CHANNELS, NUMBERS, STATIC_TOPIC
from drivers import Channel
from robots import Robot
from tests.daq.captures import facts, outcome, samples

HOUR = 3_600_000_000_000
STEPS = [HOUR, -HOUR, -5 * HOUR, 26 * HOUR, 40_000_000, -40_000_000, -700_000_000]


class Host:
    """Two clocks that only this moves."""

    def __init__(self) -> None:
        self.monotonic = 5_000_000_000_000
        self.setting = 1_700_000_000_000_000_000
        """From the monotonic clock to the host's, ns."""

    def monotonic_ns(self) -> int:
        return self.monotonic

    def time_ns(self) -> int:
        return self.monotonic + self.setting


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> Host:
    made = Host()
    monkeypatch.setattr(steady_clock, "time", made)
    return made


def test_without_a_step_stamps_pass_unchanged(host: Host) -> None:
    clock = SteadyClock()
    stamps = host.time_ns() + np.cumsum(np.full(100, 777_777))
    host.monotonic += 10**9
    assert np.array_equal(clock.steady(stamps), stamps)
    assert clock.now() == host.time_ns()
    foreign = np.arange(5) * 1000 + stamps[-1] + 400 * HOUR  # a controller with a clock of its own
    assert np.array_equal(clock.steady(foreign), foreign)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("seed", range(5))
def test_frames_around_a_step_keep_their_times(host: Host, step: int, seed: int) -> None:
    """Fetched in batches, of which some wait behind the step, as on a busy machine."""
    rng = np.random.default_rng(seed)
    clock, begin = SteadyClock(), host.time_ns()
    set_at, waiting, true, found = rng.integers(100, 900, 2).tolist(), [], [], []
    for k in range(1000):
        host.monotonic += int(rng.integers(10_000, 2_000_000))
        if k in set_at:
            host.setting += step
        waiting.append(host.time_ns())
        true.append(host.monotonic - 5_000_000_000_000 + begin)
        if rng.random() < 0.1 or k == 999:
            half = len(waiting) // 2
            for part in (waiting[:half], waiting[half:]):
                found += clock.steady(np.array(part, dtype=np.int64)).tolist()
            waiting = []
    assert np.all(np.diff(found) >= 0)
    off = np.abs(np.array(found) - np.array(true))
    # A step that is shorter than frames may wait cannot be told from waiting.
    assert off.max() == 0 if abs(step) > HOUR // 2 else off.max() <= 2 * abs(step)
    assert clock.now() == true[-1]


@pytest.mark.parametrize("set_at", [0, 9])
@pytest.mark.parametrize("step", STEPS)
def test_every_topic_of_a_capture_stays_in_order(
    host: Host, step: int, set_at: int, tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting: list[int] = []

    def take() -> Frames:
        frames = Frames.empty(len(waiting))
        frames.stamp[:], frames.can_id[:] = waiting, 0x081
        frames.dlc[:] = 8
        frames.data[:, :2] = 0x10, 0x43
        waiting.clear()
        return frames

    source = SimpleNamespace(take=take, dropped=lambda: 0)
    monkeypatch.setattr(listening, "open_bus", lambda *a, **k: SimpleNamespace(shutdown=lambda: None))
    monkeypatch.setattr(listening, "_source", lambda bus: source)
    path = tmp_path / "run.mcap"
    with (
        FrameListener(Channel("virtual", "clock")) as listener,
        Recorder(path, tx40, facts(tx40), listener=listener) as recorder,
    ):
        listener._ended.set()
        listener._thread.join()
        listener._ended.clear()
        for k in range(20):
            host.monotonic += 50_000_000
            if k == set_at:
                host.setting += step
            waiting.append(host.time_ns())
            listener.fetch()
            recorder.write(batch := samples(50 * k, 50), {"temperature": batch.position})
            recorder.write_temperatures([Temperature(recorder.clock.now(), "joint_1", 30.0)])
        recorder.finish(outcome(1000))
        listener._ended.set()
    found = scan(path.read_bytes(), CHANNELS.__contains__)
    times = {number: np.concatenate([run.log_time for run in found.runs[number]]) for number in found.runs}
    assert set(times) == set(CHANNELS) - {NUMBERS[STATIC_TOPIC]}, "no joint of this arm stands still"
    everything = np.concatenate(list(times.values()))
    assert np.ptp(everything) <= 1_050_000_000
    assert {CHANNELS[k] for k, stamps in times.items() if np.any(np.diff(stamps) < 0)} == set()
    assert not read_capture(path).damage


@pytest.mark.parametrize("step", STEPS)
def test_a_run_in_the_catalogue_lasts_as_long_as_it_lasted(
    host: Host, step: int, tx40: Robot, own_catalogue: Path, new_run: Callable[[Catalogue], Run]
) -> None:
    catalogue = Catalogue(str(own_catalogue))
    first = new_run(catalogue)
    host.monotonic += 2_000_000_000
    host.setting += step
    ended = runs.finish(catalogue, first.id, "completed")
    assert ended.finished == ended.started + timedelta(seconds=2)
    assert findings.add(catalogue, first.id, []) == ()
    second = new_run(catalogue)
    assert [run.id for run in runs.every(catalogue)] == [second.id, first.id], (
        "in the order of their beginning"
    )


@pytest.fixture
def new_run(tx40: Robot) -> Callable[[Catalogue], Run]:
    identity = ArmIdentity(tx40.name, (1, 2, 3, 4, 5, 6), "0" * 64)
    return lambda catalogue: runs.begin(catalogue, identity, "run")
