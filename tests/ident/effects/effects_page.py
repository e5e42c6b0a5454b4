"""The tables of docs/reference/effects.md, made of what the effects declare.

``python -m tests.ident.effects.effects_page`` writes them into the page.
"""

from __future__ import annotations

from pathlib import Path

import robots
from ident import RegressorModel
from ident.effects.family import Shape
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY, confused_with
from ident.parameters.present import Present

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "effects.md"
BEGIN = "<!-- made by python -m tests.ident.effects.effects_page -->\n"
END = "<!-- end of what is made -->\n"

_TX40 = robots.load("tx40")
_MODEL = RegressorModel.of(_TX40)
_PRESENT = Present(_MODEL, _MODEL.prior())
_PLACES = {
    "joint": "each joint",
    "drive": "each drive",
    "joint_pair": "each two neighbouring joints",
    "tool": "the tool",
    "base": "the base",
    "arm": "the whole arm; each drive",
}
_SHOWS = {"motion": "in motion", "both": "in motion, at reversals", "reversal": "at reversals"}

_LAWS = """## How the torque is made

All signs are those of the model's side: a positive parameter makes the drive's torque larger in the positive
direction. q is a joint's position, or the drive's output where the place is a drive; sign is the form that
the arm's settings ask for.

"""

FORMS = [form for family in VOCABULARY for form in family.nested]


def _number(value: float) -> str:
    return f"{value:.3g}".replace("e-0", "e-").replace("-", "−")


def _shape_cell(shape: Shape) -> str:
    unit = "" if shape.unit == "1" else f" {shape.unit}"
    if shape.fixed:
        return f"`{shape.name}`{unit}: {', '.join(_number(value) for value in sorted(shape.grid))}"
    return f"`{shape.name}`{unit}: {_number(shape.lower)} to {_number(shape.upper)}"


def _row(family: Family) -> str:
    place = family.places(_TX40)[0]
    shapes = family.shapes(_TX40, place)
    effect = family.effect(_TX40, place, tuple(shape.grid[0] for shape in shapes), _PRESENT)
    parameters = ", ".join(
        f"`{one.name}`" + ("" if one.unit == "1" else f" {one.unit}") for one in effect.parameters
    )
    cells = [
        f"`{family.name}`",
        family.sentence,
        _PLACES[family.scope],
        parameters,
        "; ".join(_shape_cell(shape) for shape in shapes) or "–",
        _SHOWS[family.shows],
        _names(confused_with(family.name)) or "–",
    ]
    return f"| {' | '.join(cells)} |\n"


def _names(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _of(trait: str) -> str:
    return _names(tuple(family.name for family in VOCABULARY if getattr(family, trait)))


def tables() -> str:
    """What stands between :data:`BEGIN` and :data:`END`."""
    head = "| Name | What it is | Places | Parameters | Shape | Shows | Often confused with |\n"
    settled = "".join(f"| `{family.name}` | {family.settled_by} |\n" for family in VOCABULARY)
    told = "".join(
        f"| `{family.name}`, `{other}` | {how} |\n"
        for family in VOCABULARY
        for other, how in family.told_from.items()
    )
    hidden = [family for family in VOCABULARY if family.not_by_motion]
    said = dict.fromkeys((form.name, form.equation) for form in FORMS if form.equation)
    laws = "".join(f"- `{name}`: {equation}.\n" for name, equation in said)
    parts = (
        head + "|---" * 7 + "|\n" + "".join(map(_row, FORMS)),
        "A refit swallows these, whole or nearly so, since other parameters make up for them:"
        f" {_of('needs_prior')}.\nThey are named against a model that existed before (`--prior`).\n",
        f"Their torque depends on what was before: {_of('history')}.\n",
        f"An estimate of the lag between the channels takes these up: {_of('taken_by_alignment')}.\n",
        "| Name | What on the arm shows it, where no motion does |\n|---|---|\n" + settled,
        "| Names | What on the arm tells them apart |\n|---|---|\n" + told,
        "No motion is planned for these pairs, since on a moving arm they make the same torque: "
        + "; ".join(f"`{family.name}` and {_names(family.not_by_motion)}" for family in hidden)
        + ".\n",
        _LAWS + laws,
    )
    return "\n".join(parts)


def page(text: str) -> str:
    """The page with its tables made anew."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + tables() + END + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
