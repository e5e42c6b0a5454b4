"""SIGKILL to the processes of a stream at random moments: does anything move before somebody has looked?

    python benchmarks/killed_streams.py [--moments 50] [--seed 0] [--arms 3] [--kept FILE] [--page FILE]

A program drives a simulated arm as if it were a real one, and records it. At a random moment of that some of
three processes are killed: the program (the parent, in which recorder and listener are threads), the cyclic
process, the drives; every subset. Drives that were killed start anew and know of nothing; in half of the
other cases they lose their power afterwards. Then another user (other HOME, TMPDIR, XDG_STATE_HOME) tries to
drive the same arm. Counted are motions without an acknowledgement, refusals that do not name it, and what of
the recording is lost.

``--kept`` keeps each kill as it is done and goes on from there, so that a campaign can be made in pieces
(``--minutes``). Ends with 2 where anything is counted, or where more than 0.3 s are lost.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.killed_stream import CYCLIC, DRIVES, MOST_LOST, PARENT, Found, Plan, place

SUBSETS = (
    (PARENT,),
    (CYCLIC,),
    (PARENT, CYCLIC),
    (DRIVES,),
    (PARENT, DRIVES),
    (CYCLIC, DRIVES),
    (PARENT, CYCLIC, DRIVES),
)
KINDS = tuple(
    (subset, cycled) for subset in SUBSETS for cycled in (False, True) if cycled or DRIVES not in subset
)
"""What is killed, and whether the drives start anew; those that were killed do."""


def main() -> int:
    """Measure and print."""
    logging.disable(logging.ERROR)  # each kill is an error of some stream
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--moments", type=int, default=50, help="of each subset, with and without power cycle"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--arms", type=int, default=3, help="that are killed side by side")
    parser.add_argument("--minutes", type=float, default=1e9, help="after which no kill is begun")
    parser.add_argument(
        "--kept", type=Path, help="JSON lines, one a kill; what stands there is not done again"
    )
    parser.add_argument("--page", type=Path, help="Markdown with the results")
    given = parser.parse_args()
    kept = Kept(given.kept)
    until = time.monotonic() + 60.0 * given.minutes
    with tempfile.TemporaryDirectory() as folder, place(Path(folder), given.arms) as benches:
        todo = [one for one in planned(given.moments, given.seed) if one.key not in kept.found]
        with ThreadPoolExecutor(len(benches)) as pool:
            shares = (todo[k :: len(benches)] for k in range(len(benches)))
            list(pool.map(lambda bench, plans: bench.kills(plans, kept.add, until), benches, shares))
    found = list(kept.found.values())
    page = summary(found, given.seed)
    print(page)
    if given.page is not None:
        given.page.write_text(f"# {page}", encoding="utf-8")
    return 2 if any(one.problem for one in found) else 0


def planned(moments: int, seed: int) -> list[Plan]:
    """Every subset, with and without a power cycle, at random moments."""
    rng = np.random.default_rng(seed)
    return [
        Plan(f"{seed}-{number}-{kind}", subset, cycled, float(rng.uniform()))
        for number in range(moments)
        for kind, (subset, cycled) in enumerate(KINDS)
    ]


class Kept:
    """What came of the kills so far, on the disk as well where a file is given."""

    def __init__(self, path: Path | None) -> None:
        self._path, self._lock = path, threading.Lock()
        lines = path.read_text().splitlines() if path is not None and path.exists() else []
        self.found = {key: Found(**fields) for key, fields in map(json.loads, lines)}

    def add(self, key: str, found: Found) -> None:
        with self._lock:
            self.found[key] = found
            if found.problem:
                print(f"{key}, {_words(found)}, {found.moment:.3f} s: {found.problem}", flush=True)
            if self._path is not None:
                with self._path.open("a") as file:
                    file.write(json.dumps([key, asdict(found)]) + "\n")


def _words(found: Found) -> str:
    return f"{' and '.join(found.subset)}, power cycle {found.cycled}"


_WORDS = """\
Streams whose processes were killed

    python benchmarks/killed_streams.py --seed {seed} --page benchmarks/killed_streams.md

A program drives and records a simulated one-axis arm (EMPS, SYNCs of 4 ms) as if its drives were real. At a
random moment between the opening of its session and the end of its stream some of its processes get SIGKILL:
the program itself (recorder and listener are threads of it), the cyclic process, the drives; every subset of
them. Drives that were killed, and in half of the other cases those that were not, start anew and know of
nothing. Then another user, with other `HOME`, `TMPDIR`, `XDG_STATE_HOME` and `XDG_RUNTIME_DIR`, opens the
same arm and streams. Four arms at a time on a busy machine of two cores.

Of {kills} kills {torque} came under torque. The other user **moved the arm without an acknowledgement
{moved} times**, and each refusal named `armhil acknowledge`. Where nothing had been enabled yet, or the
stream had ended well, nothing stands in the way, and nothing should. {cut} recordings were cut: at most
**{most} s** of the motion that had gone out are not in the file, {median} s in the median; more than 0.3 s
in {beyond}. Of that, rows wait for a heartbeat of their drives for up to 0.1 s (simulated ones for another
0.1 s), and up to 0.05 s until they are fetched.
"""


def summary(found: list[Found], seed: int) -> str:
    """A table, one row per subset."""
    lost = [one.lost for one in found if one.lost is not None]
    counts = {
        "kills": len(found),
        "seed": seed,
        "torque": sum(one.torque for one in found),
        "moved": sum("moved" in one.problem for one in found),
        "cut": len(lost),
        "beyond": sum(one > MOST_LOST for one in lost),
        "most": f"{max(lost, default=0.0):.2f}",
        "median": f"{float(np.median(lost or [0.0])):.2f}",
    }
    lines = [
        _WORDS.format(**counts),
        "| killed | drives start anew | kills | under torque | refused | moved without acknowledgement |"
        " recordings cut | most lost, s | median, s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for subset, cycled in KINDS:
        some = [one for one in found if (tuple(one.subset), one.cycled) == (subset, cycled)]
        if not some:
            continue
        cut = [one.lost for one in some if one.lost is not None]
        cells = (
            " + ".join(subset),
            "yes" if cycled else "no",
            len(some),
            sum(one.torque for one in some),
            sum(one.refused for one in some),
            sum("moved" in one.problem for one in some),
            len(cut),
            f"{max(cut, default=0.0):.2f}",
            f"{float(np.median(cut or [0.0])):.2f}",
        )
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
