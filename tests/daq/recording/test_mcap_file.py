"""The file that grows by batches: its summary, and what it keeps in memory while it grows."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from daq.recording.mcap_file import McapFile, Topic

TOPICS = (Topic("/a", "test/A", "uint8[16] data\n"), Topic("/b", "test/B", "uint8[32] data\n"))


def grow(file: McapFile, first: int, chunks: int) -> None:
    """Chunks of a few messages; every third one has nothing of the second channel."""
    for number in range(first, first + chunks):
        stamps = 1_000_000 * number + np.arange(4, dtype=np.int64)
        sequences = np.arange(4, dtype=np.uint32)
        file.add(1, sequences, stamps, np.full((4, 16), number % 251, dtype=np.uint8))
        if number % 3:
            file.add(2, sequences[:2], stamps[:2] + 1, np.full((2, 32), number % 7, dtype=np.uint8))
        file.flush()


def test_the_summary_knows_every_chunk(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with path.open("x+b") as opened:
        file = McapFile(opened, "test", "test", TOPICS)
        file.add_metadata("first", {"a": "b"})
        grow(file, 0, 10)
        file.add_metadata("middle", {"c": "d"})
        grow(file, 10, 20)
        file.finish()
    with path.open("rb") as opened:
        reader = make_reader(opened, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        # The first chunk has schemas and channels alone.
        assert [len(index.message_index_offsets) for index in summary.chunk_indexes] == [
            0,
            *(2 if number % 3 else 1 for number in range(30)),
        ]
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) == 31
        assert summary.statistics.channel_message_counts == {1: 120, 2: 40}
        assert [index.name for index in summary.metadata_indexes] == ["first", "middle"]
        times = [index.message_start_time for index in summary.chunk_indexes[1:]]
        assert times == [1_000_000 * number for number in range(30)]
        # From the end, found by the index as tools seek.
        back = list(reader.iter_messages(topics="/b", reverse=True))
        assert len(back) == 40
        assert back[0][2].data == bytes([29 % 7] * 32) and back[-1][2].data == bytes([1] * 32)


def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    """An hour at 10 chunks a second has 36 000 of them; a tenth of that here."""
    with (tmp_path / "run.mcap").open("x+b") as opened:
        file = McapFile(opened, "test", "test", TOPICS)
        grow(file, 0, 100)
        tracemalloc.start()
        try:
            grow(file, 100, 100)
            before = tracemalloc.get_traced_memory()[0]
            grow(file, 200, 3600)
            grown = tracemalloc.get_traced_memory()[0] - before
            tracemalloc.reset_peak()
            file.finish()
            peak = tracemalloc.get_traced_memory()[1] - before
        finally:
            tracemalloc.stop()
    assert grown < 20_000, "bytes; five for each chunk would be too many"
    assert peak < 100_000, "the summary is written as it is read back"
