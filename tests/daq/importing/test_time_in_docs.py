"""What the pages say of time stamps stands in one place, with the numbers of the code; the others link it."""

from __future__ import annotations

from pathlib import Path

import pytest

from daq.importing.pieces import SHORTEST_PIECE
from ident.preparation import resampling

DOCS = Path(__file__).parents[3] / "docs"
THERE = "import-toml.md#time-as-it-was"


def text_of(page: str) -> str:
    return " ".join((DOCS / page).read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def section() -> str:
    _, _, rest = text_of("reference/import-toml.md").partition("## Time as it was")
    return rest.partition(" ## ")[0]


def test_the_numbers_are_those_of_the_code(section: str) -> None:
    longest, words = resampling.longest_gap(1.0), {1: "a fifth", 2: "two"}
    assert round(1.0 / resampling._MOTION) == 5
    assert f"loses at most {100.0 * resampling._COST:g} % of a motion at {words[1]} of the cut-off" in section
    assert f"({longest:.2g} / cut-off; {1e3 * longest / 12.0:.0f} ms at 12 Hz)" in section
    assert f"pieces of at least {SHORTEST_PIECE:g} s are used" in section
    assert f"within {words[int(resampling._BACK)]} periods" in section


@pytest.mark.parametrize("page", ["how-to/own-data.md", "reference/cli.md", "reference/capture-format.md"])
def test_the_other_pages_link_it_and_state_no_other_limit(page: str) -> None:
    text = text_of(page)
    assert THERE in text
    for sentence in text.split(". "):
        if "missing" in sentence and ("jitter" in sentence or THERE in sentence):
            assert "refused" not in sentence
            assert not any(unit in sentence for unit in (" % ", " ms", " periods", " Hz"))


def test_nobody_else_speaks_of_it() -> None:
    """A page that begins to must link the section, and be added above."""
    of_logs = ("even grid", "jitter")
    found = {
        str(page.relative_to(DOCS))
        for page in DOCS.rglob("*.md")
        if any(word in page.read_text(encoding="utf-8") for word in of_logs)
    }
    assert found == {"how-to/own-data.md", "reference/cli.md", "reference/import-toml.md"}


def test_a_capture_is_cut_as_long_as_its_pages_say() -> None:
    assert f"pieces shorter than {SHORTEST_PIECE:g} s are left out" in text_of("reference/capture-format.md")
    assert f"each uninterrupted piece of at least {SHORTEST_PIECE:g} s" in text_of("reference/cli.md")
