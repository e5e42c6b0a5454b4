"""Are the regressors exogenous? The textbook Durbin-Wu-Hausman test, the revised one, and others."""

from __future__ import annotations

from ident.exogeneity.agreement import SimulationAgreement, simulation_agreement
from ident.exogeneity.augmented import augmented_wald
from ident.exogeneity.hypothesis import HypothesisTest
from ident.exogeneity.instruments import GateSettings
from ident.exogeneity.overidentification import basmann, basmann_f, hansen_j, sargan
from ident.exogeneity.relevance import (
    anderson,
    conditional_f,
    cragg_donald,
    cragg_donald_f,
    kleibergen_paap,
    partial_f,
)
from ident.exogeneity.revised import no_such_arm, not_testable, revised_test
from ident.exogeneity.tested import TestedRows
from ident.exogeneity.textbook import WhiteRows, textbook_test
from ident.exogeneity.wooldridge import wooldridge_regression, wooldridge_score

__all__ = [
    "GateSettings",
    "HypothesisTest",
    "SimulationAgreement",
    "TestedRows",
    "WhiteRows",
    "anderson",
    "augmented_wald",
    "basmann",
    "basmann_f",
    "conditional_f",
    "cragg_donald",
    "cragg_donald_f",
    "hansen_j",
    "kleibergen_paap",
    "no_such_arm",
    "not_testable",
    "partial_f",
    "revised_test",
    "sargan",
    "simulation_agreement",
    "textbook_test",
    "wooldridge_regression",
    "wooldridge_score",
]
