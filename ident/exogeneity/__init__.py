"""Are the regressors exogenous? The textbook Durbin-Wu-Hausman test, the revised one, and others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
    from ident.exogeneity.agreement import SimulationAgreement, simulation_agreement
    from ident.exogeneity.augmented import augmented_wald
    from ident.exogeneity.hypothesis import HypothesisTest
    from ident.exogeneity.instruments import GateSettings
    from ident.exogeneity.relevance import conditional_f, partial_f
    from ident.exogeneity.revised import revised_test
    from ident.exogeneity.tested import TestedRows
    from ident.exogeneity.textbook import WhiteRows, textbook_test
    from ident.exogeneity.untested import no_such_arm, not_testable

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

__getattr__ = exporter(
    __name__,
    {
        "ident.exogeneity.agreement": (
            "SimulationAgreement",
            "simulation_agreement",
        ),
        "ident.exogeneity.augmented": ("augmented_wald",),
        "ident.exogeneity.hypothesis": ("HypothesisTest",),
        "ident.exogeneity.instruments": ("GateSettings",),
        "ident.exogeneity.relevance": (
            "conditional_f",
            "partial_f",
        ),
        "ident.exogeneity.revised": ("revised_test",),
        "ident.exogeneity.tested": ("TestedRows",),
        "ident.exogeneity.textbook": (
            "WhiteRows",
            "textbook_test",
        ),
        "ident.exogeneity.untested": (
            "no_such_arm",
            "not_testable",
        ),
    },
)
