"""docs/reference/effects.md says of every effect what the code says."""

from __future__ import annotations

from tests.ident.effects.effects_page import BEGIN, END, PAGE, page


def test_the_page_is_up_to_date() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert text.count(BEGIN) == text.count(END) == 1
    assert page(text) == text, "python -m tests.ident.effects.effects_page"
