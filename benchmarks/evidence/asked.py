"""What the search answers to a case, as plain values."""

from __future__ import annotations

import time
from typing import Any

from benchmarks.evidence.case import Case
from ident import IdentificationError
from ident.discrepancy import Diagnosis, Finding
from ident.discrepancy.by_evidence import diagnose_with_evidence
from ident.discrepancy.by_evidence.report.as_json import answer_json


def asked(case: Case) -> dict[str, Any]:
    """Verdict; names with joints from 1, probability, whether named, and the set that holds 95 %."""
    started = time.process_time()
    try:
        answer = _by_evidence(case)
    except IdentificationError as error:
        answer = {"verdict": "refused", "names": [], "reason": str(error)}
    return {**answer, "processor_seconds": round(time.process_time() - started, 1)}


def _by_evidence(case: Case) -> dict[str, Any]:
    found, answer = diagnose_with_evidence(case.question(), sizes=False)
    content = answer_json(answer)
    kept = ("probability_clean", "ranking", "joints")
    return {**{key: content[key] for key in kept}, **_answer(found)}


def is_named(finding: Finding) -> bool:
    """Whether a name counts as named: it is confirmed and nothing else could be it."""
    return finding.confirmation.passed and not finding.indistinguishable_from


def _answer(found: Diagnosis) -> dict[str, Any]:
    names = [
        {
            "name": one.effect,
            "joints": list(one.joints),
            "probability": one.probability,
            "named": is_named(one),
            "set": [[other.name, list(other.joints), other.probability] for other in one.held],
        }
        for one in found.findings
    ]
    unexplained = {one.joint + 1: one.share for one in found.unexplained}
    return {"verdict": found.verdict, "names": names, "unexplained": unexplained}
