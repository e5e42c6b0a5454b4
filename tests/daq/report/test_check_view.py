"""The page of a check: its verdict comes first, with what moved, beside which baseline, and a picture."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from daq.check.judged import comparison_json
from daq.report.check_view import _warmth, check_view
from daq.report.page import render
from ident.drift import Comparison, DriftSettings, compare, patterns_of
from ident.drift.words import sentence_of
from tests.daq.report.contents import content
from tests.ident.drift.arms_of_nights import draw_nights, geometry

BASELINE, TONIGHT = ("run 3", "accepted 2026-10-01 by <Ada>"), ("run 47", "2026-11-22 02:31 UTC")


@pytest.fixture(scope="module")
def comparisons() -> dict[str, Comparison]:
    """Friction of joint 2 + 40 % on the fourth night, and fine."""
    made = geometry(friction=12.0)
    pattern = next(p for p in patterns_of(made) if (p.effect, p.joint) == ("coulomb_friction", 2))
    assert pattern.scale is not None
    change = 0.4 * pattern.scale * pattern.directions[:, 0]
    nights = [
        replace(n, celsius=None) for n in draw_nights(made, 4, 1, change=change, first=3, per_kelvin=0.0)
    ]
    return {"changed": compare(nights[0], nights[1:], made), "fine": compare(nights[0], nights[1:3], made)}


@pytest.fixture(scope="module")
def compared(comparisons: dict[str, Comparison]) -> dict[str, dict[str, Any]]:
    """As the catalogue keeps them."""
    return {name: json.loads(json.dumps(comparison_json(one))) for name, one in comparisons.items()}


def page(verdict: str, details: dict[str, Any], sentence: str = "said & done") -> str:
    view = check_view(verdict, sentence, details, BASELINE, TONIGHT)
    return render(replace(content(), title="arm: check", check=view))


def text(html: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html)).replace("\u00a0", " ")


def test_the_verdict_of_the_check_comes_before_that_of_the_identification(
    compared: dict[str, dict[str, Any]],
) -> None:
    html = page(
        "warning", {"comparison": compared["changed"], "warnings": ["loud <b>"], "findings": ["found it"]}
    )
    first = text(html[html.index("<main>") : html.index('id="identification"')])
    assert "Check: warning" in first and "Verdict:" not in first
    assert "said & done" not in html and "said &amp; done" in html and "by &lt;Ada&gt;" in html
    for said in ("run 3", "run 47", "loud", "found it", "tolerance 5 %", "no thermometer", "3 of them teach"):
        assert said in text(html).replace("&lt;b&gt;", ""), said
    assert re.search(r"Coulomb friction of joint 2 \+(39|40)", first)
    assert re.search(r"(19|20|21) K colder at least; no thermometer", first)
    assert html.index('class="course wide"') < html.index('id="moved"') < html.index('id="identification"')
    assert html.count('class="out"') == 2  # tonight, wide and narrow
    assert html.count('class="beyond"') == 1 and html.count('class="within"') == 5
    assert "What is usual, and what was forgiven tonight" in html


def test_a_fine_check_and_one_without_a_baseline(compared: dict[str, dict[str, Any]]) -> None:
    fine = page("ok", {"comparison": compared["fine"], "celsius": [21.0] * 6})
    assert "Nothing has moved" in fine and 'class="out"' not in fine and 'id="moved"' not in fine
    assert "21.0 °C" in text(fine)
    alone = check_view("unknown", "none", {"comparison": None}, ("", ""), TONIGHT)
    assert alone.headline == "No baseline to compare with" and alone.joints == () and not alone.picture
    assert "No baseline to compare with" in render(replace(content(), check=alone))
    grown = check_view("warning", "x", {"comparison": compared["fine"], "grown": [2]}, BASELINE, TONIGHT)
    assert grown.headline == "The model leaves more of the torque than on the nights before"


def test_a_check_of_before_has_a_page_too(compared: dict[str, dict[str, Any]]) -> None:
    """What older versions did not keep is left out."""
    old = {
        key: compared["changed"][key]
        for key in compared["changed"]
        if key not in ("usual", "course", "colder")
    }
    old["changes"] = [{k: v for k, v in one.items() if k != "kelvin"} for one in old["changes"]]
    view = check_view("failed", "x", {"comparison": old, "settings": {"tolerance": 0.03}}, BASELINE, TONIGHT)
    assert view.usual == () and not view.picture and view.tolerance == "3\u00a0%"
    assert view.moved[0].warmth == "–" and view.joints[1].beyond
    assert "Coulomb friction of joint 2" in render(replace(content(), check=view))


def test_a_joint_that_slides_takes_a_force(
    compared: dict[str, dict[str, Any]], comparisons: dict[str, Comparison]
) -> None:
    """Joint 2 is the one whose friction has moved; an older check does not say of which kind it is."""
    for units, unit in ((["N·m", "N", *["N·m"] * 4], "N"), ("old", "N·m or N")):
        found = {**compared["changed"], "torque_units": units}
        view = check_view("failed", "x", {"comparison": found}, BASELINE, TONIGHT)
        shown = text(render(replace(content(), check=view)))
        first = shown[: shown.index("What the verdict rests on")]
        assert f" {unit} rms on joint 2;" in first and f" {unit} on joint 2 " in first
        assert re.search(rf" 2 [0-9.]+ {unit} ▲", first) and view.warnings == ()
    words = replace(comparisons["changed"], torque_units=("N",) * 6)
    assert " N rms on joint 2," in sentence_of(words, 4, DriftSettings()).sentence


def test_an_identification_by_itself_has_no_check() -> None:
    assert "Check:" not in render(content())


def _paths(value: Any, at: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Every key and every first entry of a list, at whatever depth."""
    first = enumerate(value[:1]) if isinstance(value, list) else ()
    inner = value.items() if isinstance(value, dict) else first
    for key, part in inner:
        yield (*at, key)
        yield from _paths(part, (*at, key))


