"""The page for masters of others keeps its word: its master drives our drives, its faults exist."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers import Channel, open_bus
from drivers.simulated import Faults

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "own-master.md"
MASTER, FAULTS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
BUS = 'can.Bus(interface="socketcan", channel="vcan0")'


def test_its_master_moves_a_drive(
    serve_drives: Callable[..., Channel], capsys: pytest.CaptureFixture[str]
) -> None:
    channel = serve_drives()
    assert BUS in MASTER
    names: dict[str, Any] = {"open_bus": open_bus, "channel": channel}
    exec(compile(MASTER.replace(BUS, "open_bus(channel)"), PAGE.name, "exec"), names)
    told = re.fullmatch(r"node 1 moved by (\d+) counts\n", capsys.readouterr().out)
    assert told is not None and int(told[1]) == pytest.approx(20 * 199, abs=400)


def test_its_faults_are_faults() -> None:
    names: dict[str, Any] = {}
    head = FAULTS.split("with SimulatedArm", 1)[0]
    exec(compile(head, PAGE.name, "exec"), names)
    assert Faults.from_dict(names["faults"].as_dict()) == names["faults"]


def test_its_device_file_is_there() -> None:
    (link,) = re.findall(r"\]\((\.\./\.\./drivers[^)]*)\)", PAGE.read_text(encoding="utf-8"))
    assert (PAGE.parent / link).resolve().is_file()


def test_its_tests_are_there() -> None:
    """The table of clauses names the test of each."""
    table = PAGE.read_text(encoding="utf-8").partition("## What the simulated drives answer")[2]
    named = set(re.findall(r"`(test_\w+)`", table))
    sources = (file.read_text(encoding="utf-8") for file in Path(__file__).parents[1].rglob("test_*.py"))
    there = {name for text in sources for name in re.findall(r"^def (test_\w+)\(", text, re.MULTILINE)}
    assert len(named) > 30 and named <= there, named - there
