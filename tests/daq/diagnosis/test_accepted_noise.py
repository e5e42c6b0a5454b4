"""A model file says how loud the arm was, and the search holds the noise of today against it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robots
from daq.diagnosis.diagnose import prior_of, run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest
from daq.files.model_file import read_model
from daq.identification.identify import IdentifyRequest, run_identify
from daq.identification.torque_noise import torque_noise
from daq.importing.load import load_recording
from daq.text.progress import Silent
from drivers.simulated import draw_truth
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording, RegressorModel, base_parameters, identify
from ident.discrepancy import Diagnosis, Prior, Question, accepted_noise
from ident.discrepancy.by_evidence import accepted_prior, diagnose_with_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from tests.daq.diagnosis.offline_bench import OfflineBench
from trajectories import plan

LOUDER = 2.0


@pytest.fixture(scope="module")
def rig() -> Robot:
    return robots.load("emps")


@pytest.fixture(scope="module")
def captures(rig: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Accepted, and later: louder, on the same motion and on another."""
    folder = tmp_path_factory.mktemp("louder")
    truth = draw_truth(rig, 5)
    for name, seed, noise in (("accepted", 0, 1.0), ("fit", 0, LOUDER), ("validation", 1, LOUDER)):
        motion = plan(rig, cycle_time=rig.bus.cycle_time, duration=5.0, seed=seed, evaluations=40, periods=2)
        scenario = Scenario.from_dict({"format": 1, "noise": {"torque": noise, "encoder": noise}})
        OfflineBench(rig, truth, scenario, runs=10 * seed + int(noise)).stream(
            motion, folder / f"{name}.mcap"
        )
    run_identify(IdentifyRequest((folder / "accepted.mcap",), robot="emps", out=folder / "model"), Silent())
    return folder


def command(captures: Path, model: Path) -> Diagnosis:
    request = DiagnoseRequest(
        (captures / "fit.mcap",), (captures / "validation.mcap",), robot="emps", prior=str(model)
    )
    return run_diagnose(request, Silent()).diagnosis


def times_louder(found: Diagnosis) -> float:
    return float(found.unrepeated[0].sentence.split("noise is ")[1].split(" times")[0])


def search(rig: Robot, accepted: Recording, fit: Recording, validation: Recording) -> Diagnosis:
    """Without any file."""
    estimate = identify(rig, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(estimate.values, estimate.covariance, noise)

    return diagnose_with_evidence(Question(rig, (fit,), (validation,), VOCABULARY, prior), sizes=False)[0]


def test_a_louder_joint_is_noticed_by_the_command_as_by_the_search(rig: Robot, captures: Path) -> None:
    found = command(captures, captures / "model" / "emps.model.toml")
    names = ("accepted", "fit", "validation")
    recordings = [load_recording(captures / f"{name}.mcap", rig).recordings[0] for name in names]
    other = search(rig, *recordings)
    assert [item.kind for item in found.unrepeated] == ["louder"]
    assert "joint 1: torque noise is" in found.description
    assert (found.verdict, found.findings) == ("unnamed", ())
    assert (other.verdict, [item.kind for item in other.unrepeated]) == ("unnamed", ["louder"])
    # Each aligns the accepted recording for itself, by itself or as those of today.
    assert times_louder(other) == pytest.approx(times_louder(found), abs=0.011)
    assert times_louder(found) == pytest.approx(LOUDER, rel=0.1)
    # Each prepares its recordings by itself: the same to rounding.
    np.testing.assert_allclose(other.beta, found.beta, rtol=1e-12)


def test_noise_that_is_not_known_or_of_another_filter_is_no_measure(captures: Path, tmp_path: Path) -> None:
    text = (captures / "model" / "emps.model.toml").read_text(encoding="utf-8")
    known = next(line for line in text.splitlines() if line.startswith("torque_noise"))
    path = tmp_path / "emps.model.toml"
    for changed in (text.replace(known, "torque_noise = []"), text.replace("cutoff_hz = ", "cutoff_hz = 1")):
        path.write_text(changed, encoding="utf-8")
        prior = prior_of(str(path))
        assert prior is not None
        assert prior(base_of("emps")).noise is None
    as_written = prior_of(str(captures / "model" / "emps.model.toml"))
    assert as_written is not None
    assert as_written(base_of("emps")).noise is not None


def base_of(name: str) -> BaseParameters:
    return base_parameters(RegressorModel.of(robots.load(name)))


def test_the_noise_is_that_of_the_arm(captures: Path, rig: Robot) -> None:
    noise = read_model(captures / "model" / "emps.model.toml").estimate.torque_noise
    assert len(noise) == rig.n
    louder = load_recording(captures / "fit.mcap", rig).recordings
    fitted = identify(rig, louder)
    assert torque_noise(rig, fitted.base.model.effects, louder)[0] == pytest.approx(
        LOUDER * noise[0], rel=0.1
    )


def test_where_nothing_repeats_the_noise_is_not_known(shared_data: Path) -> None:
    arm = robots.load("tx40")
    recordings = load_recording(shared_data / "tx40", arm).recordings
    assert torque_noise(arm, RegressorModel.of(arm).effects, recordings) == ()


def test_the_published_rig_repeats_its_motion(shared_data: Path, tmp_path: Path) -> None:
    log = shared_data / "emps" / "DATA_EMPS.mat"
    run_identify(IdentifyRequest((log,), robot="emps", out=tmp_path / "model"), Silent())
    noise = read_model(tmp_path / "model" / "emps.model.toml").estimate.torque_noise
    assert noise == (pytest.approx(0.3, abs=0.05),)
