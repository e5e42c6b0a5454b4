"""Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink."""

from __future__ import annotations

from ident.discrepancy.accepted_noise import accepted_noise
from ident.discrepancy.gap import Gap
from ident.discrepancy.prior import Prior, described_prior
from ident.discrepancy.question import Question
from ident.discrepancy.results import Candidate, Diagnosis, Finding, FoundParameter

__all__ = [
    "Candidate",
    "Diagnosis",
    "Finding",
    "FoundParameter",
    "Gap",
    "Prior",
    "Question",
    "accepted_noise",
    "described_prior",
]
