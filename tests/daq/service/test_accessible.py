"""Every page, wide and narrow, light and dark, by keyboard: nothing serious for axe-core, nothing cut."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import ArmIdentity
from daq.session.spool import Spooling
from daq.session.states import Conduct
from daq.session.streaming import Nobody
from drivers import Samples
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from robots import Robot
from tests.daq.service.browser import Browser, chromium
from tests.daq.service.every_page import SCHEMES, WIDTHS, write_pages
from tests.daq.service.test_browser import FAINT, PAGES, TINY, reached_by_keyboard
from trajectories import Trajectory
from trajectories.motions.sampled import sampled_motion

PROGRAM = chromium()
AXE = Path(str(pytest.importorskip("axe_core_python").__file__)).with_name("axe.min.js")
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not here")
SERIOUS = ("serious", "critical")
FOLD = 900
"""px that a window on a desk shows at once."""
LASTS, BATCH = 20.0, 25
"""s of motion that somebody looks on, and its rows that come at once."""


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
    service, pictures = page.origin, 0
    written = [(tmp_path.as_uri(), f"/{file.relative_to(tmp_path)}") for file in files]
    for page.origin, path in (*((service, path) for path in PAGES), *written):
        page.open(path)
        pictures += is_whole(page, path)
        if path.endswith("check.html"):
            page.resize(WIDTHS[0], FOLD)
            shown = page.evaluate("document.querySelector('svg.course.wide').getBoundingClientRect().bottom")
            assert 0 < shown < FOLD, "verdict, what moved and its picture before the fold"
    assert page.problems == [] and pictures > 60
    page.evaluate("document.querySelector('a').textContent = ''")
    assert "link-name" in [one["id"] for one in axe_of(page)], "it does look"
    page.evaluate("document.querySelector('.panel .grid span').textContent = '1234567890123 long'")
    assert page.evaluate(_CUT), "it does measure"


@pytest.mark.slow
def test_the_live_page_is_whole_while_six_axes_move(page: Browser, filled: Catalogue, tmp_path: Path) -> None:
    robot, capture = robots.load("tx40"), tmp_path / "capture.mcap"
    identity = ArmIdentity("tx40", (7,), "0" * 64, simulated=True)
    run = runs.begin(filled, identity, "run", capture=str(capture))
    over = threading.Event()
    arm = threading.Thread(target=_move, args=(robot, capture, over))
    arm.start()
    try:
        page.open(f"/runs/{run.id}/live")
        page.until("parseFloat(document.querySelector('#live-time').textContent) > 1")
        assert is_whole(page, "live") == 4 * robot.n, "axes of time, position, following error, torque"
        assert page.evaluate("document.querySelector('#live-state').textContent") == "slow: 6 joints"
        page.evaluate("document.querySelector('.live-joint svg').setAttribute('role', 'img')")
        page.evaluate("document.querySelector('.live-joint [aria-hidden]').removeAttribute('aria-hidden')")
        assert "svg-img-alt" in [one["id"] for one in axe_of(page)], "it does look"
    finally:
        over.set()
        arm.join()
    page.until("document.querySelector('#live-state').textContent.startsWith('over')")
    assert page.problems == []


def is_whole(page: Browser, path: str) -> int:
    """Wide and on a phone, light and dark, by keyboard and for axe-core; how many axes have labels."""
    reached_by_keyboard(page, path)
    page.evaluate(AXE.read_text(encoding="utf-8"))
    pictures = len(page.evaluate(_LABELS))
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
        if width == WIDTHS[0]:
            assert page.evaluate(_HIDDEN) == [], at
        assert not [labels for labels in page.evaluate(_LABELS) if len(set(labels)) < len(labels)], at
    return pictures


def _move(robot: Robot, capture: Path, over: threading.Event) -> None:
    """A run of the simulated arm for who looks on, at its own pace, until it is over."""
    period = robot.bus.cycle_time
    time = np.arange(round(LASTS / period)) * period
    reference = robot.home + 0.3 * np.sin(0.5 * time[:, None] + np.arange(robot.n)) * np.clip(
        time[:, None] / 2.0, 0.0, 1.0
    )
    run = simulate_offline(robot, draw_truth(robot, 3), reference)
    motion = Trajectory.sampled(
        sampled_motion(time, reference, np.zeros_like(reference)), period, family="move"
    )
    lines = Spooling(Nobody(), robot, capture)
    lines.begin("slow: 6 joints", motion, Conduct())
    for first in range(0, len(time), BATCH):
        if over.wait(BATCH * period):
            break
        rows = slice(first, first + BATCH)
        shape = run.position[rows].shape
        lines.samples(
            Samples(
                cycle=np.arange(first, first + shape[0]),
                time=time[rows],
                reference=run.reference[rows],
                position=run.position[rows],
                control_signal=run.control_signal[rows],
                statusword=np.full(shape, 0x1237, dtype=np.uint16),
                complete=np.ones(shape, dtype=np.bool_),
                lateness=np.full(shape[0], 3e-5),
            )
        )
    over.wait()
    lines.end(None)


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

_HIDDEN = """
[...document.querySelectorAll(".scroll")]
  .filter(box => box.checkVisibility() && !box.querySelector(".expression"))
  .filter(box => box.scrollWidth > box.clientWidth + 1)
  .map(box => `${box.getAttribute("aria-label")}: ${box.scrollWidth} in ${box.clientWidth}`)
"""
"""Tables whose last columns are out of sight, but for those of formulas, which are as long as they are."""
