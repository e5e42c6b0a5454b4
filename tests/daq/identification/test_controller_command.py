"""``armhil controller``: the published law of EMPS on the command line; and what it refuses."""

from __future__ import annotations

import json
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from robots import Controller, Robot
from tests.daq.calls import Call
from tests.daq.payload_captures import GAIN_ERROR, write_payload_captures


@pytest.fixture
def controller(armhil: Call) -> Call:
    """Calls ``armhil controller``."""
    return partial(armhil, "controller")


def test_the_published_law_of_emps(controller: Call, shared_data: Path) -> None:
    log = shared_data / "emps" / "DATA_EMPS.mat"
    code, out, err = controller(log, "--robot", "emps", "--json")
    assert code == 0
    content = json.loads(out)
    assert content["trusted"] is True and content["reason"] is None
    (drive,) = content["drives"]
    gains = {gain["key"]: gain["value"] for gain in drive["gains"]}
    assert gains["velocity_gain"] == pytest.approx(243.45, rel=1e-3)
    assert drive["explained"] > 0.999
    assert content["controller"]["position_gain"][0] == pytest.approx(160.18, rel=1e-3)
    assert content["captures"] == [str(log)]
    assert "P position, P velocity" in " ".join(err.split())


def test_what_it_prints_goes_into_robot_toml(controller: Call, emps: Robot, tmp_path: Path) -> None:
    unloaded, _, _ = write_payload_captures(emps, tmp_path)
    code, out, _ = controller(unloaded)
    assert code == 0, out
    printed = tomllib.loads(out[out.index("[controller]") :])["controller"]
    described = emps.controller
    # The control signal was written down smaller by the error of the gain; the position loop is the same.
    gain = described.velocity_gain[0] / (1 + GAIN_ERROR)
    assert printed["velocity_gain"][0] == pytest.approx(gain, rel=0.01)
    assert printed["position_gain"][0] == pytest.approx(described.position_gain[0], rel=0.01)
    tuples = {key: tuple(v) if isinstance(v, list) else v for key, v in printed.items()}
    assert Controller.model_validate(described.model_dump() | tuples).type == printed["type"]


def test_a_signal_that_no_law_makes_is_a_warning(controller: Call, emps: Robot, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    t = np.arange(0.0, 2.0, 0.001)
    move = 0.05 * np.sin(2 * np.pi * 0.7 * t)
    noise = np.random.default_rng(3).normal(size=t.size)
    table = np.column_stack([t, move, move + 1e-5 * noise, noise])
    np.savetxt(log, table, delimiter=",", header="t,r,q,v", comments="")
    columns = tmp_path / "map.toml"
    columns.write_text(
        'format = 1\n[time]\ncolumn = "t"\n[reference]\ncolumns = ["r"]\nunit = "m"\n'
        '[position]\ncolumns = ["q"]\nunit = "m"\n[control_signal]\ncolumns = ["v"]\n',
        encoding="utf-8",
    )
    code, out, _ = controller(log, "--robot", "emps", "--columns", columns)
    assert code == 1
    assert "DO NOT SIMULATE WITH IT" in out and "of the control signal of drive 1" in " ".join(out.split())


def test_a_log_without_references_is_refused(controller: Call, shared_data: Path) -> None:
    code, _, err = controller(shared_data / "tx40", "--robot", "tx40")
    assert code == 2
    assert "no position reference was recorded" in err.splitlines()[-1]
