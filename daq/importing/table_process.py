"""Read other people's binary files in a process of its own, so that a damaged one cannot take this one along.

The process reads paths from standard input, one a line, and answers each with one JSON line (names and
lengths of the columns, or what is wrong in one line) and then the columns as float64.
"""

from __future__ import annotations

import json
import logging
import os
import resource
import select
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.typing import NDArray

from daq.recording.errors import CaptureError

log = logging.getLogger(__name__)

TIMEOUT = 300.0
"""s that a file may take."""
MOST_MEMORY = 16 << 30
"""Bytes of address space; a damaged length must not make the machine swap."""


class TableProcess:
    """The parent's side; use as a context manager. One process serves many files until one kills it."""

    def __init__(self, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._process: subprocess.Popen[bytes] | None = None

    def read(self, path: Path) -> dict[str, NDArray[np.float64]]:
        """The numeric columns of a file by name.

        Raises:
            CaptureError: one line on what is wrong with the file.
        """
        process = self._running()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(str(path)).encode() + b"\n")
            process.stdin.flush()
            deadline = time.monotonic() + self._timeout
            answer = json.loads(_take_line(process.stdout, deadline))
            for warning in answer.get("warnings", []):
                log.warning(warning)
            if "error" in answer:
                raise CaptureError(answer["error"])
            return {
                name: np.frombuffer(_take(process.stdout, 8 * count, deadline), dtype=np.float64)
                for name, count in answer["columns"]
            }
        except (EOFError, BrokenPipeError):
            code = self._end()
            raise CaptureError(
                f"{path}: cannot be read: it is damaged in a way that ended the process reading it ({code})"
            ) from None
        except TimeoutError:
            self._end()
            raise CaptureError(f"{path}: cannot be read: it took longer than {self._timeout:g} s") from None

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._process.poll() is not None:
            self._end()
            root = str(Path(__file__).parents[2])
            paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "daq.importing.table_process"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                bufsize=0,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            )
        return self._process

    def _end(self) -> str:
        """Kill it where it lives; how it ended."""
        process, self._process = self._process, None
        if process is None:
            return "it did not run"
        try:
            code = process.wait(0.5)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def close(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
        self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _take_line(stream: IO[bytes], deadline: float) -> bytes:
    line = bytearray()
    while not line.endswith(b"\n"):
        line += _take(stream, 1, deadline)
    return bytes(line)


def _take(stream: IO[bytes], count: int, deadline: float) -> bytes:
    """Exactly so many bytes.

    Raises:
        EOFError: the stream ends before.
        TimeoutError: they do not come in time.
    """
    parts: list[bytes] = []
    while count:
        ready, _, _ = select.select([stream], [], [], max(0.0, deadline - time.monotonic()))
        if not ready:
            raise TimeoutError
        part = os.read(stream.fileno(), min(count, 1 << 20))
        if not part:
            raise EOFError
        parts.append(part)
        count -= len(part)
    return b"".join(parts)


class _Warnings(logging.Handler):
    """Keeps what the readers warn of, for the answer."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


def serve(source: IO[bytes], answers: IO[bytes]) -> None:
    """The child's side: until ``source`` ends."""
    warnings = _Warnings()
    logging.getLogger("daq").addHandler(warnings)
    for line in source:
        path = Path(json.loads(line))
        warnings.lines.clear()
        try:
            columns = _read(path)
            answer: dict[str, Any] = {"columns": [(name, len(values)) for name, values in columns.items()]}
        except CaptureError as error:
            # Libraries break their lines.
            columns, answer = {}, {"error": " ".join(str(error).split())}
        text = json.dumps({**answer, "warnings": warnings.lines})
        answers.write(text.encode() + b"\n")
        for name in list(columns):  # what was sent is given up: a long log fills the memory twice otherwise
            answers.write(np.ascontiguousarray(columns.pop(name), dtype=np.float64).data.cast("B"))
        answers.flush()


def _read(path: Path) -> dict[str, NDArray[np.float64]]:
    from daq.importing.joint_states import read_bag
    from daq.importing.table_readers import READERS

    try:
        return read_bag(path) if path.is_dir() else READERS[path.suffix.lower()](path)
    except FileNotFoundError:
        raise CaptureError(f"{path}: no such file") from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror or error}") from error


def main() -> None:
    """Entry of the child."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    serve(sys.stdin.buffer, sys.stdout.buffer)


if __name__ == "__main__":
    main()
