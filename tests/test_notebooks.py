"""The notebooks run as they stand, cell after cell, in an empty folder, and come to what they say."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from daq.api import Picture

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "notebooks"


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the cells leave behind; the value of each cell's last expression is shown as a notebook would."""
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {"shown": []}
    for cell in cells:
        assert not cell.get("outputs"), "a notebook is kept without what it printed"
        if cell["cell_type"] == "code":
            source = "".join(cell["source"])
            *_, last = source.splitlines()
            exec(compile(source, f"{name}.ipynb", "exec"), names)
            if last[:1].strip() and not last.startswith("print") and "=" not in last.split("(")[0]:
                names["shown"].append(eval(last, names))
    return names


@pytest.mark.slow
def test_emps_has_the_published_digits(
    tmp_path: Path, shared_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(shared_data / "emps" / "DATA_EMPS.mat", tmp_path)
    names = run("emps", tmp_path, monkeypatch)
    found = [round(p.value, 4) for p in names["least_squares"].parameters]
    assert found == [95.1089, 203.5034, 20.3935, -3.1648]
    both = names["asymmetric"].to_frame()["value"]
    assert round(float(both.iloc[0]), 3) == pytest.approx(95.15, abs=0.05)
    assert any(isinstance(one, Picture) and "<svg" in one.svg for one in names["shown"])


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_hidden_play_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = run("hidden-play", tmp_path, monkeypatch)["found"]
    # Sixteen seconds show which gear and how wide; whether they are believed is for the unfitted motion.
    assert [(one.effect, one.joints) for one in found.findings] == [("backlash", (3,))]
    width = next(p for p in found.findings[0].parameters if p.name == "gap")
    assert abs(width.value - 1e-3) < 3 * width.sigma
    assert found.summary().startswith("Something is missing that looks like backlash") or (
        found.verdict == "named"
    )


@pytest.mark.slow
def test_a_worn_guide_is_seen_and_healthy_nights_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = run("is-my-arm-drifting", tmp_path, monkeypatch)
    assert not names["unchanged"].moved
    assert names["drifted"].moved
    assert "Fc1" in names["drifted"].to_frame().index


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == {"emps", "hidden-play", "is-my-arm-drifting"}
