"""Ten thousand damaged inputs to everything that reads files: no crash, no traceback, one clear line.

    python benchmarks/fuzz.py [--inputs 10000] [--only csv]

A good file of each kind is damaged at random (bits flipped, bytes replaced, pieces cut out, doubled,
inserted, swapped between kinds, cut off) and read. It must be read, or refused with one line that names it.
Files that libraries in C read are read as the importer reads them, in a process of their own; how often that
process died is printed. Seeds are fixed.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.daq.damaged_files import ALLOWED, Readers, damaged, good_files


def fuzz(kind: str, good: Path, readers: Readers, inputs: int, others: list[bytes]) -> dict[str, object]:
    generator = random.Random(f"armhil {kind}")
    data = good.read_bytes()
    path = good.with_name("damaged" + good.suffix)
    read = readers.of(kind)
    counts = {"read": 0, "refused": 0, "reader process ended": 0, "longest_s": 0.0}
    for _ in range(inputs):
        # One in a hundred is a file of another kind under this name.
        path.write_bytes(damaged(generator.choice(others) if generator.random() < 0.01 else data, generator))
        begin = time.monotonic()
        try:
            read(path)
            counts["read"] += 1
        except ALLOWED as error:
            line = str(error)
            if "\n" in line or path.name not in line:
                raise AssertionError(f"{kind}: not one line that names the file: {line!r}") from error
            counts["refused"] += 1
            counts["reader process ended"] += "ended the process" in line
        counts["longest_s"] = max(counts["longest_s"], time.monotonic() - begin)
    return {"kind": kind, "inputs": inputs, **counts}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000, help="in all, spread over the kinds")
    parser.add_argument("--only", help="one kind")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = good_files(folder)
        readers = Readers(folder)
        others = [path.read_bytes() for path in files.values()]
        chosen = {kind: path for kind, path in files.items() if options.only in (None, kind)}
        total = 0
        for kind, path in chosen.items():
            count = -(-options.inputs // len(chosen))
            total += count
            print(json.dumps(fuzz(kind, path, readers, count, others)), flush=True)
        readers.process.close()
    print(json.dumps({"inputs": total, "crashes": 0, "tracebacks": 0}))


if __name__ == "__main__":
    main()
