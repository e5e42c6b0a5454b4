"""armhil diagnose: names by evidence, with what a person acts on."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.diagnosis.diagnosis_words import sure_words
from ident.discrepancy.results import Possible
from tests.daq.calls import Call


def emps(shared_data: Path) -> tuple[str, ...]:
    return (str(shared_data / "emps" / "DATA_EMPS.mat"), "--robot", "emps", "--split-half")


def test_friction_that_differs_with_the_direction_is_named_on_a_real_rig(
    armhil: Call, shared_data: Path
) -> None:
    """One axis, nothing repeats, no prior: what the published identification adds, too.

    Beside it stands a ripple of 1 N that comes once per turn of the screw, of 2.5 mm, which both halves show.
    Whatever else the fitted half proposes is left out, since the other half speaks against it.
    """
    code, out, text = armhil("diagnose", *emps(shared_data), "--parameters", "--power", "--json")
    assert code == 1
    content = json.loads(out)
    assert content["verdict"] == content["evidence"]["verdict"] == "named"
    named = [one for one in content["evidence"]["findings"] if one["named"]]
    others = [one for one in content["evidence"]["findings"] if not one["named"]]
    assert not any(one["confirmation"]["observed"] > 0.0 for one in others)
    for part in (content["findings"], named):
        assert {one["effect"] for one in part} == {"asymmetric_friction", "torque_ripple"}
        assert all(one["probability"] > 0.95 for one in part)
    finding, ripple = sorted(named, key=lambda one: str(one["effect"]))
    values = {one["name"]: one["value"] for one in ripple["parameters"]}
    assert values["periods_per_turn"] == 1.0
    assert np.hypot(values["ripple_cos1"], values["ripple_sin1"]) == pytest.approx(1.0, abs=0.2)
    assert finding["parameters"][1]["value"] == pytest.approx((166.7061 - 240.4236) / 2, rel=0.1)
    assert content["evidence"]["repeats"] is False
    (joint,) = content["evidence"]["joints"]
    assert joint["unexplained"]["after"] < 0.5 * joint["unexplained"]["before"]
    assert sum(one["probability"] for one in content["evidence"]["ranking"]) <= 1.0 + 1e-9
    words = " ".join(text.split())
    assert "(probability 0.9" in words and "would be named from" in words
    assert "Nothing repeats in these recordings" in words and "nearest candidate" in words
    assert words.count("(probability 0.9") == words.count("of the gap)") == len(content["findings"])
    for once in ("epeat", "would be named from", "Smallest size that would be named rightly"):
        assert words.count(once) == 1, once
    said = {one["effect"]: one["size"] for one in content["power"]["smallest"]}
    assert 0.0 < said["hysteresis"] < 20.0, "N, of which the axis has as much dry friction"
    assert said["payload"] is None, "after a refit there is no other mass to tell it from"


def test_the_search_by_rules_is_asked_for_in_vain(armhil: Call, shared_data: Path) -> None:
    code, _, text = armhil("diagnose", *emps(shared_data), "--search", "rules")
    assert code == 2
    assert "No such option: --search" in " ".join(text.split())


def test_what_else_is_possible_stands_beside_a_name() -> None:
    """The same words on the terminal and on the page, in two decimals."""
    finding: Any = SimpleNamespace(
        effect="current_offset",
        joints=(2,),
        probability=0.67,
        held=(
            Possible("current_offset", (2,), 0.67),
            Possible("asymmetric_friction", (2,), 0.24),
            Possible("something without a name", (2,), 0.05),
        ),
    )
    assert sure_words(finding) == (
        "probability 0.67, else asymmetric friction (joint 2) 0.24, something without a name (joint 2) 0.05"
    )
    finding.held = finding.held[:1]
    assert sure_words(finding) == "probability 0.67"
