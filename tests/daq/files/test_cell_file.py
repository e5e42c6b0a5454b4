"""Cell files: what they say to the planner, and that the reference page has every key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from daq.files.cell_file import CellFile, CellFileError, CellObstacle, CellTool, read_cell
from trajectories import Obstacle, Surroundings, Tool

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "cell-toml.md"


def test_the_example_of_the_page_is_read_as_it_says(tmp_path: Path) -> None:
    example = re.search(r"^```toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert example is not None
    path = tmp_path / "cell.toml"
    path.write_text(example[1], encoding="utf-8")
    cell = read_cell(path)
    cabinet = Obstacle("control cabinet", (0.0, 0.9, 0.3), (0.6, 0.4, 1.2), 0.2)
    assert cell.surroundings == Surroundings(-0.32, (cabinet,), clearance=0.02)
    assert cell.watched_tool == Tool("link_6", (0.0, 0.0, 0.12)) and cell.tool.speed == 0.5


def test_an_empty_cell_watches_the_arm_alone(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text("format = 1\n")
    cell = read_cell(path)
    assert cell.surroundings == Surroundings() and cell.surroundings.itself
    assert cell.watched_tool == Tool() and cell.tool.speed is None


@pytest.mark.parametrize(
    ("model", "heading"),
    [(CellFile, "# cell.toml"), (CellTool, "## [tool]"), (CellObstacle, "## [[obstacle]]")],
)
def test_the_page_has_every_key_and_its_default(model: type[BaseModel], heading: str) -> None:
    text = PAGE.read_text(encoding="utf-8").split(heading + "\n", 1)[1].split("\n## ", 1)[0]
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*) \|", text, re.MULTILINE))
    assert set(rows) == set(model.model_fields)
    for name, field in model.model_fields.items():
        assert (rows[name].strip() == "–") == field.is_required(), name
        if isinstance(field.default, float):
            assert rows[name].strip() == f"`{field.default:g}`", name


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("floor = 0\n", r"cell\.toml:1: format: missing; allowed: 1"),
        ("format = 1\nclearance = 0\n", r"cell\.toml:2: clearance: 0 is not allowed; allowed: a number"),
        ("format = 1\nfloor = nan\n", r"cell\.toml:2: floor: "),
        ("format = 1\n[tool]\noffset = [0, 0]\n", r"cell\.toml:3: tool\.offset"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, text: str, line: str) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(text)
    with pytest.raises(CellFileError, match=line) as refused:
        read_cell(path)
    assert "\n" not in str(refused.value)


def test_the_checksum_is_of_what_is_said(tmp_path: Path) -> None:
    """What was passed in commissioning counts for one cell: the same, however its zeros are written."""
    path = tmp_path / "cell.toml"

    def checksum(offset: str, floor: str) -> str:
        path.write_text(f"format = 1\nfloor = {floor}\n[tool]\noffset = {offset}\n", encoding="utf-8")
        return read_cell(path).sha256

    same = checksum("[0.0, 0.0, 0.1]", "0.0")
    assert checksum("[0.0, -0.0, 0.1]", "-0.0") == same
    assert checksum("[0.0, 0.0, 0.1]", "0.001") != same
    assert checksum("[0.0, 1e-9, 0.1]", "0.0") != same
