"""The reference page of the command line names every command and option, with its default, and no others."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from daq.cli import entry as cli

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "cli.md"
COMMANDS = get_command(cli.app).commands  # type: ignore[attr-defined]


def section(heading: str) -> str:
    """The text below a heading of the page, up to the next one of its level."""
    page = PAGE.read_text(encoding="utf-8")
    return re.split(r"^## ", page.split(f"\n## {heading}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


def options_in(text: str) -> dict[str, str]:
    """Long option → default, from the tables."""
    rows = re.findall(r"^\| (`--[^|]*)\| ([^|]*)\|", text, flags=re.MULTILINE)
    return {
        option: default.strip() for names, default in rows for option in re.findall(r"`(--[a-z-]+)`", names)
    }


def parameters_of(name: str) -> list[Any]:
    """Parameters of a command, or of all commands of a group."""
    command = COMMANDS[name]
    parts = getattr(command, "commands", {"": command}).values()
    return [parameter for part in parts for parameter in part.params]


def test_the_page_has_every_command() -> None:
    headings = re.findall(r"^## armhil ([\w-]+)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert sorted(headings) == sorted(COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_a_command_has_an_example_and_all_its_options(name: str) -> None:
    text = section(f"armhil {name}")
    assert f"$ armhil {name}" in text
    options = {
        parameter.opts[-1]: parameter for parameter in parameters_of(name) if parameter.opts[0][0] == "-"
    }
    documented = options_in(text)
    assert set(documented) == set(options) - {"--help"}
    for option, parameter in options.items():
        if isinstance(parameter.default, str | int | float) and not isinstance(parameter.default, bool):
            default = f"{parameter.default:g}" if isinstance(parameter.default, float) else parameter.default
            assert documented[option] == f"`{default}`", option


def test_options_of_all_commands() -> None:
    parameters = get_command(cli.app).params
    options = {parameter.opts[0] for parameter in parameters} - {"--help"}
    assert set(options_in(section("For all commands"))) == options
