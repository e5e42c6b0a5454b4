"""docs/reference/effects.md says of every effect what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import robots
from ident import RegressorModel
from ident.discrepancy.present import Present
from ident.effects.family import Shape
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "effects.md"
TX40 = robots.load("tx40")
MODEL = RegressorModel.of(TX40)
PRESENT = Present(MODEL, MODEL.prior())
PLACES = {
    "joint": "each joint",
    "drive": "each drive",
    "joint_pair": "each two neighbouring joints",
    "tool": "the tool",
    "base": "the base",
    "arm": "the whole arm; each drive",
}


def number(value: float) -> str:
    return f"{value:.3g}".replace("e-0", "e-").replace("-", "−")


def shape_cell(shape: Shape) -> str:
    unit = "" if shape.unit == "1" else f" {shape.unit}"
    if shape.fixed:
        return f"`{shape.name}`{unit}: {', '.join(number(value) for value in sorted(shape.grid))}"
    return f"`{shape.name}`{unit}: {number(shape.lower)} to {number(shape.upper)}"


def row(family: Family) -> str:
    """As it stands in the page's table."""
    place = family.places(TX40)[0]
    shapes = family.shapes(TX40, place)
    effect = family.effect(TX40, place, tuple(shape.grid[0] for shape in shapes), PRESENT)
    parameters = ", ".join(
        f"`{name}`" + ("" if unit == "1" else f" {unit}")
        for name, unit in zip(effect.parameter_names, effect.units, strict=True)
    )
    cells = [
        f"`{family.name}`",
        family.sentence,
        PLACES[family.scope],
        parameters,
        "; ".join(shape_cell(shape) for shape in shapes) or "–",
        ", ".join(f"`{name}`" for name in family.confused_with) or "–",
    ]
    return f"| {' | '.join(cells)} |"


FORMS = [form for family in VOCABULARY for form in (family, *family.forms)]


@pytest.mark.parametrize("family", FORMS, ids=lambda family: family.name)
def test_the_table_has_the_row(family: Family) -> None:
    assert row(family) in PAGE.read_text(encoding="utf-8").splitlines(), row(family)


def test_the_table_has_no_other_row() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [family.name for family in FORMS]


def test_the_page_names_what_only_a_prior_shows() -> None:
    text = PAGE.read_text(encoding="utf-8")
    paragraph = next(part for part in text.split("\n\n") if part.startswith("A refit swallows"))
    named = set(re.findall(r"`(\w+)`", paragraph))
    assert named == {family.name for family in VOCABULARY if family.needs_prior}
    paragraph = next(part for part in text.split("\n\n") if part.startswith("Around reversals"))
    named = set(re.findall(r"`(\w+)`", paragraph))
    assert named == {family.name for family in VOCABULARY if family.evidence == "reversal"}
