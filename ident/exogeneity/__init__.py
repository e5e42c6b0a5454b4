"""Are the regressors exogenous? The textbook Durbin-Wu-Hausman test, the revised one, and others."""

from __future__ import annotations

from ident.exogeneity.agreement import SimulationAgreement, simulation_agreement
from ident.exogeneity.augmented import augmented_wald
from ident.exogeneity.hypothesis import HypothesisTest
from ident.exogeneity.instruments import GateSettings
from ident.exogeneity.relevance import conditional_f, partial_f
from ident.exogeneity.revised import no_such_arm, not_testable, revised_test
from ident.exogeneity.tested import TestedRows
from ident.exogeneity.textbook import WhiteRows, textbook_test

__all__ = [
    "GateSettings",
    "HypothesisTest",
    "SimulationAgreement",
    "TestedRows",
    "WhiteRows",
    "augmented_wald",
    "conditional_f",
    "no_such_arm",
    "not_testable",
    "partial_f",
    "revised_test",
    "simulation_agreement",
    "textbook_test",
]
