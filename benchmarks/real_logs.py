"""Recorded logs, a URDF and one command each, beside an independent least squares: what is left per joint.

Nothing is written by hand. The independent fit knows gears, zeros and coupling from the logs' owners and
shares nothing with armhil but Pinocchio's regressor (``tests/daq/importing/independent_fit.py``); its rows
are decimated through a filter as armhil's are, or sliced as their owners take them. Below the table stands
what the terminal says is wrong.

    python -m benchmarks.real_logs            # data in $ARMHIL_DATA; logs that are not there are left out
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from robots.arrays import FloatArray
from tests.daq.importing.published_logs import EMPS_URDF, PUBLISHED, PublishedLog

ROOT = Path(__file__).parents[1]
SAID = ("look it over", "warning:", "feed-forward", "known no better", "wrist")
"""Marks of sentences on what a log has that the usual model does not, or that was guessed."""


def answer(log: PublishedLog, data: Path) -> tuple[FloatArray, list[str], float]:
    """What armhil leaves per joint, %, what it says to look over, and the processor time, s."""
    urdf = EMPS_URDF if log.urdf is None else data / log.urdf
    command = [sys.executable, "-m", "daq", "identify", str(data / log.log), "--urdf", str(urdf)]
    command += [*log.options, "--no-catalogue", "--json"]
    begin = os.times()
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    end = os.times()
    if not done.stdout:
        raise SystemExit(f"{log.name}: {done.stderr}")
    estimate = json.loads(done.stdout)["estimates"]["ls"]
    seconds = end.children_user + end.children_system - begin.children_user - begin.children_system
    said = [line.strip(" -") for line in done.stderr.splitlines() if any(mark in line for mark in SAID)]
    return np.array(estimate["relative_error_percent"]["per_joint"]), said, seconds


def main() -> None:
    """The table of all logs that are there."""
    data = Path(os.environ.get("ARMHIL_DATA", ROOT.parent / "shared" / "data"))
    print("| log | armhil | independent, filtered rows | the same, sliced rows | largest ratio | processor |")
    print("|---|---|---|---|---|---|")
    notes = []
    for log in PUBLISHED:
        if not (data / log.log).exists():
            print(f"| {log.name} | not in {data} | | | | |")
            continue
        found, said, seconds = answer(log, data)
        filtered, sliced = log.known(data, True), log.known(data, False)
        rows = [", ".join(f"{value:.3g}" for value in values) for values in (found, filtered, sliced)]
        print(f"| {log.name} | {' | '.join(rows)} | {np.max(found / filtered):.2f} | {seconds:.1f} s |")
        notes += ["", f"{log.name}: identify {' '.join(log.options)}", *(f"- {line}" for line in said)]
    print("\n".join(notes))


if __name__ == "__main__":
    main()
