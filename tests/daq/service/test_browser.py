"""Every page in headless Chromium, as people use them: mouse, keyboard, dark, phone, a live run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivers import Channel
from robots import Robot
from tests.daq.service.browser import Browser, chromium
from tests.daq.service.fleets import write_fleet

DRIVE = "drive-token-of-the-test"
PROGRAM = chromium()
pytestmark = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not here")
PHONE, DESK = 390, 1280
PAGES = ("/", "/runs", "/arms/emps-sim?parameter=Fc1", "/runs/12", "/docs", "/login")


def test_rows_of_a_phone_begin_below_each_other(page: Browser) -> None:
    page.resize(PHONE, 844)
    for path in ("/runs", "/arms/emps-sim"):
        page.open(path)
        gaps = page.evaluate(_GAPS)
        assert len(gaps) > 5
        assert {round(gap) for gap in gaps} == {12}, (path, gaps)


def reached_by_keyboard(page: Browser, path: str) -> None:
    """Tab leads to everything that can be used, and shows where it is."""
    wanted = page.evaluate(_REACHABLE)
    reached = []
    for _ in range(len(wanted) + 5):
        page.key("Tab", 9)
        focus = page.evaluate(_FOCUS)
        assert focus is None or focus["shown"], (path, focus)
        reached += [] if focus is None else [focus["place"]]
    assert set(wanted) <= set(reached), (path, set(wanted) - set(reached))


def test_the_keyboard_reaches_everything_and_shows_where_it_is(page: Browser) -> None:
    for path in PAGES:
        page.open(path)
        reached_by_keyboard(page, path)
    page.open("/")
    page.key("Tab", 9)
    assert page.evaluate("document.activeElement.textContent") == "To the content"
    page.evaluate("document.querySelector('.arm h3 a').focus()")
    page.key("Enter", 13, "\r", leaves=True)
    assert page.evaluate("location.pathname") == "/arms/emps-sim"
    assert page.problems == []


def test_from_the_arms_to_a_run_and_a_trend(page: Browser) -> None:
    page.open("/")
    page.click(".arm h3 a", "emps-sim")
    assert page.evaluate("document.querySelector('#trend').textContent").startswith("Fc1")
    page.click(".trends a", "Fv1")
    assert page.evaluate("document.querySelector('#trend').textContent").startswith("Fv1")
    page.click("details summary", leaves=False)
    page.until("document.querySelector('details').open")
    page.click("details table a", "12")
    assert page.evaluate("location.pathname") == "/runs/12"
    assert page.evaluate("document.querySelectorAll('svg.gate, .gates svg').length") >= 3
    page.click("table.data a", "Fc1")
    assert page.evaluate("location.search + location.hash") == "?parameter=Fc1#trend"
    page.click("nav a", "Runs")
    page.evaluate("document.querySelector('select').value = 'emps-sim'")
    page.click(".filter button")
    assert page.evaluate("location.search") == "?arm=emps-sim"
    page.click("tbody a", "12")
    page.click(".button", "Open the report")
    assert "one report" in page.evaluate("document.body.textContent")
    assert page.problems == []


@pytest.mark.slow
def test_a_check_is_started_and_looked_at_while_it_runs(
    page: Browser, tmp_path: Path, emps: Robot, channel: Channel
) -> None:
    write_fleet(tmp_path / "fleet.toml", emps, channel)
    page.open("/")
    page.type("input[name=token]", "not the token at all")
    page.click(".drive button", leaves=False)
    page.until("document.querySelector('#drive-said').textContent.includes('needs the token')")
    assert len(page.problems) == 1 and "403" in page.problems.pop()  # the browser's own note of the refusal
    page.type("input[name=token]", DRIVE)
    page.click(".drive button", leaves=False)
    page.until("document.querySelector('#drive-said').textContent.includes('has begun')")
    page.until("document.querySelector('#drive-said a') !== null")
    page.open("/runs")
    page.click("tbody a", "running, look on")
    page.until("parseFloat(document.querySelector('#live-time').textContent) > 1")
    page.picture(tmp_path / "live.png")
    assert page.evaluate("document.querySelectorAll('.live-joint path.position[d]').length") == 1
    axes = page.evaluate(_AXES)
    assert len(axes) == 4 and all(len(set(axis)) == len(axis) >= 2 for axis in axes), axes
    page.resize(PHONE, 844)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE
    page.picture(tmp_path / "live-phone.png")
    page.resize(DESK, 900)
    page.until("document.querySelector('#live-state').textContent.startsWith('over')")
    assert page.evaluate("document.querySelector('#live-state').textContent") == "over: completed"
    page.until("fetch('/api/jobs').then(a => a.json()).then(jobs => jobs[0].exit_code !== null)")
    assert page.evaluate("fetch('/api/jobs').then(a => a.json())")[0]["exit_code"] == 3  # no baseline yet
    page.click(".button", "To the run")
    assert page.evaluate("document.querySelector('section[aria-labelledby=torque] .plots svg') !== null")
    page.picture(tmp_path / "run.png")
    _cursor_and_zoom(page, "#position ~ .plots")
    page.click(".button", "Open the report")
    assert "revised" in page.evaluate("document.body.textContent")
    _cursor_and_zoom(page, "#torque ~ .plots")  # its one script runs there
    assert page.problems == []


def _cursor_and_zoom(page: Browser, plots: str) -> None:
    """With the keyboard alone; the reading is that of the picture's own axis."""
    page.evaluate(f"document.querySelector('{plots} [role=img]').focus()")
    page.key("ArrowRight", 39)
    reading = f"document.querySelector('{plots} .reading').textContent"
    said = page.evaluate(reading)
    assert " s: measured " in said and "difference " in said, said
    box = f"document.querySelector('{plots} .panel svg').getAttribute('viewBox')"
    times = f"[...document.querySelectorAll('{plots} figure:first-child .time span')].map(e => e.textContent)"
    whole, labels = page.evaluate(box), page.evaluate(times)
    page.key("+", 187, "+")
    assert float(page.evaluate(box).split()[2]) == 500.0 and page.evaluate(times) != labels
    assert page.evaluate(reading) == said  # the cursor stays where it is
    page.key("Escape", 27)
    assert page.evaluate(box).split() == whole.split() and page.evaluate(times) == labels
    assert page.evaluate(reading) == ""


