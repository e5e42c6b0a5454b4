"""The command itself in a terminal of its own: typed at all the while, it moves nothing."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drivers import Channel
from robots import Robot
from tests.daq.session.motions import there_and_back, written

COLUMNS = 80


@pytest.mark.slow
def test_who_types_ahead_while_drives_are_configured_is_asked_all_the_same(
    emps: Robot, bench: Channel, tmp_path: Path, passed: None
) -> None:
    path = written(tmp_path, emps, there_and_back(emps, distance=0.02))
    words = ["run", "emps", str(path), "--channel", bench.name, "--out", str(tmp_path / "out")]
    there, here = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "daq", *words],
        preexec_fn=lambda: os.login_tty(here),
        env=os.environ | {"COLUMNS": str(COLUMNS), "TERM": "xterm"},
    )
    os.close(here)
    shown, deadline = b"", time.monotonic() + 120
    try:
        while b"Go on? [y/N]: " not in shown:
            assert time.monotonic() < deadline, shown
            if b"is going to move" not in shown:
                os.write(there, b"y\n")
            if select.select([there], [], [], 0.05)[0]:
                shown += os.read(there, 4096)
        assert process.poll() is None
        os.write(there, b"n\n")
        while True:
            try:
                shown += os.read(there, 4096)
            except OSError:  # the terminal is closed on the other side
                break
        assert process.wait(60) == 2
    finally:
        process.kill()
        process.wait()
        os.close(there)
    text = shown.decode()
    assert "not confirmed, nothing moved" in text and not list(tmp_path.rglob("*.mcap"))
    asked = text[text.index("emps is going to move") : text.index("Go on? [y/N]")]
    assert "carriage" in asked and "of the speed limits" in asked
    assert max(map(len, asked.splitlines())) <= COLUMNS
