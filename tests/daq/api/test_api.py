"""The Python interface: strings are paths, results say, tabulate and draw themselves."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from daq import api as armhil
from daq.api.frames import NoPandas
from daq.api.search import NoModelFile
from robots.errors import UserError


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("api")
    return str(armhil.simulated_recording(str(folder / "first.mcap"), "emps", seed=2, duration=4.0))


@pytest.fixture(scope="module")
def model(capture: str) -> armhil.IdentifiedModel:
    return armhil.identify(capture, out=str(Path(capture).parent / "model"))


def drawn(picture: armhil.Picture) -> int:
    """How many lines an SVG has that is well formed."""
    return len(ET.fromstring(picture.svg).findall(".//{http://www.w3.org/2000/svg}path"))


def test_a_recording_by_its_name_as_a_string(capture: str) -> None:
    log = armhil.load_recording(capture)
    assert "8.0 s at 1000 Hz, with references" in log.summary()
    table = log.to_frame()
    assert list(table.columns) == ["piece", "t", "q_carriage", "v_carriage", "tau_carriage"]
    assert len(table) == len(log.loaded.recordings[0].time)
    assert drawn(log.plot()) == 2


def test_a_model_says_first_what_to_do_with_it(model: armhil.IdentifiedModel) -> None:
    assert model.summary().startswith("Model good to ")
    assert f"use {model.path}" in " ".join(model.summary().split())
    assert model.path is not None
    assert model.path.is_file()
    assert list(model.to_frame().index) == [p.name for p in model.estimate.parameters]
    assert list(model.to_frame()["half_width"]) == [p.half_width for p in model.estimate.parameters]
    assert drawn(model.plot()) == 2
    assert "M1R" in model.summary(parameters=True)


def test_the_arm_of_a_capture_lives_on_for_the_simulation(
    model: armhil.IdentifiedModel, capture: str
) -> None:
    """The description comes out of the capture; it has to be there after the identification."""
    run = armhil.simulate(model, armhil.load_recording(capture))
    away = run.to_frame()
    assert float((away["simulated_carriage"] - away["q_carriage"]).abs().max()) < 1e-3
    assert "carriage" in run.summary()
    assert drawn(run.plot()) == 1


def test_the_same_recording_again_has_not_drifted(model: armhil.IdentifiedModel) -> None:
    assert not armhil.drift([model, model]).moved


def test_a_capture_is_never_overwritten(capture: str) -> None:
    with pytest.raises(UserError, match="never overwritten"):
        armhil.simulated_recording(capture, "emps")


def test_a_prior_that_was_never_written_is_refused(capture: str, model: armhil.IdentifiedModel) -> None:
    unwritten = armhil.IdentifiedModel(model.fitted)
    with pytest.raises(NoModelFile, match="out=FOLDER"):
        armhil.diagnose(capture, split_half=True, prior=unwritten)


def test_without_pandas_there_is_one_line(
    model: armhil.IdentifiedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(NoPandas, match="-m pip install pandas"):
        model.to_frame()