def test_problems_are_noticed(page: Browser) -> None:
    """What the other tests look for is seen where it is."""
    page.open("/")
    page.evaluate("console.error('made up'); fetch('/nothing'); setTimeout(() => { throw Error('thrown'); })")
    page.evaluate("new Promise(done => setTimeout(done, 300))")
    said = json.dumps(page.problems)
    assert "made up" in said and "thrown" in said and "404" in said
    page.evaluate("document.querySelector('.lead, p').style.color = '#ccc'")
    assert page.evaluate(FAINT)


FAINT = """
(() => {
  const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => {
    const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    const part = [r, g, b].map((v) => linear(v / 255));
    return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
  };
  const ground = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const found = numbers(getComputedStyle(e).backgroundColor);
      if (found.length === 3 || found[3] > 0.99) return found;
    }
    return matchMedia("(prefers-color-scheme: dark)").matches ? [18, 18, 18] : [255, 255, 255];
  };
  const faint = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || !element.checkVisibility()) continue;
    const style = getComputedStyle(element);
    const ink = numbers(element.closest("svg") ? style.fill : style.color);
    const [a, b] = [light(ink), light(ground(element))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const text = walker.currentNode.textContent.trim();
    if (contrast < (large ? 3 : 4.5)) faint.push(`${text}: ${contrast.toFixed(2)}`);
  }
  return faint;
})()
"""
TINY = """
[...document.querySelectorAll("body *")]
  .filter((e) => e.checkVisibility())
  .filter((e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))
  .filter((e) => {
    const scale = e.closest("svg") ? e.getScreenCTM().d : 1;
    return scale * parseFloat(getComputedStyle(e).fontSize) < 11;
  })
  .map((e) => e.textContent.trim())
"""
"""Texts in letters below 11 px, drawn ones as they come out."""
_REACHABLE = """
[...document.querySelectorAll("a[href], button, input:not([type=hidden]), select, summary, [tabindex='0']")]
  .map((e, k) => { e.dataset.place = k; return e; })
  .filter((e) => e.checkVisibility())
  .map((e) => Number(e.dataset.place))
"""
_FOCUS = """
(() => {
  const e = document.activeElement;
  if (!e || e === document.body) return null;
  const style = getComputedStyle(e);
  const box = e.getBoundingClientRect();
  const inside = box.bottom > 0 && box.top < innerHeight && box.right > 0 && box.left < innerWidth;
  const ring = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2;
  return { place: Number(e.dataset.place), text: e.textContent.trim(), ring, inside, shown: ring && inside };
})()
"""

_GAPS = """[...document.querySelectorAll('.stack td.time')].map(
  cell => cell.getBoundingClientRect().left - cell.previousElementSibling.getBoundingClientRect().right)"""
"""px between the number of a run and its date, as the style has it between all cells of a row."""
_AXES = """[...document.querySelectorAll('.live-joint .panel, .live-joint .time')].map(
  axis => [...axis.querySelectorAll('.grid span, :scope > span:not(.what)')].map(e => e.textContent))"""
"""Labels of each axis of the live pictures: three of values, one of time."""
