"""Scenario files: every key, one clear line for every mistake, and back from plain numbers."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from drivers.simulated import Scenario, ScenarioError, load_scenario
from drivers.simulated.scenario import OUTSIDE_VOCABULARY, tables
from robots import Robot
from tests.drivers.simulated.scenario_page import PAGE, page

TEXT = """\
# An arm with play in its third gear and a tool in its hand.
format = 1

[[backlash]]
drive = 3
width = 1e-3

[[gear_ripple]]
drive = 3
amplitude = 1e-5

[[gear_ripple]]
drive = 3
amplitude = 2e-5
order = 4.0

[payload]
mass = 1.5
centre = [0.0, 0.0, 0.1]
"""


def written(folder: Path, text: str) -> Path:
    file = folder / "hidden.toml"
    file.write_text(text)
    return file


def test_a_file_is_read(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, TEXT))
    assert scenario.backlash[0].width == 1e-3
    assert scenario.payload is not None
    assert scenario.payload.centre == (0.0, 0.0, 0.1)
    assert scenario.effects() == (
        ("backlash", (3,)),
        ("gear_ripple", (3,)),
        ("gear_ripple", (3,)),
        ("payload", ()),
    )


def test_plain_numbers_and_back(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, TEXT))
    assert Scenario.from_dict(json.loads(json.dumps(scenario.as_dict()))) == scenario
    assert Scenario.from_dict({}).empty
    assert not scenario.empty


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[[backlash]]\ndrive = 3\n",
            r":1: backlash\[1\].width: missing; allowed: a number, greater than 0$",
        ),
        (TEXT + "mas = 2\n", r":20: payload.mas: no such key; allowed: mass, centre, inertia$"),
        (
            "[[backlash]]\ndrive = 0\nwidth = 1e-3\n",
            r":2: backlash\[1\].drive: 0 is not allowed; allowed: a whole",
        ),
        ("[[backlash]]\ndrive = 1\nwidth = 'wide'\n", r':3: backlash\[1\].width: "wide" is not allowed'),
        ("backlas = 1\n", r":1: backlas: no such key; allowed: format, viscous_friction"),
        ("format = 2\n", r":1: format: 2 is not allowed; allowed: 1$"),
        ("[[backlash\n", r": not TOML: "),
        (
            "[[backlash]]\ndrive = 2\nwidth = 1e-3\n[[backlash]]\ndrive = 2\nwidth = 2e-3\n",
            r":5: backlash\[2\].drive: has backlash twice; allowed: one table for each axis$",
        ),
        (
            "[base_tilt]\nroll = 3.0\n",
            r":2: base_tilt.roll: 3.0 is not allowed; allowed: a number from -0.6 to 0.6$",
        ),
        ("[payload]\nmass = inf\n", r":2: payload.mass: inf is not allowed"),
    ],
)
def test_a_mistake_is_one_line_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    file = written(tmp_path, text)
    with pytest.raises(ScenarioError) as refusal:
        load_scenario(file)
    line = str(refusal.value)
    assert line.startswith(str(file))
    assert re.search(message, line), line
    assert "\n" not in line


def test_a_file_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nowhere.toml: cannot be read"):
        load_scenario(tmp_path / "nowhere.toml")


def test_an_axis_that_the_arm_does_not_have_is_refused(tx40: Robot) -> None:
    scenario = Scenario.from_dict({"contact": [{"joint": 2}, {"joint": 7}]})
    with pytest.raises(ScenarioError, match=r"contact\[2\]: axis 7; allowed: 1 to 6, the axes of tx40"):
        scenario.check(tx40)


def test_two_scenarios_make_one() -> None:
    one = Scenario.from_dict({"backlash": [{"drive": 1, "width": 1e-3}], "payload": {"mass": 1.0}})
    other = Scenario.from_dict({"backlash": [{"drive": 2, "width": 2e-3}]})
    both = one.merged(other)
    assert both.effects() == (("backlash", (1,)), ("backlash", (2,)), ("payload", ()))
    with pytest.raises(ScenarioError, match="payload: given twice"):
        one.merged(one.model_copy(update={"backlash": ()}))
    with pytest.raises(ScenarioError, match="has backlash twice"):
        one.merged(Scenario.from_dict({"backlash": [{"drive": 1, "width": 2e-3}]}))


def test_the_reference_page_is_that_of_today() -> None:
    """Else: ``python -m tests.drivers.simulated.scenario_page``."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text
    assert set(OUTSIDE_VOCABULARY) < set(tables())
    assert "vibration" in OUTSIDE_VOCABULARY and "backlash" not in OUTSIDE_VOCABULARY


def test_the_examples_of_the_reference_page_are_scenarios(tmp_path: Path, tx40: Robot) -> None:
    examples = re.findall(r"```toml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert examples
    for text in examples:
        tomllib.loads(text)
        scenario = load_scenario(written(tmp_path, text))
        scenario.check(tx40)
        assert not scenario.empty