@pytest.mark.parametrize("otherwise", ["missing", None, "text", 7, []])
def test_a_check_that_lacks_any_key_has_a_page_and_says_what_is_not_shown(
    compared: dict[str, dict[str, Any]], otherwise: object
) -> None:
    whole = {"comparison": compared["changed"], "settings": {"tolerance": 0.05}, "celsius": [20.0]}
    all_shown = check_view("failed", "said", whole, BASELINE, TONIGHT)
    assert all_shown.warnings == () and all_shown.tests and all_shown.usual and all_shown.moved
    told = 0
    for path in [*_paths(whole), ("comparison",)]:
        damaged = json.loads(json.dumps(whole))
        holder = damaged
        for key in path[:-1]:
            holder = holder[key]
        if otherwise != "missing":
            holder[path[-1]] = otherwise
        elif isinstance(holder, dict):
            del holder[path[-1]]
        view = check_view("failed", "said", damaged, BASELINE, TONIGHT)
        assert view.sentence == "said" and view.facts[0].label == "Baseline", path
        told += view.warnings != ()
    render(replace(content(), check=view))
    assert told > 0 or otherwise == []
    odd = check_view("resting", "said", whole, BASELINE, TONIGHT)
    assert odd.word == "resting" and odd.kind == "unknown"


@pytest.mark.parametrize(
    ("kelvin", "colder", "said"),
    [
        (15.2, 4.8, "15 K colder at least, beyond the thermometer's 4.8 K colder"),
        (15.2, -4.8, "15 K colder at least; thermometer 4.8 K warmer"),
        (-15.2, -4.8, "15 K warmer at least, beyond the thermometer's 4.8 K warmer"),
        (15.2, 0.3, "15 K colder at least; thermometer 0.3 K colder"),
        (15.2, None, "15 K colder at least; no thermometer"),
        (None, 4.8, "–"),
    ],
)
def test_a_change_is_beyond_what_the_thermometer_explains(
    kelvin: float | None, colder: float | None, said: str
) -> None:
    assert _warmth(kelvin, colder, None) == said
