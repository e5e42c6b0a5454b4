"""The answer comes first, says what to use only of a model that may be trusted, and fits into 80 columns."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.cells import cell_len

from daq.cli.common import code_of
from daq.files.model_file import model_of
from daq.identification.answer import answer_of
from daq.identification.terminal import print_identification
from daq.report.gates import verdict_view
from daq.text.wrapped import WordConsole
from ident import Fitted
from ident.verdicts import Verdict
from robots import Robot
from tests.daq.models import carriage, endogenous

MODEL = Path("runs/first/emps.model.toml")


@pytest.fixture(scope="module")
def fitted(emps: Robot) -> Fitted:
    return endogenous(carriage(emps))


def with_verdict(fitted: Fitted, verdict: Verdict) -> Fitted:
    test = replace(fitted.result.test, verdict=verdict, recommendation="As the gates say.")
    return replace(fitted, result=replace(fitted.result, test=test))


def text_of(fitted: Fitted, *, parameters: bool = False) -> str:
    console = WordConsole(file=io.StringIO(), width=80, force_terminal=True, color_system=None)
    print_identification(console, fitted, model=MODEL, parameters=parameters)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_the_first_sentence_says_how_good_what_to_use_and_what_is_not_seen(fitted: Fitted) -> None:
    first = " ".join(text_of(fitted).strip().splitlines()[:2])
    error = fitted.result.recommended.relative_error_percent
    assert first.startswith(f"Model good to {error:.3g}")
    assert f"use {MODEL}" in first
    assert "all 4 parameters seen" in first


def test_parameters_with_a_large_sigma_are_counted(fitted: Fitted) -> None:
    vague = tuple(
        replace(p, sigma=abs(p.value)) if p.name.startswith("F") else p
        for p in fitted.result.recommended.parameters
    )
    result = fitted.result.with_estimates(replace(fitted.result.recommended, parameters=vague))
    assert "2 of 4 parameters not seen" in answer_of(result, MODEL).sentence


@pytest.mark.parametrize("verdict", ["instruments_invalid", "not_testable"])
def test_a_model_that_must_not_be_trusted_is_never_to_be_used(fitted: Fitted, verdict: Verdict) -> None:
    text = text_of(with_verdict(fitted, verdict))
    assert "use" not in text.lower().replace("used", "").split()
    assert "good to" not in text


@pytest.mark.parametrize("verdict", ["exogenous", "endogenous", "not_testable"])
def test_a_value_that_no_arm_can_have_is_worse_than_any_verdict(fitted: Fitted, verdict: Verdict) -> None:
    one = with_verdict(fitted, verdict)
    said = "rotor inertia below zero (Ia1 by 6.67 σ): no rotor has it, so the model lacks something"
    one = replace(one, result=replace(one.result, impossible=(said,)))
    text = text_of(one)
    assert text.strip().startswith("Do not trust this model")
    assert said[1:40] in text
    assert "use" not in text.lower().replace("used", "").split()
    assert "As the gates say" not in text
    assert not one.result.trusted
    assert code_of(one.result) == 1
    page = verdict_view(one.result, ("carriage",))
    assert page.kind == "bad"
    assert page.recommendation == f"R{said[1:]}."
    model = model_of(one, [Path(__file__)], one.base.model.robot)
    assert not model.estimate.trusted
    assert model.estimate.impossible == (said,)


def test_the_parameters_come_when_they_are_asked_for(fitted: Fitted) -> None:
    names = {p.name for p in fitted.result.recommended.parameters}
    assert not any(f"\n {name} " in text_of(fitted) for name in names)
    assert all(f"\n {name} " in text_of(fitted, parameters=True) for name in names)


def test_no_cell_is_cut_at_80_columns(fitted: Fitted) -> None:
    """With numbers as a wrist has them: small values, long names, every digit."""
    small = tuple(
        replace(p, name=f"{p.name}_of_wrist", value=p.value * 1e-7, sigma=p.sigma * 1e-7, unit="N·m·s/rad")
        for p in fitted.result.recommended.parameters
    )
    result = fitted.result.with_estimates(replace(fitted.result.recommended, parameters=small))
    text = text_of(replace(fitted, result=result), parameters=True)
    assert "…" not in text
    assert all(cell_len(line) <= 80 for line in text.splitlines())
