"""Captures that something has happened to: never silently wrong, one line where nothing can be read."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from daq.recording.capture import DESCRIPTION, RUN, Capture, CaptureError, facts_checksum
from daq.recording.mcap_file import MAGIC
from daq.recording.mcap_scan import scan
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.run_facts import outcome_facts
from drivers import Samples, StreamResult
from drivers.cyclic import stream
from robots import Robot
from tests.daq.captures import BATCH, facts, record_cycles, samples
from tests.drivers.cyclic.test_loop import stream_job

CYCLES = 2000
TRIALS = 30


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, tx40: Robot) -> bytes:
    """The bytes of a capture of ``CYCLES`` cycles in chunks of ``BATCH``."""
    with pytest.MonkeyPatch.context() as patch:
        path = record_cycles(tmp_path_factory.mktemp("whole") / "run.mcap", tx40, CYCLES, patch)
    return path.read_bytes()


@pytest.fixture
def read(tmp_path: Path) -> Callable[[bytes], Capture]:
    def read_bytes(data: bytes) -> Capture:
        path = tmp_path / "damaged.mcap"
        path.write_bytes(data)
        return read_capture(path)

    return read_bytes


def assert_true(capture: Capture) -> None:
    """Every cycle in it is as recorded, and every cycle that is not in it is said to be missing."""
    cycles = capture.samples.cycle
    assert np.array_equal(cycles, np.unique(cycles))
    expected = samples(0, CYCLES)
    for field in fields(Samples):
        np.testing.assert_array_equal(
            getattr(capture.samples, field.name), getattr(expected, field.name)[cycles], strict=True
        )
    told = {cycle for gap in capture.damage.gaps for cycle in range(gap.first, gap.last + 1)}
    end = CYCLES if capture.outcome is not None else int(cycles[-1]) + 1
    assert told == set(range(end)) - set(cycles.tolist())
    if len(cycles) < CYCLES:
        assert capture.damage
        assert all(capture.damage.sentences(capture.period))
    if capture.outcome is None:
        assert not capture.damage.closed or capture.damage.lost_records


def attempt(read: Callable[[bytes], Capture], data: bytes) -> tuple[Capture | None, str]:
    """The capture, or why there is none."""
    try:
        return read(data), ""
    except CaptureError as error:
        return None, str(error)


def test_an_outcome_that_does_not_know_or_knows_less_than_the_file_is_told(
    tmp_path: Path, tx40: Robot
) -> None:
    for told, unknown, beyond, words in (
        ("unknown", True, 0, "the cyclic process died: what followed the last cycle is not known"),
        ("0", False, 120, "120 cycles are in the file beyond those that its outcome tells of"),
        ("119", False, 1, "1 cycles are in the file beyond those that its outcome tells of"),
    ):
        path = tmp_path / f"{told}.mcap"
        with Recorder(path, tx40, facts(tx40)) as recorder:
            recorder.write(samples(0, 120))
            recorder.finish({"outcome": "aborted", "reason": "", "cycles": told})
        damage = read_capture(path).damage
        assert (damage.unknown_end, damage.beyond, bool(damage)) == (unknown, beyond, True)
        assert damage.sentences(0.001) == (words,)


def test_where_the_cyclic_process_died_nothing_is_known_of_its_counts(tmp_path: Path) -> None:
    with (tmp_path / "errors").open("w+b") as errors:
        result = stream._result(b"", -9, errors, stream_job())
    assert result.outcome == "aborted" and "exit code -9" in result.reason
    told = outcome_facts(result)
    counts = ("cycles", "missed_cycles", "late_cycles", "incomplete_cycles", "incomplete_before", "overflows")
    assert {told[name] for name in counts} == {"unknown"}
    assert result.cycles_words == "an unknown number of cycles"


def test_cycles_in_words() -> None:
    def words(missed: int) -> str:
        return StreamResult("stopped", "Ctrl-C", 89, missed, 0).cycles_words

    assert words(0) == "89 cycles"
    assert words(1) == "89 of 90 cycles (1 deadline missed)"
    assert words(2) == "89 of 91 cycles (2 deadlines missed)"


def test_thirty_truncations(whole: bytes, read: Callable[[bytes], Capture]) -> None:
    generator = random.Random(1)
    data_begins = whole.index(b"zstd", whole.index(b"armhil.trajectory"))
    for _ in range(TRIALS):
        at = generator.randrange(data_begins, len(whole))
        capture, refusal = attempt(read, whole[:at])
        if capture is None:
            assert "no sample" in refusal
            assert at < data_begins + 2 * len(whole) * BATCH // CYCLES
            continue
        assert_true(capture)
        # Nothing is lost but the chunk that was cut.
        assert len(capture.samples) == scan(whole[:at]).counts[3]
        assert not capture.damage.gaps or capture.outcome is not None


@pytest.mark.parametrize("bits", [1, 40])
def test_thirty_times_bits_flipped(bits: int, whole: bytes, read: Callable[[bytes], Capture]) -> None:
    """One bit in any place costs one chunk at most; a burst of 40 in random places may cost 40."""
    generator = random.Random(bits)
    for _ in range(TRIALS):
        data = bytearray(whole)
        for _ in range(bits):
            # The magic at the start is what makes it a capture at all.
            data[generator.randrange(len(MAGIC), len(data))] ^= 1 << generator.randrange(8)
        capture, refusal = attempt(read, bytes(data))
        if capture is None:
            assert bits > 1
            assert "missing or damaged" in refusal
            continue
        assert_true(capture)
        assert len(capture.samples) >= CYCLES - bits * BATCH


def test_every_bit_of_a_records_first_bytes(whole: bytes, read: Callable[[bytes], Capture]) -> None:
    """Opcode and length decide where the next record begins: the hardest bits to get wrong."""
    chunk = whole.index(b"zstd", len(whole) // 2) - 41
    for byte in range(chunk, chunk + 48):
        data = bytearray(whole)
        data[byte] ^= 1 << byte % 8
        capture = read(bytes(data))
        assert_true(capture)
        assert len(capture.samples) >= CYCLES - BATCH


def test_a_block_of_zeros_in_the_middle(whole: bytes, read: Callable[[bytes], Capture]) -> None:
    middle = len(whole) // 2
    data = whole[:middle] + bytes(4096) + whole[middle + 4096 :]
    capture = read(data)
    assert_true(capture)
    assert capture.damage.unreadable_bytes >= 4096
    assert len(capture.damage.gaps) == 1
    assert len(capture.segments()) == 2


def test_a_flip_where_nothing_is_stored_costs_nothing(whole: bytes, read: Callable[[bytes], Capture]) -> None:
    capture = read(whole[:-20] + b"\xff" + whole[-19:])
    assert_true(capture)
    assert len(capture.samples) == CYCLES


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"time,q1\n0,1\n", "is a text file"),
        ("größe,µ\n".encode() * 800, "is a text file"),
        (b"\x7fELF\x02\x01\x01" + bytes(range(256)), "is a binary file of another kind"),
        (MAGIC, "is an MCAP file of profile ''"),
        (MAGIC + MAGIC, "is an MCAP file of profile ''"),
    ],
)
def test_other_files_are_one_line(content: bytes, reason: str, read: Callable[[bytes], Capture]) -> None:
    with pytest.raises(CaptureError) as caught:
        read(content)
    assert reason in str(caught.value)
    assert "allowed: an MCAP capture recorded by armhil" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_folders_and_absent_files_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="is a folder"):
        read_capture(tmp_path)
    with pytest.raises(CaptureError, match="no such file"):
        read_capture(tmp_path / "none.mcap")


def write_other(path: Path, profile: str, metadata: dict[str, dict[str, str]]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile, library="test")
        channel = writer.register_channel(
            "/chatter", "json", writer.register_schema("a", "jsonschema", b"{}")
        )
        writer.add_message(channel, 1, b"{}", 1)
        for name, record in metadata.items():
            writer.add_metadata(name, record)
        writer.finish()
    return path


def test_an_mcap_file_of_others_is_one_line(tmp_path: Path) -> None:
    path = write_other(tmp_path / "other.mcap", "ros2", {"armhil.ish": {"a": "b"}})
    with pytest.raises(CaptureError, match="is an MCAP file of profile 'ros2'; allowed: an MCAP capture"):
        read_capture(path)


def checked(record: dict[str, str]) -> dict[str, str]:
    return record | {"sha256": facts_checksum(record)}


@pytest.mark.parametrize(
    ("run", "reason"),
    [
        ({}, "its records lack the key 'period'"),
        ({"period": "fast"}, "armhil.run: period: 'fast'; allowed: a number"),
        ({"period": "nan"}, "armhil.run: period: 'nan'; allowed: a number"),
        ({"period": "0.001"}, "no sample in it can be read"),
    ],
)
def test_records_that_make_no_sense_are_one_line(
    run: dict[str, str], reason: str, tmp_path: Path, tx40: Robot
) -> None:
    records = {DESCRIPTION: checked(dict(facts(tx40)[DESCRIPTION])), RUN: checked(run)}
    with pytest.raises(CaptureError) as caught:
        read_capture(write_other(tmp_path / "other.mcap", "armhil", records))
    assert reason in str(caught.value)


def test_without_its_description_a_capture_means_nothing(
    whole: bytes, read: Callable[[bytes], Capture]
) -> None:
    with pytest.raises(CaptureError, match=r"armhil\.description is missing or damaged"):
        read(whole.replace(b"encoder_counts", b"encoder_c0unts"))


@given(st.binary(max_size=400))
def test_random_bytes_after_the_magic_are_scanned(data: bytes) -> None:
    found = scan(MAGIC + data)
    assert found.unreadable_bytes <= len(data)
    assert not found.runs
