"""The tables of docs/reference/scenario-toml.md, made of what the entries of a scenario declare.

``python -m tests.drivers.simulated.scenario_page`` writes them into the page.
"""

from __future__ import annotations

import json
from pathlib import Path

from pydantic.fields import FieldInfo

from drivers.simulated.effects import friction, gear, loads, motor
from drivers.simulated.effects.entry import Entry
from drivers.simulated.scenario import Scenario, tables
from robots.allowed import allowed_at

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "scenario-toml.md"
BEGIN = "<!-- made by python -m tests.drivers.simulated.scenario_page -->\n"
END = "<!-- end of what is made -->\n"
_HEADINGS = {
    friction.__name__: "Friction",
    gear.__name__: "Gears and shafts",
    motor.__name__: "Motors and channels",
    loads.__name__: "Loads and surroundings",
}


def _section(name: str, entry: type[Entry]) -> str:
    several = isinstance(Scenario.model_fields[name].default, tuple)
    head = f"[[{name}]]" if several else f"[{name}]"
    more = ", several per axis" if entry.repeats else ""
    path = (name, 0) if several else (name,)
    rows = "".join(
        f"| `{key}` | {_default(field)} | {allowed_at(Scenario, (*path, key))} | {field.description} |\n"
        for key, field in entry.model_fields.items()
    )
    return (
        f"### `{name}`\n\n`{head}`: {entry.sentence}{more}.\n\n"
        f"| key | default | allowed | meaning |\n|---|---|---|---|\n{rows}\n"
    )


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    return "absent" if field.default is None else f"`{json.dumps(field.default)}`"


def sections() -> str:
    """What stands between :data:`BEGIN` and :data:`END`."""
    groups: dict[str, list[str]] = {heading: [] for heading in _HEADINGS.values()}
    for name, entry in tables().items():
        heading = _HEADINGS.get(entry.__module__, "Noise")
        if entry.outside_vocabulary:
            heading = "Outside the vocabulary of the discrepancy search"
        groups.setdefault(heading, []).append(_section(name, entry))
    return "".join(f"## {heading}\n\n{''.join(found)}" for heading, found in groups.items())


def page(text: str) -> str:
    """The page with its tables made anew."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + sections() + END + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
