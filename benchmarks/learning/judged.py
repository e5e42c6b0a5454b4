"""Logs that learners and search are judged on: fresh ones of the own bench, and foreign plants'."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import robots
from benchmarks import naming
from benchmarks.evidence.case import UNKNOWN, Case
from benchmarks.evidence.drawn import draw_of, drawn
from benchmarks.evidence.recorded import recorded
from benchmarks.learning.rows import Accepted
from benchmarks.naming_report import NAMES
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.scenario import OUTSIDE_VOCABULARY, Scenario
from robots.arrays import FloatArray

LEAST, MOST = 0.5, 5.0
"""Noise floors of an effect."""
FIRST = {"dev": 7_100_000, "own": 7_200_000, "looked": 1_060_000}
"""First seed of the logs that set the learners' sharpness, that are judged, that the search's makers have."""


def own(seed: int, folder: Path) -> Case:
    """A log of the own bench as the naming campaign records it; every fifth is clean, every eighth outside.

    Args:
        seed: of arm, effect, place, size and noise.
        folder: keeps the two motions.
    """
    rng, kind = np.random.default_rng([seed, 0x1D6E]), kind_of(seed % 1000)
    coloured = kind == "clean" and rng.random() < 1 / 3
    effects: tuple[str, ...] = ("coloured" if coloured else "white",)
    if kind != "clean":
        effects = (str(rng.choice(NAMES if kind == "single" else OUTSIDE_VOCABULARY)),)
    size = float(np.exp(rng.uniform(np.log(LEAST), np.log(MOST)))) if kind != "clean" else 0.0
    return _recorded(kind, effects, seed, size, folder, apart=1000)


def looked_at(seed: int, folder: Path) -> Case:
    """A log of the own bench that the search's makers looked at, one in five with two effects."""
    rng = np.random.default_rng([seed, 77])
    kind = str(rng.choice(("single", "pair", "clean", "outside"), p=(0.6, 0.2, 0.1, 0.1)))
    size = float(np.exp(rng.uniform(np.log(LEAST), np.log(MOST))))
    if kind == "pair":
        effects = tuple(str(one) for one in np.random.default_rng(seed).choice(NAMES, 2, replace=False))
    else:
        every = {"single": NAMES, "outside": OUTSIDE_VOCABULARY, "clean": ("white",)}[kind]
        effects = (str(rng.choice(every)),)
    return _recorded(kind, effects, seed, size, folder, apart=1)


def _recorded(kind: str, effects: tuple[str, ...], seed: int, size: float, folder: Path, apart: int) -> Case:
    """Accepted run, fit and validation of an arm; their noise's seeds are so far apart."""
    robot, (first, second) = robots.load(naming.ARM), _motions(folder)
    arm, hidden = draw_truth(robot, seed), Scenario()
    truth: list[tuple[str, tuple[int, ...]]] = []
    if effects == ("coloured",):
        hidden = Scenario.from_dict({"format": 1, "noise": {"time_constant": 0.02}})
    for effect in effects if kind != "clean" else ():
        found = draw_scenario(robot, effect, seed, size, truth=arm, reference=first)
        hidden = hidden.merged(found.scenario)
        truth.append((UNKNOWN if kind == "outside" else effect, tuple(found.axes)))
    quiet = hidden if kind == "clean" else Scenario()
    accepted, fit, held = (
        naming.record(robot, arm, one, path, seed + apart * part)
        for part, (one, path) in enumerate(((quiet, first), (hidden, first), (hidden, second)), start=1)
    )
    return Case(f"own {seed}", "own", robot, fit, held, tuple(truth), accepted)


def kind_of(number: int) -> str:
    """Clean, single or outside, mixed evenly."""
    if number % 5 == 4:
        return "clean"
    return "outside" if number % 8 == 6 else "single"


def foreign(seed: int, folder: Path) -> Case | None:
    """A drawn log of a foreign plant; None where the search is after a refit, which no learner was taught."""
    return None if draw_of(seed).refit else drawn(seed, folder)


def shared(data: Path, folder: Path) -> list[Case]:
    """The eleven recorded logs of a foreign plant."""
    return [case() for name, case in recorded(data, folder).items() if name.startswith("log_")]


def windows_of(case: Case) -> tuple[FloatArray, FloatArray]:
    """Windows of both recordings, W × rows × n × channels, and the context, n × figures."""
    assert case.accepted is not None
    accepted = Accepted.on(case.robot, case.accepted)
    both = [accepted.windows(one) for one in (case.fit, case.validation)]
    return np.concatenate(both), accepted.context


def _motions(folder: Path) -> tuple[FloatArray, FloatArray]:
    path = folder / "motions.npz"
    if not path.exists():
        np.savez(path, first=naming.motion(0), second=naming.motion(1))
    with np.load(path) as file:
        return file["first"], file["second"]
