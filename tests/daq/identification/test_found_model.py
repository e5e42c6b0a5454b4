"""What a diagnosis has found goes on: diagnose, identify --model, diagnose --prior, and back from files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from daq.files.found_model import found_json, found_of_json, read_found_model
from daq.files.model_file import read_model
from daq.recording.recorder import Recorder
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from drivers.simulated.truth import draw_truth
from tests.daq.calls import Call
from tests.daq.captures import facts, outcome
from trajectories import plan

STRIBECK = {"stribeck_friction": [{"drive": 1, "rise": 2.0, "speed": 0.05}]}
LAGGING = {"hysteresis": [{"drive": 1, "torque": 6.0, "displacement": 0.003}]}
RUBBING = {"coulomb_friction": [{"drive": 1, "change": 0.3}]}


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of one carriage: as accepted, with friction that rises at low speed, and so on."""
    folder, arm = tmp_path_factory.mktemp("found"), robots.load("emps")
    motions = [
        plan(arm, cycle_time=0.001, duration=5.0, seed=seed, evaluations=200, periods=2) for seed in (0, 1)
    ]
    for number, (name, hidden, motion) in enumerate(
        (
            ("accepted", {}, 0),
            ("fit", STRIBECK, 0),
            ("validation", STRIBECK, 1),
            ("later", STRIBECK, 0),
            ("lagging", LAGGING, 0),
            ("lagging-too", LAGGING, 1),
            ("rubbing", RUBBING, 0),
            ("rubbing-too", RUBBING, 1),
        )
    ):
        scenario = Scenario.from_dict({"format": 1, **hidden})
        path = motions[motion].position[:5000]
        run = simulate_offline(arm, draw_truth(arm, 3), path, scenario=scenario, periods=2, seed=number)
        with Recorder(folder / f"{name}.mcap", arm, facts(arm)) as recorder:
            recorder.write(run.samples())
            recorder.finish(outcome(len(run.cycle)))
    return folder


def call(armhil: Call, *words: object, code: tuple[int, ...] = (0, 1)) -> dict[str, Any]:
    found, out, err = armhil(*words, "--json", "--no-catalogue")
    assert found in code, err
    content: dict[str, Any] = json.loads(out)
    return content


def model(folder: Path, name: str) -> Path:
    return folder / name / "emps.model.toml"


