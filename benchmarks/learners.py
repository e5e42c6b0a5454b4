"""Learners beside the search by evidence: draws to learn from, logs to be judged on, and the table.

    python -m benchmarks.learners draw --folder /tmp/learners --count 670
    python -m benchmarks.learners logs --folder /tmp/learners --kind dev --count 30
    python -m benchmarks.learners logs --folder /tmp/learners --kind own --count 80 --searched 30
    python -m benchmarks.learners logs --folder /tmp/learners --kind foreign
    python -m benchmarks.learners logs --folder /tmp/learners --kind shared
    python -m benchmarks.learners learn --folder /tmp/learners
    python -m benchmarks.learners report --folder /tmp/learners --picture docs/images/learners.svg

Learning needs scikit-learn and PyTorch, which armhil does not: see benchmarks/learners.md.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks.evidence.asked import asked
from benchmarks.evidence.case import Case
from benchmarks.learning import heldout, judged, published
from benchmarks.learning.draws import draws_of
from benchmarks.learning.labels import Hidden, index_of
from benchmarks.learning.report import picture, report, with_published
from benchmarks.learning.scoring import answer_of, sharpest, together
from benchmarks.learning.sizes import Sizes, measure
from benchmarks.naming_report import NAMES, lines_of
from drivers.errors import DriveError

ARM = "tx40"
PER_WORLD = 30
SIZES_SEED = 1
KINDS = ("dev", "own", "looked", "foreign", "shared")


def main() -> None:
    """Do the step that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("step", choices=("draw", "logs", "learn", "curve", "answer", "report"))
    parser.add_argument("--folder", type=Path, default=Path("learners"))
    parser.add_argument("--kind", choices=KINDS, default="own", help="of logs")
    parser.add_argument("--count", type=int, default=670, help="worlds of 30 draws, or logs")
    parser.add_argument("--first", type=int, default=1, help="seed of the first world")
    parser.add_argument("--searched", type=int, default=0, help="ask the search about so many of the logs")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin nothing after so long")
    parser.add_argument("--learn-seconds", type=float, default=1200.0, help="the network's time")
    parser.add_argument("--picture", type=Path, help="write the figure")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.step == "draw":
        draw(given.folder, given.first, given.count, given.seconds)
    elif given.step == "logs":
        keep_logs(given.folder, given.kind, given.count, given.searched, given.seconds)
    elif given.step == "learn":
        learn(given.folder, given.learn_seconds)
        answer(given.folder)
    elif given.step == "curve":
        curve(given.folder, given.learn_seconds)
    elif given.step == "answer":
        answer(given.folder)
    else:
        lines = [*lines_of(given.folder / "searched.jsonl"), *lines_of(given.folder / "learned.jsonl")]
        lines = with_published(lines)
        print(report(lines))
        if given.picture:
            picture(lines, given.picture)


def draw(folder: Path, first: int, worlds: int, seconds: float) -> None:
    """Worlds that are not there yet, one file each."""
    robot, until = robots.load(ARM), time.monotonic() + seconds
    sizes = sizes_in(folder)
    for seed in range(first, first + worlds):
        path = folder / f"world-{seed:05d}.npz"
        if path.exists() or time.monotonic() > until:
            continue
        started = time.process_time()
        found = list(draws_of(robot, sizes, seed, PER_WORLD))
        part = path.with_suffix(".part.npz")
        np.savez(
            part,
            window=np.stack([one.window for one in found]).astype(np.float16),
            context=found[0].context,
            effect=np.array([one.hidden.effect for one in found]),
            axis=np.array([one.hidden.axes[0] if one.hidden.axes else 0 for one in found]),
            processor=time.process_time() - started,
        )
        part.rename(path)


def sizes_in(folder: Path) -> Sizes:
    """The table of sizes, measured where it is not there yet."""
    path = folder / "sizes.json"
    if not path.exists():
        measure(robots.load(ARM), NAMES, SIZES_SEED).save(path)
    return Sizes.load(path)


def keep_logs(folder: Path, kind: str, count: int, searched: int, seconds: float) -> None:
    """Windows of the logs that are not there yet; the search's answers to the first of them."""
    until = time.monotonic() + seconds
    done = {line["name"] for line in lines_of(folder / "searched.jsonl")}
    for number, (name, case) in enumerate(cases(folder, kind, count)):
        path = folder / f"{kind}-{name}.npz"
        asks = number < searched and name not in done
        if (path.exists() and not asks) or time.monotonic() > until:
            continue
        try:
            found = case()
        except DriveError as error:  # no size of this effect shows so well on this arm
            print(name, error)
            continue
        if found is None:
            continue
        windows, context = judged.windows_of(found)
        truth = json.dumps(found.truth)
        np.savez(path, windows=windows.astype(np.float32), context=context, truth=truth, arm=found.robot.name)
        if asks:
            _write(folder / "searched.jsonl", kind, name, truth, "evidence", asked(found))


