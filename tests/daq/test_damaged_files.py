"""Damaged files of every kind: read, or refused with one line; never a crash, never a traceback.

``benchmarks/fuzz.py`` does the same with ten thousand.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.daq.damaged_files import ALLOWED, Readers, damaged, good_files

KINDS = (
    "capture",
    "csv",
    "mat",
    "compressed mat",
    "mat 4",
    "parquet",
    "bag",
    "db3",
    "robot.toml",
    "import.toml",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("damaged")


@pytest.fixture(scope="module")
def files(folder: Path) -> dict[str, Path]:
    return good_files(folder)


@pytest.fixture(scope="module")
def readers(folder: Path) -> Iterator[Readers]:
    found = Readers(folder)
    yield found
    found.process.close()


def test_the_good_files_are_read(files: dict[str, Path], readers: Readers) -> None:
    assert set(files) == set(KINDS)
    for kind, path in files.items():
        readers.of(kind)(path)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 2**64))
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_read_or_refused_with_one_line(
    kind: str, seed: int, files: dict[str, Path], readers: Readers
) -> None:
    path = files[kind].with_name("damaged" + files[kind].suffix)
    path.write_bytes(damaged(files[kind].read_bytes(), random.Random(seed)))
    try:
        readers.of(kind)(path)
    except ALLOWED as error:
        assert path.name in str(error)  # noqa: PT017 - both outcomes are allowed
        assert "\n" not in str(error)  # noqa: PT017
