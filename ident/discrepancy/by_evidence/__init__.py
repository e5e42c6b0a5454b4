"""The search by evidence: one model of the data, its evidence for every set of effects, names with
probabilities.
"""

from __future__ import annotations

from ident.discrepancy.by_evidence.accepted import accepted_prior, prior_by_evidence
from ident.discrepancy.by_evidence.diagnosis import diagnose_with_evidence
from ident.discrepancy.by_evidence.report.answer import (
    EvidenceAnswer,
    EvidenceFinding,
    EvidenceVerdict,
    JointMisfit,
)
from ident.discrepancy.by_evidence.workflow import diagnose_by_evidence

__all__ = [
    "EvidenceAnswer",
    "EvidenceFinding",
    "EvidenceVerdict",
    "JointMisfit",
    "accepted_prior",
    "diagnose_by_evidence",
    "diagnose_with_evidence",
    "prior_by_evidence",
]
