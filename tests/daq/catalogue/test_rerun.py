"""armhil rerun of diagnoses, and what it refuses because it would have to move an arm."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from daq.catalogue import findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import RunKind
from daq.keeping.diagnosed_again import DIAGNOSE
from daq.keeping.rerun_choice import chosen_analysis
from tests.daq.calls import Call
from tests.daq.catalogue.entries import identity


@pytest.fixture
def diagnosed(armhil: Call, shared_data: Path, tmp_path: Path) -> None:
    """The published recording of the one-axis arm, diagnosed; run 1."""
    log = shared_data / "emps" / "DATA_EMPS.mat"
    code, _, err = armhil("diagnose", log, "--robot", "emps", "--split-half", "--out", tmp_path / "why")
    assert code == 1, err


@pytest.mark.slow
def test_a_diagnosis_again(diagnosed: None, armhil: Call, ask: Any, tmp_path: Path) -> None:
    """Identical; then different where the catalogue says that something else was found."""
    with Catalogue() as catalogue:
        assert chosen_analysis(catalogue, 1) == "diagnosis"
        (model,) = models.of_run(catalogue, 1)
        found = findings.of_run(catalogue, 1)
        assert found
    again = ask("rerun", 1)
    assert (again["analysis"], again["model"], again["sameness"]) == ("diagnosis", model.id, "identical")
    assert (again["largest_difference"], again["remarks"], again["report"]) == (0.0, [], None)
    assert [(one["effect"], tuple(one["joints"])) for one in again["findings"]] == [
        (one.effect, one.joints) for one in found
    ]

    with Catalogue() as catalogue, catalogue.writing() as connection:
        connection.exec_driver_sql("UPDATE findings SET effect = 'backlash'")
    code, out, _ = armhil("rerun", 1, "--json", "--out", tmp_path / "again")
    again = json.loads(out)
    assert (code, again["sameness"], again["largest_difference"]) == (1, "different", 0.0)
    then, now = (
        ", ".join(f"{name} (joint 1)" for name in names)
        for names in (["backlash"] * len(found), [one.effect for one in found])
    )
    assert again["remarks"] == [f"found then: {then}; now: {now}"]
    assert Path(again["report"]).is_file()
    with Catalogue() as catalogue:
        kept = models.of_run(catalogue, 1)
        assert [entry.settings["command"] for entry in kept] == [DIAGNOSE] * 2, "what was written is kept"
        assert {**kept[0].settings} == {**kept[1].settings}

    with Catalogue() as catalogue, catalogue.writing() as connection:
        connection.exec_driver_sql("UPDATE models SET settings = json_set(settings, '$.search', 'rules')")
    again = ask("rerun", 1)
    assert again["analysis"] == "diagnosis"
    assert again["remarks"] == ["names were given by rules then, and are given by evidence now"]


def test_what_was_never_made_is_refused(diagnosed: None, armhil: Call) -> None:
    code, _, err = armhil("rerun", 1, "--analysis", "check")
    assert (code, err) == (
        2,
        "armhil: run 1: was never compared with a baseline; allowed: runs of armhil check\n",
    )


@pytest.mark.parametrize(
    ("kind", "stage", "told"),
    [
        ("commission", "warm-up", "armhil commission tx40 --from warm-up --move"),
        ("commission", "slow run", "armhil commission tx40 --from slow-run --move"),
        ("check", "", "armhil check tx40"),
        ("run", "", "armhil run tx40 TRAJECTORY"),
        ("demo", "", "armhil demo"),
    ],
)
@pytest.mark.parametrize("analysis", ["identification", "diagnosis", "check"])
def test_what_would_move_an_arm_is_refused_with_the_command(
    armhil: Call, kind: RunKind, stage: str, told: str, analysis: str
) -> None:
    with Catalogue() as catalogue:
        run = runs.begin(catalogue, identity(), kind, stage=stage)
        runs.finish(catalogue, run.id, "failed")
        assert run.arm == "tx40"
    code, out, err = armhil("rerun", 1, "--analysis", analysis)
    words = f"{kind}, stage {stage}" if stage else kind
    assert (code, out) == (2, "")
    assert err == (
        f"armhil: run 1 ({words}) has no recording, and rerun moves no arm: it analyses recordings;"
        f" to go through it again: {told}\n"
    )


def test_a_recording_that_was_pruned(armhil: Call) -> None:
    with Catalogue() as catalogue:
        run = runs.begin(catalogue, identity(), "run")
        runs.finish(catalogue, run.id, "completed", capture_sha256="a" * 64)
    code, _, err = armhil("rerun", 1)
    assert (code, err) == (2, "armhil: run 1: its recording was deleted; what was found in it is kept\n")
