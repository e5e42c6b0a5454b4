"""What a line of the naming campaign's results comes to: right name, right place, gap closed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

CLOSED = 0.2
"""Share of the gap that may be left."""


def right_first(line: dict[str, Any]) -> bool:
    """The first finding has the right name and place."""
    findings = line["findings"]
    return bool(findings) and _same(line, findings[0]["effect"], findings[0]["joints"])


def named_right(line: dict[str, Any]) -> bool:
    """A finding that is named (confirmed, and nothing else could be it) is what is hidden."""
    return any(_same(line, one["effect"], one["joints"]) for one in _named(line))


def named_wrong(line: dict[str, Any]) -> bool:
    """A finding that is named is not what is hidden, or not there."""
    hidden = zip(line["effect"].split("+"), line["axes"], strict=True) if "+" in line["effect"] else ()
    alone = [line | {"effect": effect, "axes": axes} for effect, axes in hidden] or [line]
    return any(not any(_same(a, one["effect"], one["joints"]) for a in alone) for one in _named(line))


def _named(line: dict[str, Any]) -> list[dict[str, Any]]:
    return [one for one in line["findings"] if one["named"]]


def in_set(line: dict[str, Any]) -> bool:
    """The truth is the first finding or among what cannot be told from it."""
    if right_first(line):
        return True
    return any(
        _same(line, effects[0], joints[0])
        for finding in line["findings"][:1]
        for effects, joints in finding["set"]
        if len(effects) == 1
    )


def _same(line: dict[str, Any], effect: str, joints: Sequence[int]) -> bool:
    if effect != line["effect"]:
        return False
    return not line["axes"] or not joints or sorted(joints) == sorted(line["axes"])


def of_several(line: dict[str, Any]) -> set[int]:
    """Which of several hidden effects, from 0, are among the findings, with their place."""
    found = set()
    for index, (effect, axes) in enumerate(zip(line["effect"].split("+"), line["axes"], strict=True)):
        alone = line | {"effect": effect, "axes": axes}
        if any(_same(alone, finding["effect"], finding["joints"]) for finding in line["findings"]):
            found.add(index)
    return found


def all_found(line: dict[str, Any]) -> bool:
    """All of several hidden effects are findings."""
    return len(of_several(line)) == len(line["axes"])


def both_in_set(line: dict[str, Any]) -> bool:
    """Both hidden effects are findings, or the two are a pair that the data cannot tell from them."""
    wanted = list(zip(line["effect"].split("+"), map(sorted, line["axes"]), strict=True))
    sets = [pair for finding in line["findings"] for pair in finding["set"]]
    found = [(finding["effect"], sorted(finding["joints"])) for finding in line["findings"]]
    others = [list(zip(effects, map(sorted, joints), strict=True)) for effects, joints in sets]
    reported = [*found, *(one for alone in others if len(alone) == 1 for one in alone)]

    def among(candidates: Sequence[tuple[str, list[int]]]) -> bool:
        return all(
            any(name == effect and (not axes or not place or place == axes) for name, place in candidates)
            for effect, axes in wanted
        )

    return among(reported) or any(among(pair) for pair in others)


def spurious(line: dict[str, Any]) -> bool:
    """More findings than hidden effects among them."""
    return len(line["findings"]) > len(of_several(line))


def closed(line: dict[str, Any]) -> bool:
    return left(line) <= CLOSED


def left(line: dict[str, Any]) -> float:
    """Share of the explainable gap that is left: joints one by one, each in its own floors."""
    floor = np.array(line["floor"])
    before, after = (float(np.linalg.norm(np.array(gap) / floor)) for gap in line["explainable"])
    return after / before if before > 0.0 else np.inf


def closed_together(line: dict[str, Any]) -> bool:
    """The same with the floor taken off the whole arm's energy, so that chance does not add up over joints.

    Noise alone makes the level of a joint now larger than its floor and now smaller. Where each joint is cut
    off at zero only the larger ones count; in the sum they cancel.
    """
    floor = np.array(line["floor"])
    before, after = (float(np.sum((np.array(level) / floor) ** 2 - 1.0)) for level in line["level"])
    return max(after, 0.0) <= CLOSED**2 * before


def largest_in_floors(line: dict[str, Any]) -> float:
    """Explainable gap before anything was found, of the joint that shows most, in its floors."""
    return float(np.max(np.array(line["explainable"][0]) / np.array(line["floor"])))


def gap_in_floors(line: dict[str, Any]) -> float:
    """Explainable gap before anything was found, joints one by one, each in its own floors."""
    return float(np.linalg.norm(np.array(line["explainable"][0]) / np.array(line["floor"])))


def called(line: dict[str, Any]) -> str:
    if not line["findings"]:
        return str(line["verdict"])
    first = line["findings"][0]
    return str(first["effect"]) + ("" if first["effect"] != line["effect"] else " at another joint")
