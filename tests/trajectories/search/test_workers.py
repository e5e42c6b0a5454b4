"""Processes of a search end with the one that started them, whatever signal ended it."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import ROOT

ENDLESS = """
import sys, time
from trajectories.search.multi_start import best_of

class Endless:
    evaluations, done, best_score = 10**9, 0, 0.0
    def __init__(self, file):
        self.file = file
    def advance(self, trials):
        open(self.file, "w").close()
        time.sleep(1000.0)  # as a long trial: it takes no look at anything

best_of([Endless(file) for file in sys.argv[1:]], 2)
"""


@pytest.mark.parametrize("ended_by", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
@pytest.mark.usefixtures("no_leftovers")
def test_no_process_outlives_a_search(tmp_path: Path, ended_by: signal.Signals) -> None:
    begun = [tmp_path / "one", tmp_path / "other"]
    words = [sys.executable, "-c", ENDLESS, *map(str, begun)]
    with subprocess.Popen(words, cwd=ROOT, stderr=subprocess.DEVNULL) as search:
        while not all(file.exists() for file in begun):  # then both processes are at work
            assert search.poll() is None
            time.sleep(0.02)
        search.send_signal(ended_by)
