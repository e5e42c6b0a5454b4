"""What an accepted cell, payload or catalogue means, beside a second reading and beside the original."""

from __future__ import annotations

import json
import sqlite3
import tomllib
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import robots
from daq.catalogue import arms, baselines, leases, models, overview, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.seals import SEAL
from daq.catalogue.values import ArmIdentity, Model, Run
from daq.files.payload_file import read_payload
from daq.session.admission import SPEED, as_commissioned
from daq.session.cell import Cell, cell_of
from daq.session.session_error import SessionError
from daq.session.stages import STAGES, fingerprint, status
from robots.arrays import FloatArray
from robots.payload import Payload
from tests.daq.catalogue.entries import identity, model
from trajectories.constraints.collision import FLOOR_DEPTH, CollisionCheck

TX40 = robots.load("tx40")
BODIES = len(CollisionCheck(TX40, Cell().conditions.surroundings)._geometry.geometryObjects)
"""Of the arm alone."""
TRAJECTORY = "c" * 64
SPEEDS = {1: 0.3, 2: 0.8}
"""At which arms 1 and 2 went their full runs; arm 3 has passed the slow run, arm 4 nothing."""
ARMS = tuple(identity(first=k) for k in range(4))


# cell.toml -------------------------------------------------------------------------------------------


def said_by_cell(path: Path, found: Cell) -> None:
    """Motions are kept clear of the bodies of the file, which is the original where it says the same."""
    said = tomllib.loads(path.read_text("utf-8"))
    original = path.with_name("cell.toml")
    boxes = said.get("obstacle", [])
    check = CollisionCheck(TX40, found.conditions.surroundings)
    around = {body.name: body for body in list(check._geometry.geometryObjects)[BODIES:]}
    assert len(around) == len(boxes) + ("floor" in said)
    for box in boxes:
        body = around[box["name"]]
        turn = box.get("turn", 0.0)
        rotation = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
        np.testing.assert_allclose(body.placement.rotation, rotation, atol=1e-12)
        np.testing.assert_allclose(body.placement.translation, box["centre"], rtol=0, atol=0)
        np.testing.assert_allclose(2 * np.asarray(body.geometry.halfSide), box["size"], rtol=1e-15)
    if "floor" in said:
        top = around["floor"].placement.translation[2] + FLOOR_DEPTH / 2
        np.testing.assert_allclose(top, said["floor"], atol=1e-12)
    assert check.surroundings.clearance == said.get("clearance", 0.01)
    assert check.surroundings.itself, "no file takes the arm itself away"
    tool, conditions = said.get("tool", {}), found.conditions
    assert conditions.tool_speed == tool.get("speed")
    assert (conditions.tool.frame, list(conditions.tool.offset)) == (
        tool.get("frame"),
        tool.get("offset", [0.0, 0.0, 0.0]),
    )
    same = _cell_means(said) == _cell_means(tomllib.loads(original.read_text("utf-8")))
    assert (found.sha256 == cell_of(original).sha256) == same, "what was passed counts for one cell"


def _cell_means(said: dict[str, Any]) -> object:
    """What is said, with what is meant where nothing is."""
    tool = {"frame": None, "offset": [0, 0, 0], "speed": None} | said.get("tool", {})
    boxes = [{"turn": 0.0} | box for box in said.get("obstacle", [])]
    return said.get("floor"), said.get("clearance", 0.01), tool, boxes


# payload.toml ----------------------------------------------------------------------------------------


def read_body(path: Path) -> tuple[Payload, FloatArray]:
    """As an identification reads it: the file, then what it adds to the links of an arm."""
    found = read_payload(path)
    return found, found.parameters(TX40)


