"""A baseline with a term: the nights after it go on with the formula, as with what has a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from daq.catalogue import baselines, models
from daq.catalogue.database import Catalogue
from daq.check.request import CheckResult, Verdict
from daq.files.model_file import read_model
from daq.identification.identify import IdentifyRequest, run_identify
from daq.keeping.accepted_effects import effects_of
from daq.keeping.again import rerun
from daq.keeping.compare import compare
from daq.keeping.keep import keep_request
from daq.text.progress import Silent
from robots import Robot
from tests.daq.calls import Call
from tests.daq.check.test_found_effects import check, motion, nights, offline

__all__ = ["motion", "offline"]

RUBBING = "[[load_dependent_friction]]\ndrive = 1\ncoefficient = {mu}\n"


@pytest.mark.slow
def test_nights_go_on_with_a_term(
    emps: Robot, motion: Path, own_catalogue: Path, armhil: Call, tmp_path: Path
) -> None:
    """Quiet where the plant rubs as the formula says, loud where it no longer does; no file is needed."""
    night = nights(emps, motion, tmp_path)
    with Catalogue() as catalogue:
        first = check(night(catalogue, RUBBING.format(mu=0.3)))
        written = first.capture.parent / "emps.model.toml"
        file = tmp_path / "term.model.toml"
        file.write_text(with_term(written.read_text(encoding="utf-8")), encoding="utf-8")
        request = IdentifyRequest((first.capture,), out=tmp_path / "whole", model=file)
        result = run_identify(request, Silent())
        whole = keep_request(catalogue, request, result)
        assert whole is not None and [entry.name for entry in whole.found] == ["term: sign q̇₁·|load₁|"]
        (term,) = read_model(tmp_path / "whole" / "emps.model.toml").term
        assert term.coefficient == pytest.approx(0.3, abs=0.06)  # the rest is in the other friction
        known = effects_of(whole)
        assert known is not None and known.found[0].source == term.source == "by hand"
        report = (tmp_path / "whole" / "report.html").read_text(encoding="utf-8")
        assert "term: sign q̇₁·|load₁| (joint 1)" in report
        baselines.accept(catalogue, whole.id, "Ada", "stays as it is", None)
        file.unlink()
        same = check(night(catalogue, RUBBING.format(mu=0.3)))
        assert same.verdict is Verdict.OK, same.sentence
        kept = models.get(catalogue, same.model)
        assert kept.found == whole.found
        assert rerun(catalogue, same.run, Silent()).sameness == "identical"
        other = check(night(catalogue, RUBBING.format(mu=0.8)))
        assert other.verdict is not Verdict.OK and "term: sign q̇₁·|load₁| of joint 1" in other.sentence
        beside(catalogue, same, other, armhil)


def beside(catalogue: Catalogue, first: CheckResult, second: CheckResult, armhil: Call) -> None:
    """``armhil compare`` of two nights: the factor is a parameter like the others."""
    compared = compare(catalogue, first.run, second.run)
    assert compared.torque is not None and compared.torque.rms[0] > 1.0, compared.torque_reason
    (term,) = [one for one in compared.parameters if one.name == "sign q̇₁·|load₁|@1"]
    assert term.difference == pytest.approx(0.5, abs=0.15) and term.sigmas is not None and term.sigmas > 5.0
    code, out, err = armhil("compare", first.run, second.run)
    assert code == 0 and "sign q̇₁·|load₁|@1" in out + err


def with_term(text: str) -> str:
    """A model file with a term of nothing yet."""
    text = text.replace('"current_offset"]', '"current_offset", "term: sign q̇₁·|load₁|"]')
    head, parameters = text.split("[[parameter]]", 1)
    count = parameters.count("[[parameter]]") + 1
    term = """[[term]]
joint = 1
formula = "sign q̇₁·|load₁|"
coefficient = 0.2
sigma = 0.01
unit = "1"
looks_like = "a bearing or gear under load, a torque constant that droops"
source = "by hand"
"""
    factor = (
        '\n[[parameter]]\nname = "sign q̇₁·|load₁|@1"\nvalue = 0.2\nsigma = 0.01\nunit = "1"\n'
        f'expression = "sign q̇₁·|load₁|@1"\ncorrelation = [{", ".join(["0.0"] * count)}]\n'
    )
    return head.replace("term = []\n", "") + term + "\n[[parameter]]" + parameters + factor
