"""One of many processes that write to a catalogue at once: ``writer_process.py URL NUMBER RUNS``."""

from __future__ import annotations

import sys

from daq.catalogue import baselines, leases, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import LeaseHeld
from tests.daq.catalogue.entries import identity, model


def main(url: str, number: int, count: int) -> int:
    won = 0
    with Catalogue(url) as catalogue:
        for k in range(count):
            run = runs.begin(catalogue, identity(), "run", facts={"writer": number, "k": k})
            try:
                leases.take(catalogue, run.arm_id, 1000.0)
                won += k == 0
            except LeaseHeld:
                pass
            kept = models.add(catalogue, run.id, model(number * 100 + k))
            baselines.accept(catalogue, kept.id, f"writer {number}", f"run {k}")
            runs.note(catalogue, 1, f"{number}.{k}")
            runs.finish(catalogue, run.id, "completed")
    return won


if __name__ == "__main__":
    sys.stdout.write(str(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))))