def said_by_payload(path: Path, found: tuple[Payload, FloatArray]) -> None:
    """Mass, first moments and inertia about the frame's origin, by the parallel axes; a body that can be."""
    said, (payload, added) = tomllib.loads(path.read_text("utf-8")), found
    mass, centre = said["mass"], np.array(said["center"], dtype=float)
    xx, xy, yy, xz, yz, zz = said["inertia"]
    about_centre = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)
    moments = np.linalg.eigvalsh(about_centre)
    slack = 1e-9 * max(1.0, float(np.abs(moments).max()))
    assert mass > 0 and moments[0] >= -slack and moments[2] <= moments[0] + moments[1] + slack
    assert payload.relative_uncertainty == said.get("relative_uncertainty", 0.0)
    assert payload.frame == said.get("frame", "")
    if "frame" in said:
        return  # where that link is, is not said here
    about_origin = about_centre + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    wanted = [mass, *(mass * centre), *about_origin[np.tril_indices(3)]]
    np.testing.assert_allclose(added[-10:], wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    assert not added[:-10].any()


# Catalogues ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Meaning:
    """What the commands take from a catalogue.

    Attributes:
        speeds: share of the speed limits at which each arm may be driven.
        stages: that each arm has passed.
        runs, models: as they are told.
    """

    speeds: tuple[float, ...]
    stages: tuple[tuple[str, ...], ...]
    runs: tuple[Run, ...]
    models: tuple[Model, ...]


def fill_catalogue(path: Path) -> None:
    """Four arms with models, baselines and leases; two are commissioned, and one halfway."""
    with Catalogue(f"sqlite:///{path}") as catalogue:
        for k, arm in enumerate(ARMS):
            run = runs.begin(catalogue, arm, "run", facts={"channel": "can0"})
            runs.finish(catalogue, run.id, "completed")
            models.add(catalogue, run.id, model(k))
            baselines.accept(catalogue, k + 1, "somebody", "it was new")
            leases.take(catalogue, run.arm_id, 600.0, holder="somebody")
        for number, speed in (*SPEEDS.items(), (3, 0.9)):
            for stage in STAGES[: STAGES.index("full run") + (number in SPEEDS)]:
                facts = {**fingerprint(ARMS[number - 1], TRAJECTORY), SPEED: f"{speed:g}"}
                run = runs.begin(catalogue, ARMS[number - 1], "commission", stage=stage, facts=facts)
                runs.finish(catalogue, run.id, "completed")


def read_catalogue(path: Path) -> Meaning:
    """As the commands read it, and one more run kept in it."""
    with Catalogue(f"sqlite:///{path}") as catalogue:
        arms.every(catalogue)
        overview.every(catalogue)
        for number in range(1, 5):
            baselines.of_arm(catalogue, number)
            leases.holder_of(catalogue, number)
        found = Meaning(
            tuple(_speed(catalogue, arm) for arm in ARMS),
            tuple(_passed(catalogue, arm) for arm in ARMS),
            runs.every(catalogue),
            tuple(models.get(catalogue, number) for number in range(1, 5)),
        )
        runs.finish(catalogue, runs.begin(catalogue, identity(first=77), "run").id, "completed")
    return found


def _speed(catalogue: Catalogue, arm: ArmIdentity) -> float:
    try:
        return as_commissioned(catalogue, arm, None, "armhil commission").speed
    except SessionError:
        return 0.0


def _passed(catalogue: Catalogue, arm: ArmIdentity) -> tuple[str, ...]:
    try:
        return tuple(one.name for one in status(catalogue, arm, TRAJECTORY) if one.state == "passed")
    except SessionError:
        return ()


def said_by_catalogue(path: Path, found: Meaning) -> None:
    """No arm may do more than it had passed; runs and parameters are those of the tables."""
    for number, (speed, stages) in enumerate(zip(found.speeds, found.stages, strict=True), start=1):
        assert speed in (0.0, SPEEDS.get(number, 0.0)), (number, speed)
        passed = STAGES[: STAGES.index("full run") + (number in SPEEDS)] if number < 4 else ()
        assert stages == passed[: len(stages)], (number, stages)
    with closing(sqlite3.connect(path)) as connection:
        for run in found.runs:
            wanted = "SELECT kind, stage, state, outcome, reason, note, capture FROM runs WHERE id = ?"
            row = connection.execute(wanted, (run.id,)).fetchone()
            assert row == (run.kind, run.stage, run.state, run.outcome, run.reason, run.note, run.capture)
            (facts,) = connection.execute("SELECT facts FROM runs WHERE id = ?", (run.id,)).fetchone()
            others = {key: value for key, value in json.loads(facts).items() if key != SEAL}
            assert repr(run.facts) == repr(others)
        for one in found.models:
            wanted = "SELECT name, value, sigma, unit FROM parameters WHERE model_id = ? ORDER BY place"
            rows = connection.execute(wanted, (one.id,)).fetchall()
            assert repr([(p.name, p.value, p.sigma, p.unit) for p in one.parameters]) == repr(rows)
