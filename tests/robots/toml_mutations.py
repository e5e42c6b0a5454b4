"""Slips of the pen in a robot.toml, made at random with a seed, and the windows that such a file asks for.

As in ``mutations``: a slip must be refused or change nothing, an edit must have the windows that the file
says, and every window stays below an absolute cap. What the file says is read with ``tomllib`` alone.
"""

from __future__ import annotations

import random
import re
import tomllib
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np

from tests.robots.mutations import Mutation

BAD_VALUES = (
    "0,028", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e400", "AAAA", "", '"1.0"', "true", "1_",
    "[1.0]", "{ a = 1 }", "1e-308", "0x", "99999999999999999999", "1979-05-27",
)  # fmt: skip
FACTORS = (10.0, 0.1, 57.0, 1 / 57.0, 1000.0, 0.001, -1.0, 1e6, 1e-6, 1.02)
CAPS = {"following error": 0.6, "torque": 1e5, "position": 100.0, "velocity": 50.0, "acceleration": 2000.0}
"""No window of a description that is accepted is larger, rad (m), N·m (N), rad/s (m/s) …"""

_NUMBER = re.compile(r"(?<![\w.\"])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.\"])")


def mutated_toml(text: str, seed: int) -> Mutation:
    """One to two mutations of a robot.toml."""
    generator = random.Random(f"toml {seed}")
    lines = [line for line in text.split("\n") if not line.startswith("#")]
    kind, words = "edit", []
    for _ in range(generator.choice((1, 1, 1, 2))):
        made, what = generator.choice(_CHANGES)(lines, generator)
        kind = "slip" if made == "slip" else kind
        words.append(what)
    return Mutation("\n".join(lines), kind, "; ".join(words))


Lines = list[str]


def _numbered(lines: Lines, generator: random.Random) -> tuple[int, re.Match[str]]:
    rows = [k for k, line in enumerate(lines) if _NUMBER.search(line) and not line.startswith("[[")]
    k = generator.choice(rows)
    return k, generator.choice(list(_NUMBER.finditer(lines[k])))


def _bad_value(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k, found = _numbered(lines, generator)
    bad = generator.choice(BAD_VALUES)
    before = lines[k]
    lines[k] = before[: found.start()] + bad + before[found.end() :]
    # Next to nothing is as good as 0 where 0 may stand; where it may not, the windows would show it.
    return "edit" if bad in ("1e-308", "1e-320") else "slip", f"{before.strip()} -> {lines[k].strip()}"


def _scaled(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k, found = _numbered(lines, generator)
    factor = generator.choice(FACTORS)
    value = float(found[0]) * factor
    whole = "." not in found[0] and value == int(value)
    before = lines[k]
    lines[k] = before[: found.start()] + (str(int(value)) if whole else repr(value)) + before[found.end() :]
    return "edit", f"{before.strip()} -> {lines[k].strip()}"


def _keys(lines: Lines) -> list[int]:
    return [k for k, line in enumerate(lines) if re.match(r"[a-z_]+ = ", line)]


def _misspelt_key(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k = generator.choice(_keys(lines))
    key, rest = lines[k].split(" = ", 1)
    at = generator.randrange(len(key))
    lines[k] = f"{generator.choice((key[:at] + key[at + 1 :], key + 's', key.upper()))} = {rest}"
    return "slip", f"{key} is written {lines[k].split(' = ')[0]!r}"


def _lost_line(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k = generator.choice([k for k, line in enumerate(lines) if line.strip()])
    return "edit", f"{lines.pop(k).strip()!r} is lost"


def _doubled_line(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k = generator.choice([k for k, line in enumerate(lines) if line.strip()])
    lines.insert(k, lines[k])
    return "edit", f"{lines[k].strip()!r} is there twice"


def _swapped_lines(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k, other = generator.sample(_keys(lines), 2)
    lines[k], lines[other] = lines[other], lines[k]
    return "edit", f"{lines[k].strip()!r} and {lines[other].strip()!r} are swapped"


def _list_entry(lines: Lines, generator: random.Random) -> tuple[str, str]:
    rows = [k for k, line in enumerate(lines) if re.search(r"\[[^\[\]]*,[^\[\]]*\]", line)]
    k = generator.choice(rows)
    before = lines[k]
    found = re.search(r"\[([^\[\]]*)\]", before)
    assert found is not None
    entries = found[1].split(", ")
    if generator.random() < 0.5:
        entries.pop(generator.randrange(len(entries)))
    else:
        entries.insert(generator.randrange(len(entries)), generator.choice(("0.0", "1.0", '"a"')))
    lines[k] = before[: found.start(1)] + ", ".join(entries) + before[found.end(1) :]
    return "slip", f"{before.strip()} -> {lines[k].strip()}"


def _header(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k = generator.choice([k for k, line in enumerate(lines) if line.startswith("[")])
    before = lines[k]
    lines[k] = generator.choice(
        (before.replace("[[", "[").replace("]]", "]"), before[:-1], "[buss]", "[[joint]]")
    )
    return "edit", f"{before} -> {lines[k]}"


def _raw(lines: Lines, generator: random.Random) -> tuple[str, str]:
    k = generator.choice([k for k, line in enumerate(lines) if line.strip()])
    before = lines[k]
    at = generator.randrange(len(before))
    new = generator.choice(("", before[at] * 2, generator.choice("[]{}=.,'\"#-e0 \0\\")))
    lines[k] = before[:at] + new + before[at + 1 :]
    return "edit", f"{before.strip()!r} -> {lines[k].strip()!r}"


_CHANGES: tuple[Callable[[Lines, random.Random], tuple[str, str]], ...] = (
    _bad_value, _bad_value, _scaled, _scaled, _misspelt_key, _lost_line, _doubled_line, _swapped_lines,
    _list_entry, _header, _raw, _raw,
)  # fmt: skip


def windows_said(text: str) -> dict[str, list[float]]:
    """The windows that a robot.toml which has been accepted asks for, in the terms of ``windows_of``."""
    data: dict[str, Any] = tomllib.loads(text)
    joints, drives, loop = data["joint"], data["drive"], data["controller"]
    coupling = np.array(data["transmission"], dtype=float)
    speeds = np.abs(coupling) @ np.array([joint["velocity"] for joint in joints], dtype=float)
    cycle = data.get("bus", {}).get("cycle_time", 0.004)
    window = []
    for k, joint in enumerate(joints):
        lag = speeds[k] * max(0.0, 1.0 - loop["velocity_feed_forward"][k])
        most, k_p, k_v = loop["saturation"][k], loop["position_gain"][k], loop["velocity_gain"][k]
        error = (most / k_v + lag) / k_p if loop["type"] == "cascade_p_pi" else (most + k_v * lag) / k_p
        cap = 0.6 if joint.get("kind", "revolute") == "revolute" else 0.1
        window.append(min(cap, error + 3 * cycle * speeds[k]))
    per_count = np.array([drive["gain"] * drive["control_signal"]["per_count"] for drive in drives])
    turns = [2 * pi if joint.get("kind", "revolute") == "revolute" else 1.0 for joint in joints]
    counts = [
        drive["encoder_counts"] * drive["gear"] / turn for drive, turn in zip(drives, turns, strict=True)
    ]
    return {
        "following error": window,
        "torque": [joint["torque"] for joint in joints],
        "torque per count": (coupling.T * per_count).ravel().tolist(),
        "position": [joint["position"][k] for k in (0, 1) for joint in joints],
        "velocity": [joint["velocity"] for joint in joints],
        "acceleration": [joint["acceleration"] for joint in joints],
        "counts": counts,
    }
