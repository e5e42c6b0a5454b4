"""axe-core on every page, wide and narrow, light and dark: nothing serious (WCAG 2, AA and good practice)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.daq.report.contents import content
from tests.daq.report.test_report import write
from tests.daq.service.browser import Browser, chromium
from tests.daq.service.test_browser import DESK, PAGES, PHONE

PROGRAM = chromium()
AXE = Path(str(pytest.importorskip("axe_core_python").__file__)).with_name("axe.min.js")
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not here")
SERIOUS = ("serious", "critical")


def found_on(page: Browser, width: int, scheme: str) -> list[dict[str, Any]]:
    """What axe-core says of the page as it is shown."""
    page.resize(width, 844)
    page.colours(scheme)
    found = page.evaluate(
        "axe.run().then(all => all.violations.map(v => ({id: v.id, impact: v.impact, help: v.help,"
        " nodes: v.nodes.map(n => n.html)})))"
    )
    return [one for one in found if one["impact"] in SERIOUS]


@pytest.mark.slow
def test_no_page_has_a_serious_finding(page: Browser, tmp_path: Path) -> None:
    axe = AXE.read_text(encoding="utf-8")
    write(tmp_path, content("exogenous"))
    for path in (*PAGES, (tmp_path / "report.html").as_uri()):
        if path.startswith("file:"):
            page.origin = ""
        page.open(path)
        page.evaluate(axe)
        for width in (DESK, PHONE):
            for scheme in ("light", "dark"):
                assert found_on(page, width, scheme) == [], (path, width, scheme)
    page.evaluate("document.querySelector('a').textContent = ''")
    assert "link-name" in [one["id"] for one in found_on(page, DESK, "light")], "it does look"
