"""Recovery: all that is intact comes back, exactly what is missing is said, and gaps are never data."""

from __future__ import annotations

import json
import random
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from daq.importing.captures import load_capture
from daq.recording.capture import CaptureError
from daq.recording.mcap_file import MAGIC
from daq.recording.reader import read_capture, read_frames
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover, recovery_json, recovery_text
from drivers import Samples
from robots import Robot
from tests.daq.captures import BATCH, PERIOD, facts, outcome, record_cycles, samples, traffic

CYCLES = 3000
TRIALS = 15


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, tx40: Robot) -> bytes:
    """A capture with frames between its samples."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("daq.recording.recorder.FLUSH_INTERVAL", 0.0)
        with Recorder(path, tx40, facts(tx40), start_ns=1_700_000_000_000_000_000) as recorder:
            for begin in range(0, CYCLES, BATCH):
                recorder.write(samples(begin, BATCH))
                recorder.write_frames(traffic(tx40, 5, 1_700_000_000_000_000_000 + begin * 1_000_000))
            recorder.finish(outcome(CYCLES))
    return path.read_bytes()


def assert_recovered(source: Path, out: Path) -> int:
    """What is in the new file is as recorded; what is not is named; returns the cycles that are there."""
    found = recover(source, out)
    capture, before = found.capture, read_capture(source)
    cycles = capture.samples.cycle
    for field in fields(Samples):
        expected = getattr(samples(0, CYCLES), field.name)[cycles]
        np.testing.assert_array_equal(getattr(capture.samples, field.name), expected, strict=True)
    told = {cycle for gap in capture.damage.gaps for cycle in range(gap.first, gap.last + 1)}
    end = CYCLES if capture.outcome is not None else int(cycles[-1]) + 1
    assert told == set(range(end)) - set(cycles.tolist())
    assert len(capture.samples) == len(before.samples)
    assert (capture.damage, capture.events, capture.frames) == (before.damage, before.events, before.frames)
    # Another reading of the new file meets no damage but the old.
    again = recover(out, out.with_name("again.mcap")).capture
    assert again.damage == capture.damage
    return len(cycles)


def test_truncated_files(whole: bytes, tmp_path: Path) -> None:
    generator = random.Random(3)
    begin = whole.index(b"zstd", whole.index(b"armhil.trajectory"))
    for trial in range(TRIALS):
        at = generator.randrange(begin + 60_000, len(whole))
        folder = tmp_path / str(trial)
        folder.mkdir()
        source = folder / "cut.mcap"
        source.write_bytes(whole[:at])
        kept = assert_recovered(source, folder / "out.mcap")
        # The last chunk may be cut in two; everything before it is there.
        assert kept >= CYCLES * (at - begin) / (len(whole) - begin) - 2 * BATCH


def test_files_with_a_wrong_bit(whole: bytes, tmp_path: Path) -> None:
    generator = random.Random(4)
    for trial in range(TRIALS):
        data = bytearray(whole)
        data[generator.randrange(len(MAGIC), len(data))] ^= 1 << generator.randrange(8)
        folder = tmp_path / str(trial)
        folder.mkdir()
        source = folder / "flipped.mcap"
        source.write_bytes(data)
        assert assert_recovered(source, folder / "out.mcap") >= CYCLES - BATCH


def test_a_whole_file_stays_whole(whole: bytes, tmp_path: Path) -> None:
    source = tmp_path / "run.mcap"
    source.write_bytes(whole)
    found = recover(source, tmp_path / "out.mcap")
    assert found.whole
    assert recovery_text(found)[-1] == "nothing is missing"
    mine, theirs = read_frames(source), read_frames(found.capture.path)
    assert np.array_equal(mine.data, theirs.data)
    assert np.array_equal(mine.stamp, theirs.stamp)
    assert found.capture.path.stat().st_mode & 0o222 == 0


def test_what_is_missing_is_said_in_cycles_joints_and_seconds(tmp_path: Path, tx40: Robot) -> None:
    source = tmp_path / "run.mcap"
    silent = samples(0, 1000)
    silent.complete[40:60, 3] = False
    silent.complete[100, 3] = False
    with Recorder(source, tx40, facts(tx40)) as recorder:
        recorder.write(silent)
        recorder.write(samples(1200, 300))
        recorder.write_frames(traffic(tx40, 30))
    found = recover(source, tmp_path / "out.mcap")
    assert recovery_text(found)[1:] == [
        "missing: cycles 1000 to 1199 are missing (0.200 s)",
        "missing: the recording was not closed: what followed the last cycle is not known",
        "missing: joint_4 did not answer 21 cycles (0.021 s): 40 to 59, 100 to 100",
    ]
    answer = recovery_json(found)
    json.dumps(answer, allow_nan=False)
    assert (answer["cycles"], answer["missing_cycles"], answer["closed"]) == (1300, 200, False)
    assert answer["gaps"] == [{"first": 1000, "last": 1199, "cycles": 200, "seconds": pytest.approx(0.2)}]
    assert answer["unanswered"][0]["joint"] == "joint_4"
    assert answer["unanswered"][0]["gaps"][1]["first"] == 100


def test_lost_frames_are_counted(whole: bytes, tmp_path: Path) -> None:
    chunk, answers = len(whole) // 2, []
    for k in range(3):  # of samples, of transforms, of frames
        chunk = whole.index(b"zstd", chunk + 1)
        data = bytearray(whole)
        data[chunk + 200] ^= 1
        source = tmp_path / f"run{k}.mcap"
        source.write_bytes(data)
        answers.append(recovery_json(recover(source, tmp_path / f"out{k}.mcap")))
    (answer,) = (one for one in answers if one["missing_frames"])
    assert answer["missing_frames"] <= 5 * 14
    assert answer["frames"] + answer["missing_frames"] == 5 * 14 * CYCLES // BATCH


def test_gaps_of_a_recovered_capture_are_never_data(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = record_cycles(tmp_path / "run.mcap", tx40, 6000, monkeypatch)
    data = bytearray(source.read_bytes())
    chunk = data.index(b"zstd", len(data) // 2)
    data[chunk + 100] ^= 1
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    out = recover(damaged, tmp_path / "out.mcap").capture
    (gap,) = out.damage.gaps
    assert gap.cycles == BATCH
    loaded = load_capture(out.path, tx40)
    assert [len(r.time) for r in loaded.recordings] == [gap.first, 6000 - gap.last - 1]
    assert all(np.allclose(np.diff(r.time), PERIOD) for r in loaded.recordings)
    assert f"cycles {gap.first} to {gap.last} are missing" in loaded.warnings[0]


def test_a_lost_description_can_be_given(whole: bytes, tmp_path: Path, tx40: Robot) -> None:
    source = tmp_path / "run.mcap"
    source.write_bytes(whole.replace(b"encoder_counts", b"encoder_c0unts"))
    with pytest.raises(CaptureError, match=r"armhil.description is missing .* --robot names the arm"):
        recover(source, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
    capture = recover(source, tmp_path / "out.mcap", tx40).capture
    assert capture.robot_text == tx40.source_text
    assert capture.damage.lost_records == ("armhil.description",)
    assert capture.damage.gaps == ()
    assert len(capture.samples) == CYCLES


def test_refusals_are_one_line_and_leave_nothing(whole: bytes, tmp_path: Path) -> None:
    text = tmp_path / "text.mcap"
    text.write_text("time,q\n")
    out = tmp_path / "out.mcap"
    with pytest.raises(CaptureError, match="is a text file"):
        recover(text, out)
    assert not out.exists()
    out.write_bytes(b"mine")
    source = tmp_path / "run.mcap"
    source.write_bytes(whole)
    with pytest.raises(CaptureError, match="exists already"):
        recover(source, out)
    assert out.read_bytes() == b"mine"
    with pytest.raises(CaptureError, match="cannot be written"):
        recover(source, tmp_path / "none" / "out.mcap")
