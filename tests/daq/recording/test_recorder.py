"""What the recorder writes: files that others open, that survive a kill and a full disk."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from daq.exporting.export import export_capture
from daq.recording.capture import OUTCOME, Capture, CaptureError, Gap
from daq.recording.frames import Frames
from daq.recording.reader import read_capture, read_frames
from daq.recording.recorder import Recorder
from daq.recording.temperatures import Temperature
from daq.recording.topics import (
    CHANNELS,
    CYCLE_STATUS_DEFINITION,
    EVENTS_TOPIC,
    FRAMES_TOPIC,
    MEASURED_TOPIC,
    REFERENCE_TOPIC,
    STATUS_TOPIC,
    TEMPERATURE_TOPIC,
)
from drivers import Samples
from robots import Robot
from robots.description import VelocityObject
from tests.daq.captures import BATCH, PERIOD, facts, outcome, record, record_cycles, samples, traffic

PROCESS = Path(__file__).with_name("recording_process.py")
LARGEST_LOSS = 0.3


def assert_same(found: Samples, expected: Samples) -> None:
    for field in fields(Samples):
        mine, theirs = getattr(found, field.name), getattr(expected, field.name)
        np.testing.assert_array_equal(mine, theirs, field.name, strict=True)


def assert_whole(capture: Capture, cycles: int) -> None:
    assert_same(capture.samples, samples(0, cycles))
    assert not capture.damage


def test_what_is_recorded_is_read_back(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = read_capture(record_cycles(tmp_path / "run.mcap", tx40, 1030, monkeypatch))
    assert_whole(capture, 1030)
    assert capture.robot_text == tx40.source_text
    assert capture.urdf_text == tx40.urdf_path.read_text(encoding="utf-8")
    assert capture.joints == tuple(joint.name for joint in tx40.joint)
    assert capture.period == PERIOD
    assert capture.trajectory["family"] == "test"
    assert capture.outcome is not None
    assert capture.outcome["outcome"] == "completed"
    assert [len(segment) for segment in capture.segments()] == [1030]


def test_one_axis(tmp_path: Path, emps: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = read_capture(record_cycles(tmp_path / "run.mcap", emps, 120, monkeypatch))
    assert_same(capture.samples, samples(0, 120, joints=1))


def test_velocities_are_recorded_where_drives_send_them(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    sending = tx40.model_copy(
        update={"drive": tuple(d.model_copy(update={"velocity": VelocityObject()}) for d in tx40.drive)}
    )
    plain = samples(0, 60)
    given = replace(plain, velocity=np.cos(plain.position) * 3.0)
    given.velocity[7, 2] = np.nan
    path = record(tmp_path / "run.mcap", sending, [given], monkeypatch)
    assert_same(read_capture(path).samples, given)
    measured = [decoded for _, decoded in decoded_by_mcap(path)[MEASURED_TOPIC]]
    np.testing.assert_array_equal([m.velocity for m in measured], given.velocity)
    exported = np.genfromtxt(export_capture(path, "csv").path, delimiter=",", names=True)
    np.testing.assert_array_equal(exported["qd_joint_3"], given.velocity[:, 2])
    without = record(tmp_path / "without.mcap", tx40, [given], monkeypatch)
    assert np.isnan(read_capture(without).samples.velocity).all()
    assert "qd_joint_3" not in export_capture(without, "csv").path.read_text().splitlines()[0]


def decoded_by_mcap(path: Path) -> dict[str, list[tuple[Any, Any]]]:
    """What the mcap library makes of a file, with its own checks: topic → (message, decoded)."""
    found: dict[str, list[tuple[Any, Any]]] = defaultdict(list)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message, decoded))
    return found


def stamp_of(decoded: Any) -> int:
    if hasattr(decoded, "transforms"):
        return stamp_of(decoded.transforms[0])
    stamp = decoded.header.stamp if hasattr(decoded, "header") else decoded.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def test_the_ros2_decoder_of_mcap_reads_it(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = decoded_by_mcap(record_cycles(tmp_path / "run.mcap", tx40, 110, monkeypatch))
    expected = samples(0, 110)
    reference, measured, status = (
        [decoded for _, decoded in found[topic]] for topic in (REFERENCE_TOPIC, MEASURED_TOPIC, STATUS_TOPIC)
    )
    assert np.array_equal([m.position for m in reference], expected.reference)
    assert np.array_equal([m.position for m in measured], expected.position)
    torque = tx40.joint_torque(expected.control_signal)
    assert np.allclose([m.effort for m in measured], torque, rtol=1e-14, atol=1e-13)
    assert [m.name for m in measured] == [[joint.name for joint in tx40.joint]] * 110
    assert all(len(m.velocity) == 0 for m in measured)
    for field in ("cycle", "lateness", "control_signal", "statusword", "complete"):
        assert np.array_equal([getattr(m, field) for m in status], getattr(expected, field)), field
    assert np.array_equal([m.following_error for m in status], expected.reference - expected.position)
    assert len(found.pop("/robot_description")) == 1  # a text has no stamp
    stamps = [(message.log_time, stamp_of(decoded)) for rows in found.values() for message, decoded in rows]
    assert all(log == header for log, header in stamps)
    first, last = (found[STATUS_TOPIC][at][0].log_time for at in (0, -1))
    assert last - first == 109 * round(PERIOD * 1e9)


def test_frames_events_and_temperatures_are_read_by_mcap_and_by_us(tmp_path: Path, tx40: Robot) -> None:
    path = tmp_path / "run.mcap"
    frames = traffic(tx40, 40)
    with Recorder(path, tx40, facts(tx40)) as recorder:
        recorder.write(samples(0, 50))
        recorder.write_frames(frames)
        recorder.write_temperatures([Temperature(5, "joint_2", 41.5)])
        recorder.finish(outcome(50))
    found = decoded_by_mcap(path)
    seen = [decoded for _, decoded in found[FRAMES_TOPIC]]
    assert np.array_equal([stamp_of(frame) for frame in seen], frames.stamp)
    assert [(f.id, f.dlc, bytes(f.data)) for f in seen] == [
        (i, d, row.tobytes()) for i, d, row in zip(frames.can_id, frames.dlc, frames.data, strict=True)
    ]
    assert [frame.is_error for frame in seen] == frames.is_error.tolist()
    ((_, warm),) = found[TEMPERATURE_TOPIC]
    assert (warm.header.frame_id, warm.temperature) == ("joint_2", 41.5)

    capture = read_capture(path)
    assert capture.frames == len(frames)
    assert capture.temperatures == (Temperature(5, "joint_2", 41.5),)
    for field in fields(Frames):
        assert np.array_equal(getattr(read_frames(path), field.name), getattr(frames, field.name))
    logged = sorted((decoded for _, decoded in found[EVENTS_TOPIC]), key=stamp_of)
    told = [(stamp_of(e), e.level, e.name, e.function, e.line, e.msg) for e in logged]
    assert told == [(e.stamp, e.level, e.joint, e.kind, e.code, e.text) for e in capture.events]
    assert "EMCY 0x4310 (motor over-temperature), error register: temperature" in {
        e.text for e in capture.events
    }


def test_missing_cycles_and_answers_are_gaps(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = samples(200, 100)
    silent.complete[40, 3] = False
    batches = [samples(5, 95), silent, samples(300, 50)]
    capture = read_capture(record(tmp_path / "run.mcap", tx40, batches, monkeypatch))
    assert capture.damage.gaps == (Gap(0, 4), Gap(100, 199))
    assert capture.damage.sentences(PERIOD)[1] == "cycles 100 to 199 are missing (0.100 s)"
    pieces = [(int(piece.cycle[0]), int(piece.cycle[-1])) for piece in capture.segments()]
    assert pieces == [(5, 99), (200, 239), (241, 349)]


def test_cycles_missing_at_the_end_are_a_gap(tmp_path: Path, tx40: Robot) -> None:
    path = tmp_path / "run.mcap"
    with Recorder(path, tx40, facts(tx40)) as recorder:
        recorder.write(samples(0, 100))
        recorder.finish(outcome(120))
    assert read_capture(path).damage.gaps == (Gap(100, 119),)


def test_an_abandoned_recording_says_so(tmp_path: Path, tx40: Robot) -> None:
    path = tmp_path / "run.mcap"
    with Recorder(path, tx40, facts(tx40)) as recorder:
        recorder.write(samples(0, 100))
    capture = read_capture(path)
    assert_same(capture.samples, samples(0, 100))
    assert not capture.damage.closed
    assert capture.damage
    assert capture.outcome is None
    assert "not closed" in capture.damage.sentences(PERIOD)[0]


def test_a_capture_is_never_overwritten(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    path = record_cycles(tmp_path / "run.mcap", tx40, 100, monkeypatch)
    before = path.read_bytes()
    assert path.stat().st_mode & 0o222 == 0
    with pytest.raises(CaptureError, match="exists already"):
        Recorder(path, tx40, facts(tx40))
    assert path.read_bytes() == before


def test_a_folder_that_is_not_there_is_one_line(tmp_path: Path, tx40: Robot) -> None:
    with pytest.raises(CaptureError, match="cannot be written: No such file or directory") as caught:
        Recorder(tmp_path / "none" / "run.mcap", tx40, facts(tx40))
    assert "\n" not in str(caught.value)


@contextmanager
def recording(path: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(PROCESS), str(path), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("seed", range(4))
def test_a_killed_recorder_loses_little(seed: int, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with recording(path) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        time.sleep(random.Random(seed).uniform(0.2, 1.0))
        process.kill()
        written = int((first + process.stdout.read()).split()[-1])
    capture = read_capture(path)
    kept = len(capture.samples)
    assert (written - kept) * PERIOD <= LARGEST_LOSS
    assert_same(capture.samples, samples(0, kept))
    assert not capture.damage.gaps
    assert not capture.damage.closed


def test_a_full_disk_keeps_what_was_recorded(tmp_path: Path) -> None:
    path, limit = tmp_path / "run.mcap", 500_000
    with recording(path, str(limit)) as process:
        output, _ = process.communicate(timeout=60)
    *counts, refusal = output.splitlines()
    assert refusal.startswith(f"refused: {path}: cannot be written any further: File too large; what was")
    assert path.stat().st_size <= limit
    capture = read_capture(path)
    kept = len(capture.samples)
    assert kept * PERIOD >= int(counts[-1]) * PERIOD - LARGEST_LOSS
    assert_same(capture.samples, samples(0, kept))
    assert not capture.damage.closed


def test_the_reference_has_every_channel_and_record(repository: Path, tx40: Robot) -> None:
    text = (repository / "docs" / "reference" / "capture-format.md").read_text(encoding="utf-8")
    for number, topic in CHANNELS.items():
        assert f"| {number} | `{topic}` |" in text
    for name in [*facts(tx40), OUTCOME]:
        assert f"| `{name}` |" in text
    fields_of_status = CYCLE_STATUS_DEFINITION.split("=" * 80)[0]
    named = [line.split() for line in fields_of_status.splitlines() if not line.startswith("#")]
    for kind, name in named:
        assert f"| `{name}` | `{kind}` |" in text


def test_every_record_is_there_twice(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    path = record_cycles(tmp_path / "run.mcap", tx40, BATCH, monkeypatch)
    with path.open("rb") as file:
        names = [record.name for record in make_reader(file).iter_metadata()]
    assert {names.count(name) for name in [*facts(tx40), OUTCOME]} == {2}
