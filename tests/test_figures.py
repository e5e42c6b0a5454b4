"""The page of figures is what the benchmarks' pages say, and README and docs state the same."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.figures import MEASURED, PAGE, QUOTED, Quoted, page, read

ROOT = Path(__file__).resolve().parents[1]


def test_the_page_is_in_step_with_the_pages_that_it_quotes() -> None:
    found = json.loads(MEASURED.read_text(encoding="utf-8"))
    assert PAGE.read_text(encoding="utf-8") == page(found), "run: python -m benchmarks.figures"
    assert found["machine"]
    by_what = {what: value for what, value, _ in found["figures"]}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"{by_what['TX40: relative torque error, 100 Hz filter, 500 Hz rows, %']} % of torque" in readme
    assert set(found["versions"]) >= {"numpy", "pin", "mujoco-core"}


@pytest.mark.parametrize("figure", [one for one in QUOTED if one.stated], ids=lambda one: one.what)
def test_what_states_a_figure_states_that_one(figure: Quoted) -> None:
    for name in figure.stated:
        text = (ROOT / name).read_text(encoding="utf-8")
        value = read(figure)
        number = re.fullmatch(r"([\d.]+) mrad", value)
        if number is None:
            assert value in text, f"{name} does not say {value}: {figure.what}"
            continue
        # A range over the arms that were scored: this one has to be within what is printed.
        ranges = re.findall(r"([\d.]+) to ([\d.]+) mrad", text)
        assert any(float(low) - 0.05 <= float(number[1]) <= float(high) + 0.6 for low, high in ranges)


def test_a_figure_that_is_gone_is_said(tmp_path: Path) -> None:
    (tmp_path / "naming.md").write_text("| figure | value |\n|---|---|\n| another | 1 |\n", encoding="utf-8")
    with pytest.raises(ValueError, match="no row 'right name and joint first'"):
        read(QUOTED[0], tmp_path)
    assert read(replace(QUOTED[0], row="another"), tmp_path) == "1"
