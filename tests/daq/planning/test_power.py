"""``armhil plan --power``: how small each effect could be, from known noise and what is accepted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from daq.files.model_file import write_model
from daq.report.power import power_map
from drivers.simulated import draw_truth, simulate_offline
from ident.discrepancy.by_evidence.power.planned import white_noise
from ident.discrepancy.by_evidence.power.smallest import Smallest
from robots import Robot
from tests.daq.models import carriage
from tests.daq.planning.conftest import Plan
from tests.daq.planning.plan_files import recorded

MOTION = ("--periods", 2, "--seed", 1)


def sizes(plan: Plan, *arguments: object) -> dict[str, float]:
    """Per effect of the one-axis arm; infinite where none would be named."""
    content = json.loads(plan("emps", *arguments, "--power", "--json").out)
    assert content["power"]["chance"] == 0.8
    return {
        entry["effect"]: np.inf if entry["size"] is None else entry["size"]
        for entry in content["power"]["smallest"]
    }


def test_it_stands_on_the_terminal_and_the_page_where_it_is_asked_for(plan: Plan, tmp_path: Path) -> None:
    answer = plan("emps", *MOTION, "--power", "--out", "mine")
    assert "Smallest size that would be named rightly in 80% of recordings, worst first" in answer.out
    page = (tmp_path / "mine" / "plan.html").read_text(encoding="utf-8")
    assert "What would be named" in page and ">coulomb friction</th>" in page
    assert page.count("<td title=") == len(sizes(plan, *MOTION))
    assert "Smallest size" not in plan("emps", *MOTION, "--out", "without").out
    assert "What would be named" not in (tmp_path / "without" / "plan.html").read_text(encoding="utf-8")


def test_more_periods_show_smaller_effects(plan: Plan) -> None:
    few = sizes(plan, *MOTION)
    many = sizes(plan, "--periods", 8, "--seed", 1)
    for name in ("drifting_friction", "hysteresis", "dragging_brake"):
        assert many[name] < 0.8 * few[name], name


def test_what_alignment_takes_has_no_size_where_nobody_says_how_the_channels_lie(plan: Plan) -> None:
    content = json.loads(plan("emps", *MOTION, "--power", "--json").out)
    said = {entry["effect"]: entry for entry in content["power"]["smallest"]}
    for name in ("time_delay", "current_loop_lag"):
        assert said[name]["size"] is None
        assert said[name]["last_told_from"]["effect"] == "lag between the channels"


def test_an_accepted_capture_brings_its_noise_and_a_model_its_deviations(
    plan: Plan, tmp_path: Path, emps: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    described = sizes(plan, *MOTION, "--out", "mine")
    rows = np.loadtxt(tmp_path / "mine" / "emps.trajectory.csv", delimiter=",", skiprows=1)
    run = simulate_offline(emps, draw_truth(emps, 1), rows[:, 1:2])
    recorded(tmp_path / "run.mcap", emps, rows[:, 1:2], monkeypatch, run.position, run.control_signal)
    # The simulated axis is far quieter than 1 % of its limit, which is all that the description knows.
    known = sizes(plan, *MOTION, "--earlier", "run.mcap")
    assert known["hysteresis"] < 0.2 * described["hysteresis"]
    (tmp_path / "carriage.csv").write_text("")
    write_model(tmp_path / "emps.model.toml", carriage(emps), [tmp_path / "carriage.csv"], emps)
    accepted = sizes(plan, *MOTION, "--earlier", "emps.model.toml")
    # What moves is asked beside the parameters, and what shows at reversals of a loop that has them.
    assert accepted["torque_ripple"] == pytest.approx(described["torque_ripple"], rel=0.05)
    assert accepted["hysteresis"] == pytest.approx(described["hysteresis"], rel=0.15)
    # Of a carriage that was known from a good run a smaller change shows than of one known from this motion.
    assert accepted["drive_gain_error"] < 0.9 * described["drive_gain_error"]


def test_the_map_has_a_cell_for_each_place_and_is_darkest_where_most_is_hidden(tx40: Robot) -> None:
    def one(name: str, joints: tuple[int, ...], share: float) -> Smallest:
        seen = np.isfinite(share)
        size = 1.0 if seen else np.inf
        rival = ("nothing", ()) if seen else ("base_tilt", ())
        return Smallest(name, joints, "Fv1", "N·m", size, 2.0, 1, "N·m", (("power", 2.0, "1"),), rival, share)

    mapped = power_map(
        tx40,
        [
            one("coulomb_friction", (2,), 0.001),
            one("payload", (), 0.02),
            one("wrist_coupling", (5, 6), np.inf),
        ],
    )
    assert mapped.columns[0] == "the arm" and len(mapped.columns) == 7
    names = [name for name, _ in mapped.rows]
    assert names == ["wrist coupling", "payload", "coulomb friction"]
    cells = {name: [cell for cell in row if cell] for name, row in mapped.rows}
    assert all(len(own) == 1 for own in cells.values())
    (unseen,), (payload,), (friction,) = (cells[name] for name in names)
    assert mapped.rows[0][1][6] is unseen and unseen.size == "none" and unseen.unseen
    assert "not told from base tilt of the arm" in unseen.more
    assert 1.0 == unseen.dark > payload.dark > friction.dark == 0.0
    assert payload.size == "1.00 N·m" and "told last from noise" in payload.more


def test_white_noise_of_closer_rows_is_as_loud_per_hz() -> None:
    (one,) = white_noise(np.array([2.0]), 0.032, 0.008)
    assert one.deviation == pytest.approx(4.0) and one.coefficients.size == 0