@pytest.fixture(scope="module")
def chain(captures: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the accepted model and that of the diagnosis are."""
    from daq.diagnosis.diagnose import run_diagnose
    from daq.diagnosis.diagnose_result import DiagnoseRequest
    from daq.identification.identify import IdentifyRequest, run_identify
    from daq.text.progress import Silent

    folder = tmp_path_factory.mktemp("chain")
    run_identify(IdentifyRequest((captures / "accepted.mcap",), out=folder / "accepted"), Silent())
    run_diagnose(
        DiagnoseRequest(
            (captures / "fit.mcap",),
            (captures / "validation.mcap",),
            prior=str(model(folder, "accepted")),
            out=folder / "why",
            evaluations=0,
        ),
        Silent(),
    )
    return folder


def test_an_identification_goes_on_with_what_was_found(
    armhil: Call, captures: Path, chain: Path, tmp_path: Path
) -> None:
    words = ("identify", captures / "fit.mcap", "--validate", captures / "validation.mcap")
    plain = call(armhil, *words)
    whole = call(armhil, *words, "--model", model(chain, "why"), "--out", tmp_path / "whole")
    before, after = (result["held_out"][0]["relative_error_percent"]["total"] for result in (plain, whole))
    assert after < 0.75 * before
    assert plain["found"] == []
    (entry,) = whole["found"]
    assert (entry["effect"], entry["joints"]) == ("stribeck_friction", [1])

    written, given = read_model(model(tmp_path, "whole")), read_model(model(chain, "why"))
    assert written.found == given.found and written.effects == given.effects
    assert [p.name for p in written.parameter] == [p.name for p in given.parameter]
    report = (tmp_path / "whole" / "report.html").read_text(encoding="utf-8")
    assert "stribeck friction (joint 1)" in report
    # The file says all that the identification was made of.
    again = call(armhil, *words, "--model", model(tmp_path, "whole"), "--out", tmp_path / "again")
    assert again["estimates"] == whole["estimates"] and again["test"] == whole["test"]
    assert model(tmp_path, "again").read_bytes() == model(tmp_path, "whole").read_bytes()


def diagnosed(armhil: Call, captures: Path, pair: tuple[str, str], prior: Path, out: Path) -> dict[str, Any]:
    """A diagnosis of one capture, shown on another, against a model."""
    fit, validation = (captures / f"{name}.mcap" for name in pair)
    words = ("diagnose", fit, "--validate", validation, "--prior", prior)
    return call(armhil, *words, "--out", out, "--evaluations", 0)


def test_what_was_found_before_is_not_found_again(
    armhil: Call, captures: Path, chain: Path, tmp_path: Path
) -> None:
    then = diagnosed(armhil, captures, ("later", "validation"), model(chain, "why"), tmp_path / "then")
    assert (then["verdict"], then["findings"]) == ("clean", []), then["description"]
    written = read_model(model(tmp_path, "then"))
    assert [entry.effect for entry in written.found] == ["stribeck_friction"]
    assert "Fs1" in [parameter.name for parameter in written.parameter]
    page = (tmp_path / "then" / "diagnosis.html").read_text(encoding="utf-8")
    assert "Found before" in page and "stribeck friction (joint 1)" in page


def nine_digits(content: Any) -> Any:
    """Of all numbers in it: rows are made in another order where a model is given."""
    return json.loads(json.dumps(content), parse_float=lambda text: f"{float(text):.9g}")


def test_more_of_what_the_model_has_a_parameter_for(
    armhil: Call, captures: Path, chain: Path, tmp_path: Path
) -> None:
    """The change of Coulomb friction has a name of its own in the file; a refit takes it up."""
    pair = ("rubbing", "rubbing-too")
    found = diagnosed(armhil, captures, pair, model(chain, "accepted"), tmp_path / "why")
    assert [finding["effect"] for finding in found["findings"]] == ["coulomb_friction"]
    values = read_found_model(model(tmp_path, "why"), robots.load("emps")).values
    assert list(values)[-1] == "Fc1_2" and values["Fc1_2"] == pytest.approx(0.3 * values["Fc1"], rel=0.1)

    fit = captures / "rubbing.mcap"
    whole = call(armhil, "identify", fit, "--model", model(tmp_path, "why"))
    plain = call(armhil, "identify", fit)
    assert whole["found"] == [] and nine_digits(whole["estimates"]) == nine_digits(plain["estimates"])
    assert any(text.startswith("coulomb friction (joint 1): without a prior") for text in whole["warnings"])


def test_the_noise_is_that_beside_what_was_found(
    armhil: Call, captures: Path, chain: Path, tmp_path: Path
) -> None:
    """The first period begins with a relaxed gear: with the effect in the model, that does not repeat."""
    pair = ("lagging", "lagging-too")
    found = diagnosed(armhil, captures, pair, model(chain, "accepted"), tmp_path / "why")
    assert [finding["effect"] for finding in found["findings"]] == ["hysteresis"]
    whole = ("--model", model(tmp_path, "why"), "--out", tmp_path / "whole")
    call(armhil, "identify", captures / "lagging.mcap", *whole)
    files = (model(tmp_path, "why"), model(tmp_path, "whole"), model(chain, "accepted"))
    why, refitted, before = (read_model(file).estimate.torque_noise[0] for file in files)
    assert why == pytest.approx(refitted, rel=0.1) and why > 1.1 * before


def test_out_of_the_file_and_out_of_json_it_is_the_same(chain: Path) -> None:
    found = read_found_model(model(chain, "why"), robots.load("emps"))
    assert found.usual[-1] == "current_offset" and found.found[0].shape["exponent"] == 1.0
    read = read_model(model(chain, "why"))
    np.testing.assert_array_equal(list(found.values.values()), read.values)
    assert found_of_json(json.loads(json.dumps(found_json(found)))) == found
    assert found_of_json(None) is None


def test_a_model_without_findings_is_the_usual_one(armhil: Call, captures: Path, chain: Path) -> None:
    fit = captures / "fit.mcap"
    same = call(armhil, "identify", fit, "--model", model(chain, "accepted"))
    assert same["estimates"] == call(armhil, "identify", fit)["estimates"]
    assert any("has no found effects" in text for text in same["warnings"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "emps"', 'name = "tx40"', "robot.name: tx40; allowed: a model of emps"),
        ("joints = [1]", "joints = [2]", "stribeck_friction at joints [2]; allowed: 1"),
        ('effect = "stribeck_friction"', 'effect = "rust"', "effect rust is not in the vocabulary"),
        ('name = "Fv1"', 'name = "Fv9"', "has no parameter Fv1; allowed"),
    ],
)
@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_file_that_is_not_of_this_arm_is_one_line(
    armhil: Call, captures: Path, chain: Path, tmp_path: Path, command: str, old: str, new: str, said: str
) -> None:
    text = model(chain, "why").read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "wrong.model.toml"
    wrong.write_text(text.replace(old, new), encoding="utf-8")
    option = ("--model", wrong) if command == "identify" else ("--prior", wrong, "--split-half")
    code, _, err = armhil(command, captures / "fit.mcap", *option, "--no-catalogue")
    assert code == 2
    lines = [line for line in " ".join(err.split("armhil: ")[1:]).split("\n") if line]
    assert "".join(lines).startswith(str(wrong)) and said in " ".join(lines)
