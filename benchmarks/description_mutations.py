"""A thousand slips in a URDF and in a robot.toml each: what is accepted has the bodies and windows it says.

    python benchmarks/description_mutations.py [--inputs 1000] [--first 1000]

Prints, per file, how many slips (which nobody means) and edits (other figures) were refused and accepted, and
each refusal without a line. It ends with an error at the first that was accepted and is another arm than its
file says, and at any exception but a refusal. Seeds are fixed; the tests use those below 1000.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import robots
from tests.robots.mutated_arms import judged_toml, judged_urdf
from tests.robots.mutations import mutated_urdf
from tests.robots.toml_mutations import mutated_toml

HARNESSES = {
    "tx40.urdf": (mutated_urdf, judged_urdf),
    "robot.toml": (mutated_toml, judged_toml),
}


def run(name: str, folder: Path, seeds: range) -> dict[str, object]:
    mutated, judged = HARNESSES[name]
    original = (folder / name).read_text(encoding="utf-8")
    counts: Counter[str] = Counter()
    for seed in seeds:
        mutation = mutated(original, seed)
        refusal = judged(folder / "robot.toml", original, mutation)
        counts[f"{mutation.kind}s {'accepted' if refusal is None else 'refused'}"] += 1
        if refusal is not None and re.match(r"[^:]+:\d+: ", refusal) is None:
            counts["refused without a line"] += 1
            print(json.dumps({"seed": seed, "what": mutation.what, "refusal": refusal}))
    (folder / name).write_text(original, encoding="utf-8")
    return {"file": name, "inputs": len(seeds), **counts}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--inputs", type=int, default=1000, help="per file")
    parser.add_argument("--first", type=int, default=1000, help="seed of the first one")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "arm"
        shutil.copytree(Path(robots.__file__).parent / "tx40", folder)
        for file in HARNESSES:
            seeds = range(options.first, options.first + options.inputs)
            print(json.dumps(run(file, folder, seeds)), flush=True)


if __name__ == "__main__":
    main()
