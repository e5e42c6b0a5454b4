"""Captures, models, trajectories, maps and catalogues that are damaged or say something else.

    python benchmarks/file_mutations.py [--inputs 500] [--seed 0] [--only csv]

Half of the inputs of each kind are damaged at random (bytes, numbers, splices), half are well formed with
entries lost, doubled, swapped, renamed or of another kind. Each is read as the commands read it: refused in
one line, or what a second reading of the same file by nothing of armhil says. Prints a JSON line per kind,
and ends with an error at the first that is neither.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.daq.hostile_files import KINDS, Kind, judged


def run(name: str, kind: Kind, folder: Path, inputs: int, seed: int) -> dict[str, object]:
    """Counts of one kind."""
    folder.mkdir()
    good = kind.make(folder)
    kind.check(good, kind.read(good))
    data, counts, longest = good.read_bytes(), Counter[str](), 0.0
    for number in range(inputs):
        generator = random.Random(f"{name} {seed} {number}")
        begun = time.monotonic()
        way, refusal = judged(kind, good, data, number, generator)
        longest = max(longest, time.monotonic() - begun)
        counts[f"{way} {'accepted' if refusal is None else 'refused'}"] += 1
    return {"kind": name, "inputs": inputs, "seed": seed, **counts, "longest_s": round(longest, 2)}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--inputs", type=int, default=500, help="per kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=list(KINDS))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for key, kind in KINDS.items():
            if options.only in (None, key):
                found = run(key, kind, Path(name) / key, options.inputs, options.seed)
                print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
