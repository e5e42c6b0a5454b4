"""armhil diagnose --search evidence and both."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.daq.calls import Call


def emps(shared_data: Path) -> tuple[str, ...]:
    return (str(shared_data / "emps" / "DATA_EMPS.mat"), "--robot", "emps", "--split-half")


def test_friction_that_differs_with_the_direction_is_named_on_a_real_rig(
    armhil: Call, shared_data: Path
) -> None:
    """One axis, nothing repeats, no prior: what the published identification adds, too."""
    code, out, _ = armhil("diagnose", *emps(shared_data), "--search", "evidence", "--json")
    assert code == 1
    answer = json.loads(out)["evidence"]
    assert answer["verdict"] == "named"
    (finding,) = answer["findings"]
    assert finding["effect"] == "asymmetric_friction" and finding["probability"] > 0.95
    assert finding["parameters"][1]["value"] == pytest.approx((166.7061 - 240.4236) / 2, rel=0.1)
    assert answer["repeats"] is False
    (joint,) = answer["joints"]
    assert joint["unexplained"]["after"] < 0.5 * joint["unexplained"]["before"]
    assert sum(one["probability"] for one in answer["ranking"]) <= 1.0 + 1e-9


def test_both_searches_answer_side_by_side(armhil: Call, shared_data: Path) -> None:
    words = (*emps(shared_data), "--without", "coulomb_friction", "--search", "both", "--power", "--json")
    _, out, text = armhil("diagnose", *words)
    content = json.loads(out)
    assert content["findings"][0]["effect"] == "coulomb_friction"
    assert content["evidence"]["joints"][0]["unexplained"]["before"] > 0.1
    assert "By evidence" in text
    assert "Smallest size that would be named rightly" in text
    said = {one["effect"]: one for one in content["power"]["smallest"]}
    # Of 20 N of dry friction the model lacks all; next to that misfit a play would need to be large.
    assert said["coulomb_friction"]["size"] is None or said["coulomb_friction"]["size"] < 20.0
    assert said["payload"]["size"] is None  # after a refit there is no other mass to tell it from


def test_what_the_evidence_does_not_do_is_said(armhil: Call, shared_data: Path, tmp_path: Path) -> None:
    code, _, text = armhil("diagnose", *emps(shared_data), "--search", "evidence", "--out", str(tmp_path))
    assert code == 2
    assert "--search both" in text
    code, _, text = armhil("diagnose", "--live", "emps", "--search", "both", "--yes")
    assert code == 2
    assert "--live" in text
