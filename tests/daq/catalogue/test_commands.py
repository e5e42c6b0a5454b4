"""armhil runs, show, note, rerun, compare and prune, on captures of the simulated one-axis arm."""

from __future__ import annotations

import json
import re
import shutil
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.catalogue import baselines, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_capture
from daq.catalogue.kept_run import kept_run
from daq.files.checksum import file_sha256
from daq.identification.identify import IdentifyRequest, run_identify
from daq.keeping import prune
from daq.keeping.again import identify_settings
from daq.keeping.compare import compare
from daq.keeping.keep import Provenance, keep_identified
from daq.recording.capture import RUN
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.who import now
from daq.text.progress import Silent
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from ident import Fitted
from robots import Robot
from tests.daq.calls import Call
from tests.daq.captures import facts, outcome
from tests.daq.identification.test_identify_command import back_and_forth


@pytest.fixture(scope="module")
def recorded(emps: Robot, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Captures of two arms of the same description, seeds 2 and 3."""
    folder = tmp_path_factory.mktemp("captures")
    paths = folder / "two.mcap", folder / "three.mcap"
    for seed, path in zip((2, 3), paths, strict=True):
        run = simulate_offline(emps, draw_truth(emps, seed), back_and_forth(emps))
        with Recorder(path, emps, facts(emps, emps.bus.cycle_time)) as recorder:
            recorder.write(run.samples())
            recorder.finish(outcome(len(run.cycle)))
    return paths


@pytest.fixture(scope="module")
def fits(recorded: tuple[Path, Path]) -> list[tuple[IdentifyRequest, Fitted]]:
    """What is identified from each of them."""
    requests = [IdentifyRequest((path,), rate_hz=100.0) for path in recorded]
    return [(request, run_identify(request, Silent()).fitted) for request in requests]


@pytest.fixture
def pair(
    recorded: tuple[Path, Path], fits: list[tuple[IdentifyRequest, Fitted]], tmp_path: Path
) -> tuple[Path, Path]:
    """Copies that a test may delete, each run and identified in the catalogue: runs 1 and 2."""
    copies = []
    with Catalogue() as catalogue:
        for path, (request, fitted) in zip(recorded, fits, strict=True):
            copy = Path(shutil.copy(path, tmp_path / path.name))
            identity = identity_of_capture(read_capture(copy))
            with kept_run(catalogue, identity, "run", trajectory="sines", facts={"seed": 2}) as kept:
                kept.outcome, kept.capture = "completed", copy
            robot = fitted.base.model.robot
            keep_identified(
                catalogue, fitted, Provenance(robot, [copy], identify_settings(request)), kept.number
            )
            copies.append(copy)
    return copies[0], copies[1]


@pytest.mark.slow
def test_runs_and_show(pair: tuple[Path, Path], ask: Any, armhil: Call) -> None:
    listed = ask("runs")["runs"]
    assert [(run["run"], run["arm"], run["kind"], run["outcome"]) for run in listed] == [
        (2, "emps", "run", "completed"),
        (1, "emps", "run", "completed"),
    ]
    assert [run["run"] for run in ask("runs", "--limit", 1)["runs"]] == [2]
    assert ask("runs", "--kind", "demo")["runs"] == []
    shown = ask("show", 1)
    assert shown["capture"] == str(pair[0]) and shown["capture_sha256"] == file_sha256(pair[0])
    assert shown["capture_state"] == "intact"
    (model,) = shown["models"]
    assert model["settings"]["rate_hz"] == 100.0 and model["settings"]["command"] == "identify"
    assert {"Fv1", "Fc1"} <= {parameter["name"] for parameter in model["parameters"]}
    code, out, _ = armhil("show", 1)
    assert code == 0 and str(pair[0]) in out.replace("\n", "") and "as it was recorded" in out
    pair[0].chmod(0o644)
    pair[0].write_bytes(b"something else")
    assert ask("show", 1)["capture_state"] == "changed"
    pair[0].unlink()
    assert ask("show", 1)["capture_state"] == "gone"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["show", 9], "run 9: is not in the catalogue; `armhil runs` lists those that are"),
        (["note", 9, "x"], "run 9: is not in the catalogue; `armhil runs` lists those that are"),
        (["rerun", 9], "run 9: is not in the catalogue; `armhil runs` lists those that are"),
        (["compare", 9, 9], "run 9: is not in the catalogue; `armhil runs` lists those that are"),
        (["runs", "--arm", "x"], "arm x: is not in the catalogue; allowed: none, nothing has been run yet"),
        (["runs", "--kind", "x"], "--kind x; allowed: demo, plan, check, commission, import, run"),
    ],
)
def test_what_is_not_there_is_one_line(armhil: Call, arguments: list[object], told: str) -> None:
    code, out, err = armhil(*arguments)
    assert (code, out, err) == (2, "", f"armhil: {told}\n")


@pytest.mark.parametrize("width", [80, 120])
def test_the_list_has_room_for_its_words(
    pair: tuple[Path, Path], armhil: Call, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    """Where there is no room for trajectory and note, what was noted is shown."""
    monkeypatch.setenv("COLUMNS", str(width))
    _, out, _ = armhil("runs")
    assert "sines" in out and "note" not in out and "…" not in out
    armhil("note", 1, "cover of joint 3 was off")
    _, out, _ = armhil("runs")
    lines = [line for line in out.splitlines() if line.strip()]
    assert max(map(len, lines)) <= width and "cover of" in out and "…" not in out
    assert ("sines" in out) == (width > 100)


def test_an_empty_catalogue_says_so(armhil: Call) -> None:
    assert armhil("runs") == (0, "No runs. `armhil demo` makes one.\n", "")


def test_notes(pair: tuple[Path, Path], ask: Any) -> None:
    ask("note", 1, "cold [start]")
    assert ask("note", 1, "joint 1 noisy")["note"] == "cold [start]\njoint 1 noisy"
    assert ask("show", 2)["note"] is None


def test_again_is_identical_to_the_last_bit(pair: tuple[Path, Path], ask: Any, armhil: Call) -> None:
    again = ask("rerun", 1)
    assert (again["sameness"], again["largest_difference"], again["remarks"]) == ("identical", 0.0, [])
    (model,) = ask("show", 1)["models"]
    assert again["parameters"] == model["parameters"]
    code, out, _ = armhil("rerun", 1)
    assert code == 0 and "IDENTICAL" in out


def test_again_tells_what_differs(pair: tuple[Path, Path], armhil: Call, tmp_path: Path) -> None:
    with Catalogue() as catalogue, catalogue.writing() as connection:
        shift = "UPDATE parameters SET value = value + 2 * sigma WHERE model_id = 1 AND name = 'Fc1'"
        connection.exec_driver_sql(shift)
        connection.exec_driver_sql("UPDATE models SET armhil = '0.0.1' WHERE id = 1")
    code, out, _ = armhil("rerun", 1, "--json", "--out", tmp_path / "again")
    again = json.loads(out)
    assert (code, again["sameness"], again["largest_parameter"]) == (1, "different", "Fc1")
    assert again["largest_difference"] == pytest.approx(2.0)
    assert again["remarks"][0].startswith("armhil was 0.0.1 then and is ")
    assert Path(again["report"]).is_file()
    with Catalogue() as catalogue:
        first, kept = models.of_run(catalogue, 1)
        assert kept.report == again["report"] and kept.settings == first.settings
    code, out, _ = armhil("rerun", 1, "--json")
    assert json.loads(out)["sameness"] == "identical"
    with Catalogue() as catalogue, catalogue.writing() as connection:
        connection.exec_driver_sql("UPDATE parameters SET value = value * (1 + 1e-14) WHERE model_id = 3")
    code, out, _ = armhil("rerun", 1, "--json")
    assert (code, json.loads(out)["sameness"]) == (0, "rounding")


def test_another_file_is_never_taken_for_the_recording(pair: tuple[Path, Path], armhil: Call) -> None:
    pair[0].unlink()
    code, _, err = armhil("rerun", 1)
    assert (code, err) == (2, f"armhil: run 1: its recording {pair[0]} is gone\n")
    shutil.copy(pair[1], pair[0])
    code, _, err = armhil("rerun", 1)
    assert code == 2 and f"run 1: {pair[0]} is not the recording of then" in err


def test_a_run_that_was_never_identified(recorded: tuple[Path, Path], ask: Any) -> None:
    with Catalogue() as catalogue:
        identity = identity_of_capture(read_capture(recorded[0]))
        with kept_run(catalogue, identity, "run") as kept:
            kept.outcome, kept.capture = "completed", recorded[0]
        runs.begin(catalogue, identity, "run")
    assert ask("rerun", 1)["sameness"] == "first"


def test_two_runs_side_by_side(pair: tuple[Path, Path], ask: Any, armhil: Call) -> None:
    answer = ask("compare", 1, 2)
    with Catalogue() as catalogue:
        a, b = models.latest_of(catalogue, 1), models.latest_of(catalogue, 2)
        found = compare(catalogue, 1, 2)
    for entry, p, q in zip(answer["parameters"], a.parameters, b.parameters, strict=True):
        assert (entry["name"], entry["values"]) == (p.name, [p.value, q.value])
        expected = (q.value - p.value) / np.sqrt(p.sigma**2 + q.sigma**2)
        assert entry["difference_in_sigma"] == pytest.approx(expected)
    assert max(abs(entry["difference_in_sigma"]) for entry in answer["parameters"]) > 3
    assert found.torque is not None
    assert answer["torque_difference"]["rms"] == found.torque.rms.tolist()
    same = ask("compare", 1, 1)
    assert all(entry["difference"] == 0.0 for entry in same["parameters"])
    assert same["torque_difference"] == {"rms": [0.0], "share_percent": [0.0]}
    code, out, _ = armhil("compare", 1, 2)
    said = " ".join(out.split())
    assert code == 0 and re.search(
        r"Torque between them on the motion of run 1, rms per joint: [\d.]+ N \(", said
    )
    assert len(re.findall(r"rms per joint [\d.]+ N\b", said)) == 2 and "N·m" not in said, "its axis slides"
    pair[0].unlink()
    assert ask("compare", 1, 2)["torque_reason"] == f"run 1: its recording {pair[0]} is gone"


def test_the_torque_between_two_models_is_that_of_the_regressor(pair: tuple[Path, Path]) -> None:
    """Coulomb friction alone: c·tanh(q̇/ε) has the rms of c where the axis moves fast enough."""
    with Catalogue() as catalogue:
        with catalogue.writing() as connection:
            copy = "SELECT 2, place, name, value, sigma, unit, expression FROM parameters WHERE model_id = 1"
            connection.exec_driver_sql("DELETE FROM parameters WHERE model_id = 2")
            connection.exec_driver_sql(f"INSERT INTO parameters {copy}")
            connection.exec_driver_sql(
                "UPDATE parameters SET value = value + 10 WHERE model_id = 2 AND name = 'Fc1'"
            )
        found = compare(catalogue, 1, 2)
    assert found.torque is not None
    assert found.torque.rms[0] == pytest.approx(10.0, rel=0.05)


def test_prune_asks_and_never_takes_what_a_baseline_rests_on(
    pair: tuple[Path, Path], armhil: Call, ask: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Catalogue() as catalogue:
        baselines.accept(catalogue, models.latest_of(catalogue, 1).id, "ann", "fine")
        foreign = Path(shutil.copy(pair[1], pair[1].with_name("foreign.mcap")))
        identity = identity_of_capture(read_capture(foreign))
        begun = runs.begin(catalogue, identity, "import", capture=str(foreign))
        runs.finish(catalogue, begun.id, "completed", capture_sha256=file_sha256(foreign))
    assert ask("prune")["deleted"] == [], "not old enough"
    would = ask("prune", "--older-than", 0, "--dry-run")
    assert [entry["run"] for entry in would["deleted"]] == [2] and would["dry_run"]
    assert {entry["run"]: entry["reason"] for entry in would["kept"]} == {
        1: "a baseline rests on it",
        3: "it was imported, not recorded by armhil",
    }
    code, _, err = armhil("prune", "--older-than", 0)
    assert code == 2 and "give --yes where nobody can answer" in err.splitlines()[-1]
    with monkeypatch.context() as patch:
        patch.setattr("daq.session.questions.answered", lambda *_, **__: False)
        code, out, _ = armhil("prune", "--older-than", 0)
        assert code == 0 and "0 recordings" in out.splitlines()[-1]
    assert all(path.exists() for path in (*pair, foreign))
    live = [path.with_suffix(".live") for path in pair]
    for path in live:
        path.write_text("{}\n", encoding="utf-8")
    done = ask("prune", "--older-than", 0, "--yes")
    assert [entry["run"] for entry in done["deleted"]] == [2]
    assert [path.exists() for path in live] == [True, False], "what others looked at goes with its recording"
    assert pair[0].exists() and foreign.exists() and not pair[1].exists()
    shown = ask("show", 2)
    assert (shown["capture"], shown["capture_state"], len(shown["models"])) == (None, "gone", 1)
    assert ask("prune", "--older-than", 0, "--yes")["deleted"] == []


def test_a_baseline_that_is_accepted_between_looking_and_deleting_is_kept(pair: tuple[Path, Path]) -> None:
    with Catalogue() as catalogue:
        planned = prune.plan_prune(catalogue, now() + timedelta(days=1))
        assert len(planned.prunable) == 2
        accepted = baselines.accept(catalogue, models.latest_of(catalogue, 2).id, "ann", "fine")
        baselines.roll_back(catalogue, accepted.arm_id, "ann", "taken back, and still kept")
        done = prune.prune(catalogue, planned)
    assert [entry.run.id for entry in done.prunable] == [1]
    assert [(entry.run.id, entry.reason) for entry in done.kept] == [(2, "a baseline rests on it")]
    assert pair[1].exists() and not pair[0].exists()


def test_a_file_in_the_place_of_a_recording_is_not_deleted(pair: tuple[Path, Path], ask: Any) -> None:
    pair[1].chmod(0o644)
    pair[1].write_text("my thesis")
    kept = ask("prune", "--older-than", 0, "--yes")["kept"]
    assert {"run": 2, "capture": str(pair[1]), "reason": "another file is in its place"} in kept
    assert pair[1].read_text() == "my thesis"


def test_identify_keeps_what_it_writes_and_nothing_else(
    recorded: tuple[Path, Path], armhil: Call, ask: Any, tmp_path: Path
) -> None:
    armhil("identify", recorded[0])
    armhil("identify", recorded[0], "--out", tmp_path / "a", "--no-catalogue")
    assert ask("runs")["runs"] == []
    armhil("identify", recorded[0], "--out", tmp_path / "b", "--method", "ls")
    armhil("identify", recorded[0], "--out", tmp_path / "c", "--rate", 50)
    (run,) = ask("runs")["runs"]
    assert (run["kind"], run["capture"]) == ("import", str(recorded[0]))
    first, second = ask("show", 1)["models"]
    assert first["method"] == "ls" and second["settings"]["rate_hz"] == 50.0
    assert first["file"] == str(tmp_path / "b" / "emps.model.toml") and Path(first["report"]).is_file()
    assert ask("rerun", 1)["sameness"] == "identical"


def with_serials(emps: Robot, path: Path, serial: int) -> Path:
    """A capture of the arm whose drive has a serial number."""
    known = facts(emps, emps.bus.cycle_time)
    drives = json.dumps([{"joint": 1, "node": 1, "vendor": 2, "product": 3, "serial": serial}])
    run = simulate_offline(emps, draw_truth(emps, 2), back_and_forth(emps))
    with Recorder(path, emps, {**known, RUN: {**known[RUN], "drives": drives}}) as recorder:
        recorder.write(run.samples())
        recorder.finish(outcome(len(run.cycle)))
    return path


def test_recordings_of_two_arms_make_no_model_together(emps: Robot, armhil: Call, tmp_path: Path) -> None:
    paths = [with_serials(emps, tmp_path / f"{serial}.mcap", serial) for serial in (7, 8)]
    code, _, err = armhil("identify", *paths)
    assert (code, err.splitlines()[-1]) == (
        2,
        f"armhil: {paths[1]}: is of another arm than {paths[0]}:"
        " the drive of joint 1 has serial number 8 there and 7 here",
    )
    code, out, err = armhil("identify", paths[0], "--validate", paths[1], "--json")
    assert code in (0, 1)
    assert json.loads(out)["warnings"][0].startswith("8.mcap is of another arm: the drive of joint 1")


def test_a_recording_that_is_read_with_another_description_is_told(
    emps: Robot, recorded: tuple[Path, Path], armhil: Call, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(emps.folder, tmp_path / "edited"))
    text = (folder / "robot.toml").read_text(encoding="utf-8")

    def warnings() -> list[str]:
        found: list[str] = json.loads(armhil("identify", recorded[0], "--robot", folder, "--json")[1])[
            "warnings"
        ]
        return found

    assert not any("robot.toml" in warning or "read as" in warning for warning in warnings())
    (folder / "robot.toml").write_text(f"{text}# edited\n", encoding="utf-8")
    assert not any("description" in warning for warning in warnings())  # a comment says nothing of the arm
    (folder / "robot.toml").write_text(text.replace("jerk = 100.0", "jerk = 101.0"), encoding="utf-8")
    assert warnings()[0] == "two.mcap was recorded with another description: other robot.toml"
    (folder / "robot.toml").write_text(text.replace('name = "emps"', 'name = "mine"', 1), encoding="utf-8")
    assert warnings()[0] == "two.mcap is a recording of emps, read as mine"


def test_a_run_that_fails_or_is_interrupted_says_so(emps: Robot, recorded: tuple[Path, Path]) -> None:
    identity = identity_of_capture(read_capture(recorded[0]))

    def fail(error: BaseException) -> None:
        with kept_run(catalogue, identity, "run"):
            raise error

    with Catalogue() as catalogue:
        with pytest.raises(ValueError, match=r"no\spower"):
            fail(ValueError("no\npower"))
        with pytest.raises(KeyboardInterrupt):
            fail(KeyboardInterrupt())
        second, first = runs.every(catalogue)
    assert (first.state, first.outcome, first.reason) == ("finished", "failed", "no power")
    assert (second.outcome, second.reason) == ("stopped", "KeyboardInterrupt")


def test_without_a_catalogue_nothing_is_kept(own_catalogue: Path, recorded: tuple[Path, Path]) -> None:
    with kept_run(None, identity_of_capture(read_capture(recorded[0])), "run") as kept:
        assert kept.number is None
    assert not own_catalogue.exists()
