"""Every page, wide and narrow, light and dark, by keyboard: nothing serious for axe-core, nothing cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.daq.service.browser import Browser, chromium
from tests.daq.service.every_page import SCHEMES, WIDTHS, write_pages
from tests.daq.service.test_browser import FAINT, PAGES, TINY, reached_by_keyboard

PROGRAM = chromium()
AXE = Path(str(pytest.importorskip("axe_core_python").__file__)).with_name("axe.min.js")
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not here")
SERIOUS = ("serious", "critical")
FOLD = 900
"""px that a window on a desk shows at once."""


def axe_of(page: Browser) -> list[dict[str, Any]]:
    """What axe-core says of the page as it is shown (WCAG 2, AA and good practice)."""
    found = page.evaluate(
        "axe.run().then(all => all.violations.map(v => ({id: v.id, impact: v.impact, help: v.help,"
        " nodes: v.nodes.map(n => n.html)})))"
    )
    return [one for one in found if one["impact"] in SERIOUS]


@pytest.mark.slow
def test_every_page_is_whole_for_everybody(
    page: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setenv("ARMHIL_CATALOGUE", str(tmp_path / "of-the-pages.db"))
        files = write_pages(tmp_path)
    axe, service, pictures = AXE.read_text(encoding="utf-8"), page.origin, 0
    written = [(tmp_path.as_uri(), f"/{file.relative_to(tmp_path)}") for file in files]
    for page.origin, path in (*((service, path) for path in PAGES), *written):
        page.open(path)
        reached_by_keyboard(page, path)
        page.evaluate(axe)
        pictures += len(page.evaluate(_LABELS))
        for width in WIDTHS:
            page.resize(width, FOLD)
            for scheme in SCHEMES:
                page.colours(scheme)
                at = (path, width, scheme)
                assert not page.evaluate(FAINT), at
                if scheme == SCHEMES[WIDTHS.index(width)]:  # it takes a second; contrast is measured above
                    assert axe_of(page) == [], at
            assert page.evaluate("document.documentElement.scrollWidth") <= width, at
            assert page.evaluate("innerWidth") == width, at  # what is wider makes all smaller on a phone
            assert not page.evaluate(TINY), at
            assert not page.evaluate(_CUT), at
            assert not [labels for labels in page.evaluate(_LABELS) if len(set(labels)) < len(labels)], at
        if path.endswith("check.html"):
            page.resize(WIDTHS[0], FOLD)
            shown = page.evaluate("document.querySelector('svg.course.wide').getBoundingClientRect().bottom")
            assert 0 < shown < FOLD, "verdict, what moved and its picture before the fold"
    assert page.problems == [] and pictures > 60
    page.evaluate("document.querySelector('a').textContent = ''")
    assert "link-name" in [one["id"] for one in axe_of(page)], "it does look"
    page.evaluate("document.querySelector('.panel .grid span').textContent = '1234567890123 long'")
    assert page.evaluate(_CUT), "it does measure"


_LABELS = """
[...document.querySelectorAll(".panel, .time")]
  .map((axis) => [...axis.querySelectorAll(".grid span, :scope > span:not(.what)")].map((e) => e.textContent))
  .filter((labels) => labels.length)
"""
"""Labels of each axis."""
_CUT = """
(() => {
  const cut = [];
  for (const text of document.querySelectorAll("svg text, .grid span, .time span")) {
    if (!text.checkVisibility() || !text.textContent.trim()) continue;
    const box = text.getBoundingClientRect();
    const frame = (text.closest("svg") || text.closest("figure")).getBoundingClientRect();
    const outside = Math.max(frame.left - box.left, box.right - frame.right);
    if (outside > 1) cut.push(text.textContent.trim());
  }
  return cut;
})()
"""
"""Labels that reach out of their picture."""
