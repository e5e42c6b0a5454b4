"""``[[term]]`` of a model file: written, read back as it was, and refused where it says two things."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import robots
from daq.diagnosis.diagnose import _examined, prior_of
from daq.diagnosis.diagnose_result import DiagnoseRequest
from daq.exporting.elsewhere.export import export_model
from daq.files.found_model import found_json, found_of_json, read_found_model
from daq.files.model_file import ModelFile, ModelFileError, model_of, read_model, write_model_file
from daq.files.toml_text import toml_text
from ident import Fitted, IdentificationError, identify
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import diagnose_with_evidence
from ident.effects.entry import EffectEntry
from ident.effects.vocabulary import VOCABULARY
from ident.identification.found_effects import FoundModel, extended_model
from ident.identification.options import Options
from tests.ident.discrepancy.by_evidence.test_terms import dragged

EMPS = robots.load("emps")
DRAG = {
    "joint": 1,
    "formula": "q̇₁·|q̇₁|",
    "coefficient": 800.0,
    "sigma": 5.0,
    "unit": "N·s²/m²",
    "looks_like": "drag of air or lubricant, an eddy-current brake, a hose",
    "source": "armhil diagnose of night.mcap",
}


def fitted(known: FoundModel | None = None) -> Fitted:
    return identify(EMPS, (dragged(2, 7),), options=Options(found=known))


@pytest.fixture(scope="module")
def plain() -> Fitted:
    return fitted()


@pytest.fixture(scope="module")
def content(plain: Fitted) -> dict[str, Any]:
    """A model with a term, as plain values."""
    values = model_of(plain, [Path(__file__)], EMPS).model_dump()
    factor = {"name": "q̇₁·|q̇₁|@1", "value": 800.0, "sigma": 5.0, "unit": "N·s²/m²"}
    factor |= {"expression": "q̇₁·|q̇₁|@1", "correlation": (0.0,) * len(values["parameter"])}
    return values | {
        "effects": (*values["effects"], "term: q̇₁·|q̇₁|"),
        "term": (DRAG,),
        "parameter": (*values["parameter"], factor),
    }


def test_an_identification_goes_on_with_the_term(
    content: dict[str, Any], plain: Fitted, tmp_path: Path
) -> None:
    """Drag put into the recording: its factor is identified beside the usual parameters."""
    path = tmp_path / "emps.model.toml"
    write_model_file(path, ModelFile.model_validate(content))
    assert read_model(path) == ModelFile.model_validate(content)
    known = read_found_model(path, EMPS)
    assert found_of_json(found_json(known)) == known
    whole = fitted(known)
    before, after = (one.result.recommended.relative_error_percent for one in (plain, whole))
    assert after < 0.9 * before  # reversals are in these rows
    (term,) = model_of(whole, [path], EMPS).term
    assert term.coefficient == pytest.approx(900.0, abs=4.0 * term.sigma)
    assert (term.formula, term.source, term.looks_like) == (
        DRAG["formula"],
        DRAG["source"],
        DRAG["looks_like"],
    )
    (lost,) = [
        line
        for one in export_model(path, EMPS, tmp_path / "out", ("c",))
        for line in one.lost
        if line.startswith("Term")
    ]
    assert lost == "Term without a name at joint 1: 800 · q̇₁·|q̇₁|, SI."


@pytest.mark.slow
def test_a_diagnosis_beside_a_prior_goes_on_with_the_term(content: dict[str, Any], tmp_path: Path) -> None:
    """The arm of the accepted model is clean with its term, whose factor is fitted again."""
    path = tmp_path / "emps.model.toml"
    write_model_file(path, ModelFile.model_validate(content))
    write_model_file(path, model_of(fitted(read_found_model(path, EMPS)), [path], EMPS))
    request = DiagnoseRequest((path,), prior=str(path))
    whole = _examined(EMPS, request, dragged(0, 2))
    question = Question(EMPS, (dragged(0, 2),), (dragged(1, 3),), VOCABULARY, prior_of(str(path)), whole)
    found, _ = diagnose_with_evidence(question, sizes=False)
    assert found.verdict == "clean" and found.findings == ()
    assert found.base.names[-1] == "q̇₁·|q̇₁|@1" and found.beta[-1] == pytest.approx(900.0, rel=0.02)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"coefficient": 801.0}, "801.0 ± 5.0 N·s²/m²; allowed: as parameter q̇₁·|q̇₁|@1, 800.0 ± 5.0"),
        ({"unit": "N"}, "allowed: as parameter"),
        ({"sigma": 4.0}, "allowed: as parameter"),
        ({"joint": 2}, "parameter q̇₁·|q̇₁|@2 is missing"),
        ({"formula": "q̇₁³"}, "parameter q̇₁³@1 is missing"),
        ({"power": 2}, "power"),
    ],
)
def test_a_term_that_says_something_else_than_the_model_is_refused(
    content: dict[str, Any], change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    path = tmp_path / "emps.model.toml"
    path.write_text(toml_text(content | {"term": (DRAG | change,)}), encoding="utf-8")
    with pytest.raises(ModelFileError) as error:
        read_model(path)
    assert words in str(error.value) and "\n" not in str(error.value)


def test_effects_and_terms_have_to_be_the_same(content: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "emps.model.toml"
    for changed in ({"term": ()}, {"effects": content["effects"][:-1]}):
        path.write_text(toml_text(content | changed), encoding="utf-8")
        with pytest.raises(ModelFileError, match="those of effects"):
            read_model(path)


def test_a_term_that_the_arm_cannot_have_is_no_column(content: dict[str, Any]) -> None:
    values = {one["name"]: one["value"] for one in content["parameter"]}
    known = FoundModel.of("x.model.toml", content["effects"], (EffectEntry("term: q̇₄", (1,), {}),), values)
    with pytest.raises(IdentificationError, match="term q̇₄: no formula of emps"):
        extended_model(EMPS, known)
