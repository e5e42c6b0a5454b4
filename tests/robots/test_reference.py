"""docs/reference/robot-toml.md holds every key, and nothing that is not one."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

import robots
from robots import description
from robots.allowed import keys_of

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "robot-toml.md"
SECTIONS: dict[str, type[BaseModel]] = {
    "## Top level": robots.Robot,
    "## [[joint]]": robots.Joint,
    "## [[drive]]": robots.Drive,
    "### control_signal": robots.ControlSignal,
    "### dynamics": robots.DriveDynamics,
    "### identity": description.Identity,
    "### homing": description.HomingSearch,
    "### brake": description.Brake,
    "### velocity": description.VelocityObject,
    "### temperature": description.TemperatureObject,
    "## [controller]": robots.Controller,
    "## [bus]": robots.Bus,
    "## [identification]": robots.Identification,
}


def rows_of(heading: str) -> dict[str, list[str]]:
    """The table below a heading: key → the other cells."""
    text = PAGE.read_text("utf-8")
    section = re.split(r"\n#", text[text.index(f"\n{heading}\n") + len(heading) + 1 :])[0]
    cells = [
        [cell.strip() for cell in row.strip("|").split("|")]
        for row in section.split("\n")
        if row[:3] == "| `"
    ]
    return {row[0].strip("`"): row[1:] for row in cells}


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_key_has_its_row_with_its_default(heading: str) -> None:
    model = SECTIONS[heading]
    rows = rows_of(heading)
    assert list(rows) == list(keys_of(model))
    for key, (_type, _allowed, default, meaning) in rows.items():
        value = model.model_fields[key].default
        assert meaning
        if value == () or model.model_fields[key].default_factory is not None:
            assert default.startswith("absent"), key
        elif value is PydanticUndefined:
            assert default == "required", key
        elif value is None:
            assert default.startswith("absent"), key
        elif isinstance(value, BaseModel):
            assert default == "its defaults", key
        else:
            assert same(default.strip("`"), value), (key, default, value)


def same(written: str, value: object) -> bool:
    if isinstance(value, bool):
        return written == str(value).lower()
    if isinstance(value, tuple):
        return tuple(float(number) for number in written.strip("[]").split(",")) == value
    if isinstance(value, str):
        return written == f'"{value}"'
    return int(written, 0) == value if isinstance(value, int) else float(written) == value


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_choice_is_written(heading: str) -> None:
    for key, field in SECTIONS[heading].model_fields.items():
        for choice in getattr(field.annotation, "__args__", ()):
            if isinstance(choice, str | int):
                assert str(choice) in rows_of(heading)[key][1], (key, choice)


def test_the_example_loads(tmp_path: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert example is not None
    (tmp_path / "robot.toml").write_text(example[1], "utf-8")
    shutil.copy(robots.load("emps").urdf_path, tmp_path / "slide.urdf")
    assert robots.load(tmp_path).name == "slide"


def test_the_message_on_the_page_is_the_real_one(tmp_path: Path) -> None:
    shown = re.search(r"drive\[2\]\.node_id: .*", PAGE.read_text("utf-8"))
    assert shown is not None
    text = robots.load("tx40").source_text.replace("node_id = 2", "node_id = 200")
    with pytest.raises(robots.RobotFileError) as caught:
        robots.robot_from_text(text, tmp_path / "robot.toml")
    assert str(caught.value).endswith(shown[0])
