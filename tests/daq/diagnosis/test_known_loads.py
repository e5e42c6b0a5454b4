"""Recordings of one arm with different known bodies on it, diagnosed together."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.daq.calls import Call

MASS, VISCOUS, DRY, OFFSET, GAIN = 95.0, 200.0, 20.0, -3.0, 35.15065188248547
SLANT = -40.0
"""N·s/m; half the difference of viscous friction forwards and backwards: what the usual model lacks."""
BODIES = (30.0, 60.0, 0.0)
"""kg, on the axis in the three logs."""
PERIOD = 0.002
MAP = """format = 1

[time]
column = "t"
unit = "s"

[position]
columns = ["q"]
unit = "m"

[control_signal]
columns = ["u"]
"""


@dataclass(frozen=True)
class Logs:
    """Three logs, their column map, and ``--payload`` for those with a body."""

    paths: tuple[Path, ...]
    columns: Path
    carried: tuple[str, ...]


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    folder = tmp_path_factory.mktemp("loads")
    columns = folder / "map.toml"
    columns.write_text(MAP, "utf-8")
    paths, carried = [], []
    for number, body in enumerate(BODIES):
        paths.append(folder / f"log{number}.csv")
        _write(paths[-1], MASS + body, number)
        if body:
            payload = folder / f"body{number}.toml"
            payload.write_text(f"format = 1\nmass = {body}\n", "utf-8")
            carried += ["--payload", f"{paths[-1]}={payload}"]
    return Logs(tuple(paths), columns, tuple(carried))


def _write(path: Path, mass: float, seed: int) -> None:
    """Eight seconds of the axis; the voltage is what its motion needs, with noise of 1 N."""
    lot = np.random.default_rng(seed)
    t = np.arange(0.0, 8.0, PERIOD)
    q, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for tone, size in ((0.31, 0.08), (0.83, 0.03), (1.9, 0.008)):
        w, phase = 2 * np.pi * tone, lot.uniform(0, 6)
        q += size * np.sin(w * t + phase)
        v += size * w * np.cos(w * t + phase)
        a -= size * w**2 * np.sin(w * t + phase)
    force = mass * a + VISCOUS * v + SLANT * np.abs(v) + DRY * np.sign(v) + OFFSET
    signal = (force + lot.standard_normal(t.size)) / GAIN
    table = np.column_stack([t, q + 1e-7 * lot.standard_normal(t.size), signal])
    np.savetxt(path, table, delimiter=",", header="t,q,u", comments="", fmt="%.10g")


def diagnosed(armhil: Call, logs: Logs, *more: str) -> dict[str, object]:
    first, second, held = logs.paths
    code, out, err = armhil(
        *("diagnose", first, second, "--validate", held, "--robot", "emps", "--columns", logs.columns),
        *("--evaluations", "0", "--json", *more),
    )
    assert code in (0, 1, 3), err
    content: dict[str, object] = json.loads(out)
    return content


def effects(content: dict[str, object]) -> set[str]:
    findings = content["findings"]
    assert isinstance(findings, list)
    return {one["effect"] for one in findings}


def left(content: dict[str, object]) -> float:
    gap = content["gap"]
    assert isinstance(gap, dict)
    return float(gap["torque"]["after"][0])


def test_two_known_bodies_hide_nothing_and_make_nothing_up(armhil: Call, logs: Logs) -> None:
    told = diagnosed(armhil, logs, *logs.carried)
    assert effects(told) == {"asymmetric_friction"}
    findings = told["findings"]
    assert isinstance(findings, list)
    (slant,) = (p for p in findings[0]["parameters"] if p["name"] == "dFv1")
    assert slant["value"] == pytest.approx(SLANT, abs=4 * slant["sigma"])
    assert left(told) < 1.2, "N; the noise is 1 N before the low-pass"
    # Without a word on the bodies one mass has to do for 95, 125 and 155 kg.
    untold = diagnosed(armhil, logs)
    assert left(untold) > 5 * left(told)
