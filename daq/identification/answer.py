"""What an identification comes to in one sentence, and what is odd about it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.text.numbers import percent, significant
from daq.text.verdict_words import VerdictKind, asked_for, headline_of, kind_of
from ident import Estimate, Identification
from ident.results import WorstJoint
from robots import Robot

_POORLY_SEEN = 30.0
"""σ of a parameter in % of its value from which on the motion is said not to show it, as in the warning."""


@dataclass(frozen=True)
class Answer:
    """The sentence that an engineer reads first.

    Attributes:
        kind: of the verdict.
        sentence: how good the model is, what to use, what it lacks.
        odd: what else is to be known, one sentence each.
    """

    kind: VerdictKind
    sentence: str
    odd: tuple[str, ...]


_SENTENCES = re.compile(r"(?<=[.]) (?=[A-Z])")
"""Between two of them, each of which has a line of its own."""


def answer_of(
    result: Identification, model: Path | None = None, truth: Mapping[str, float] | None = None
) -> Answer:
    """The answer of an identification.

    Args:
        result: of the identification.
        model: the model file that was written; None where there is none.
        truth: base parameters of a simulated arm by name, SI; None for a real one.
    """
    kind = kind_of(result)
    parts = [_good_to(result, kind), *_use(kind, model), *_not_seen(result.recommended)]
    odd = [*(f"{_capital(words)}." for words in result.impossible)]
    recommended = f"{result.test.recommendation} {asked_for(result)}".strip()
    odd += [] if result.impossible else _SENTENCES.split(recommended)
    odd += [] if truth is None else [_against(result.recommended, truth)]
    odd += [f"warning: {_ended(warning)}" for warning in result.warnings]
    return Answer(kind, "; ".join(parts) + ".", tuple(odd))


def _good_to(result: Identification, kind: VerdictKind) -> str:
    estimate = result.recommended
    fitted = f"{percent(estimate.relative_error_percent)} of torque"
    if kind == "bad":
        return f"{headline_of(result)}; it leaves {fitted}"
    held = [h.relative_error_percent for h in result.held_out if h.method == estimate.method]
    other = f"{percent(max(held))} of torque on a motion that it was not fitted to" if held else fitted
    return f"Model good to {other}" if kind != "unknown" else f"Model not tested; it leaves {other}"


def _use(kind: VerdictKind, model: Path | None) -> list[str]:
    if kind == "bad":
        return ["armhil diagnose looks for what it lacks"]
    if model is None:
        return ["--out FOLDER writes it"]
    return [f"use {model}" if kind != "unknown" else f"written to {model}"]


def _not_seen(estimate: Estimate) -> list[str]:
    poor = sum(p.percent_sigma > _POORLY_SEEN for p in estimate.parameters)
    count = len(estimate.parameters)
    return [
        f"{poor} of {count} parameters not seen by this motion" if poor else f"all {count} parameters seen"
    ]


def _against(estimate: Estimate, truth: Mapping[str, float]) -> str:
    away = np.array([abs(p.value - truth[p.name]) / p.sigma for p in estimate.parameters])
    worst = int(np.argmax(away))
    return (
        f"Beside the true parameters of the simulated arm: {int(np.sum(away < 2.0))} of {away.size}"
        f" within 2 σ, furthest {estimate.parameters[worst].name} by {away[worst]:.1f} σ."
    )


_MAY_BE = {
    "position": "a spring, a counterbalance or ripple",
    "speed": "friction of another law",
    "acceleration": "inertia or delay",
    "torque": "friction under load, or a gain that falls with torque",
    "time": "drift, as with temperature",
}
"""What a residual that goes with a quantity may come from."""


def worst_words(worst: WorstJoint, joints: Sequence[str]) -> str:
    """A sentence on the joint of which most is left."""
    words = f"Worst joint: {joints[worst.joint]}, of whose torque {percent(worst.error_percent)} is left; "
    if not worst.quantity:
        return words + "that goes with no single quantity; armhil diagnose searches further."
    share = f"{100 * worst.share:.0f} % of that goes with"
    if worst.of is not None:
        return f"{words}{share} the speed of {joints[worst.of]}: drives that are coupled?"
    of = "" if worst.quantity == "time" else "its "
    return f"{words}{share} {of}{worst.quantity}: {_MAY_BE[worst.quantity]}?"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _ended(words: str) -> str:
    return words if words.endswith((".", "?", "!")) else f"{words}."


def per_joint(result: Identification, robot: Robot) -> tuple[list[str], list[list[str]]]:
    """Headings and one row per joint: what the model leaves of its torque, on its own rows and on others.

    Args:
        result: of the identification.
        robot: the arm.
    """
    estimate = result.recommended
    held = [h for h in result.held_out if h.method == estimate.method]
    headings = ["joint", "torque error", "left, rms", *(f"error on {h.recording}" for h in held)]
    rows = []
    for number, joint in enumerate(robot.joint):
        error = float(estimate.relative_error_percent_per_joint[number])
        others = (percent(float(h.relative_error_percent_per_joint[number])) for h in held)
        left = f"{significant(float(estimate.torque_rms[number]))} {joint.torque_unit}"
        rows.append([joint.name, percent(error), left, *others])
    return headings, rows
