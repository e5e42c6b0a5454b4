"""Model files: what is written is read back, the same each time, and a wrong file is one line."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from daq.files.checksum import ChecksumError, source_sha256
from daq.files.model_file import (
    ModelEstimate,
    ModelFile,
    ModelFileError,
    ModelParameter,
    ModelRobot,
    ModelSource,
    read_model,
    write_model,
)
from daq.files.model_found import ModelFound, ModelTerm
from ident import Fitted
from robots import Robot
from robots.allowed import keys_of
from tests.daq.models import COULOMB, MASS, carriage, endogenous

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "model-file.md"


@pytest.fixture(scope="module")
def fitted(emps: Robot) -> Fitted:
    return carriage(emps)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "carriage.csv"
    path.write_text("t,q,v\n")
    return path


@pytest.fixture
def written(tmp_path: Path, fitted: Fitted, log: Path, emps: Robot) -> Path:
    path = tmp_path / "emps.model.toml"
    write_model(path, fitted, [log], emps)
    return path


def test_what_is_written_is_read_back(tmp_path: Path, fitted: Fitted, log: Path, emps: Robot) -> None:
    path = tmp_path / "emps.model.toml"
    model = write_model(path, fitted, [log], emps)
    assert read_model(path) == model
    estimate = fitted.result.least_squares
    assert [(p.name, p.value, p.sigma, p.unit, p.expression) for p in model.parameter] == [
        (p.name, p.value, p.sigma, p.unit, p.expression) for p in estimate.parameters
    ]
    assert model.estimate.estimator == "ls"
    assert model.estimate.verdict == "not_testable"
    assert model.estimate.rows == fitted.result.rows
    assert model.effects == tuple(effect.name for effect in fitted.base.model.effects)
    assert model.identification == emps.identification
    assert model.armhil == version("armhil")
    assert model.robot == ModelRobot(name="emps", sha256=sha256(emps.source_text.encode()).hexdigest())
    assert model.capture == (ModelSource(name="carriage.csv", sha256=sha256(log.read_bytes()).hexdigest()),)


def test_any_toml_reader_finds_the_values(written: Path) -> None:
    content = tomllib.loads(written.read_text(encoding="utf-8"))
    values = {entry["name"]: entry["value"] for entry in content["parameter"]}
    mass = next(value for name, value in values.items() if name.startswith(("m", "M")))
    assert mass == pytest.approx(MASS, rel=0.02)
    assert values["Fc1"] == pytest.approx(COULOMB, rel=0.05)


def test_the_verdict_chooses_the_estimator(tmp_path: Path, fitted: Fitted, log: Path, emps: Robot) -> None:
    model = write_model(tmp_path / "emps.model.toml", endogenous(fitted), [log], emps)
    assert model.estimate.estimator == "iv"
    assert model.parameter[0].value == pytest.approx(1.01 * fitted.result.least_squares.parameters[0].value)


def test_the_same_model_is_the_same_file(written: Path, fitted: Fitted, log: Path, emps: Robot) -> None:
    before = written.read_bytes()
    write_model(written, fitted, [log], emps)
    assert written.read_bytes() == before


def test_a_folder_has_a_checksum_of_names_and_contents(tmp_path: Path) -> None:
    folder = tmp_path / "log"
    folder.mkdir()
    (folder / "b.csv").write_text("1")
    (folder / "a.csv").write_text("2")
    before = source_sha256(folder)
    lines = [f"{sha256(text).hexdigest()}  {name}\n" for text, name in ((b"2", "a.csv"), (b"1", "b.csv"))]
    assert before == sha256("".join(lines).encode()).hexdigest()
    (folder / "a.csv").rename(folder / "c.csv")
    assert source_sha256(folder) != before


def test_a_recording_that_is_gone_is_one_line(tmp_path: Path, fitted: Fitted, emps: Robot) -> None:
    with pytest.raises(ChecksumError, match=r"none\.mcap: cannot be read: No such file or directory"):
        write_model(tmp_path / "emps.model.toml", fitted, [tmp_path / "none.mcap"], emps)


def test_a_folder_that_is_not_there_is_one_line(
    tmp_path: Path, fitted: Fitted, log: Path, emps: Robot
) -> None:
    with pytest.raises(ModelFileError, match="cannot be written: No such file or directory"):
        write_model(tmp_path / "none" / "emps.model.toml", fitted, [log], emps)


def test_values_that_are_not_finite_are_no_model(
    tmp_path: Path, fitted: Fitted, log: Path, emps: Robot
) -> None:
    estimate = fitted.result.least_squares
    broken = replace(estimate, parameters=(replace(estimate.parameters[0], sigma=float("nan")),))
    unsolved = replace(fitted, result=fitted.result.with_estimates(broken))
    path = tmp_path / "emps.model.toml"
    with pytest.raises(ModelFileError, match=r"emps: parameter\[1\]\.sigma: nan is not allowed") as caught:
        write_model(path, unsolved, [log], emps)
    assert "\n" not in str(caught.value)
    assert not path.exists()


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("format = 1", "format = 2", ":2: format: 2 is not allowed; allowed: 1"),
        ("format = 1\n", "", "format: missing; allowed: 1"),
        (
            'verdict = "',
            'verdict = "very_',
            'estimate.verdict: "very_not_testable" is not allowed; allowed: "exo',
        ),
        ("rows = ", "row = ", "estimate.row: "),
        ("rows = ", "rows = 0 # ", "estimate.rows: 0 is not allowed; allowed: a whole number, at least 1"),
        ("value = ", 'value = "1" # ', 'parameter[1].value: "1" is not allowed; allowed: a number'),
        ("value = ", "value = inf # ", "parameter[1].value: inf is not allowed"),
        (
            "sigma = ",
            "sigma = -1.0 # ",
            "parameter[1].sigma: -1.0 is not allowed; allowed: a number, at least 0",
        ),
        ("sha256 = ", 'sha256 = "12" # ', 'robot.sha256: "12" is not allowed; allowed: a text, like'),
        ("[robot]", "[robot", "not TOML: "),
        ('name = "Fc1"', 'name = "Fv1"', "parameter Fv1 is given twice"),
        ("cutoff_hz = ", "cutoff_hz = -", "identification.cutoff_hz: -100.0 is not allowed"),
        (
            "decimation = ",
            "decimatoin = ",
            "identification.decimatoin: 10 is given to a key that does not exist",
        ),
    ],
)
def test_a_wrong_file_is_one_line(old: str, new: str, reason: str, written: Path) -> None:
    text = written.read_text(encoding="utf-8")
    assert old in text
    written.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ModelFileError) as caught:
        read_model(written)
    assert str(caught.value).startswith(str(written))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"t,q\n1,2\n", b"a = " + b"[" * 5000])
def test_other_files_are_one_line(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.model.toml"
    path.write_bytes(content)
    with pytest.raises(ModelFileError, match=r"other\.model\.toml"):
        read_model(path)


def test_folders_and_absent_files_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match="cannot be read: Is a directory"):
        read_model(tmp_path)
    with pytest.raises(ModelFileError, match="no such file; allowed: a model file"):
        read_model(tmp_path / "none.model.toml")


@given(place=st.integers(0, 2000), byte=st.integers(0, 255))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_with_a_changed_byte_is_a_model_or_one_line(place: int, byte: int, written: Path) -> None:
    content = bytearray(written.read_bytes())
    content[place % len(content)] = byte
    changed = written.with_name("changed.model.toml")
    changed.write_bytes(content)
    assert "\n" not in complaint(changed)


def complaint(path: Path) -> str:
    """What is wrong with the file; empty where it is a model."""
    try:
        assert isinstance(read_model(path), ModelFile)
    except ModelFileError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("heading", "model"),
    [
        ("## Top level", ModelFile),
        ("## [robot]", ModelRobot),
        ("## [estimate]", ModelEstimate),
        ("## [[capture]]", ModelSource),
        ("## [[found]]", ModelFound),
        ("## [[term]]", ModelTerm),
        ("## [[parameter]]", ModelParameter),
    ],
)
def test_the_reference_has_every_key(heading: str, model: type[BaseModel]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    section = re.split(r"\n## ", text[text.index(f"\n{heading}\n") + 1 :])[0]
    assert re.findall(r"^\| `(\w+)`", section, re.MULTILINE) == list(keys_of(model))