def cases(folder: Path, kind: str, count: int) -> Iterator[tuple[str, Callable[[], Case | None]]]:
    """Names of logs with what makes them."""
    if kind == "shared":
        for case in judged.shared(Path(os.environ["ARMHIL_DATA"]), folder):
            yield case.name, partial(_given, case)
    elif kind == "foreign":
        for seed in published.SEEDS:
            yield str(seed), partial(judged.foreign, seed, folder)
    else:
        make = judged.looked_at if kind == "looked" else judged.own
        for seed in range(judged.FIRST[kind], judged.FIRST[kind] + count):
            yield str(seed), partial(make, seed, folder)


def _given(case: Case) -> Case:
    return case


def learn(folder: Path, seconds: float) -> None:
    """Both learners on the draws there are, kept in the folder."""
    from benchmarks.learning import boosting, drawn, network

    draws = drawn.load(folder)
    held_out = int((draws.world % drawn.HELD_OUT == 0).sum())
    print(f"{len(draws.answer)} draws, {held_out} held out", flush=True)
    makers: dict[str, Callable[[], Any]] = {
        "boosting": partial(boosting.learn, draws),
        "network": partial(network.learn, draws, seconds, told=partial(print, flush=True)),
    }
    for name, make in makers.items():
        started = time.process_time()
        learner = make()
        print(f"{name}: {time.process_time() - started:.0f} s of a processor", flush=True)
        (folder / f"{name}.pkl").write_bytes(pickle.dumps(learner))


def curve(folder: Path, seconds: float) -> None:
    """What both learners have right of the same held-out draws, learned from some worlds and from all."""
    from benchmarks.learning import boosting, drawn, network

    draws = drawn.load(folder)
    held = draws.part(held_out=True)
    for parts in (8, 4, 2):
        some = draws.one_in(parts)
        print(f"{len(some.part(held_out=False).answer)} draws", flush=True)
        print(f"boosting: {heldout.told(boosting.learn(some), held)}", flush=True)
        print(f"network: {heldout.told(network.learn(some, seconds), held)}", flush=True)
    for name in ("boosting", "network"):
        kept = pickle.loads((folder / f"{name}.pkl").read_bytes())
        print(f"{name} of all: {heldout.told(kept, held)}", flush=True)


def answer(folder: Path) -> None:
    """The learners' answers to every log that is kept."""
    answered = folder / "learned.jsonl"
    answered.unlink(missing_ok=True)
    for name in ("boosting", "network"):
        answer_all(folder, answered, name, pickle.loads((folder / f"{name}.pkl").read_bytes()))


def answer_all(folder: Path, out: Path, name: str, learner: Any) -> None:
    """A learner's answers; how sharp they are is set on the logs for development."""
    scores = {path: _scores(learner, path) for kind in KINDS for path in sorted(folder.glob(f"{kind}-*.npz"))}
    windows, true = [], []
    for path, (logs, truth, drives) in scores.items():
        if path.name.startswith("dev-") and (index := _index(truth, drives)) is not None:
            windows.append(logs)
            true.append(index)
    sharpness = sharpest(windows, true) if windows else 1.0
    print(f"{name}: sharpness {sharpness:.2f} of {len(windows)} logs", flush=True)
    for path, (logs, truth, drives) in scores.items():
        kind, log = path.stem.split("-", 1)
        said = answer_of(together(logs, sharpness), drives)
        _write(out, kind, log, json.dumps(truth), name, said)


def _scores(learner: Any, path: Path) -> tuple[Any, list[Any], int]:
    with np.load(path) as file:
        windows, context = file["windows"], file["context"]
        return learner.scores(windows, context), json.loads(str(file["truth"])), windows.shape[2]


def _index(truth: list[Any], drives: int) -> int | None:
    hidden = [Hidden(name, tuple(axes)) for name, axes in truth] or [Hidden("clean")]
    try:
        return index_of(hidden[0], drives)
    except ValueError:
        return None


def _write(out: Path, kind: str, name: str, truth: str, search: str, answer: dict[str, Any]) -> None:
    line = {"kind": kind, "name": name, "truth": json.loads(truth), "search": search, "answer": answer}
    with out.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
