"""What a search answers to a case, as plain values."""

from __future__ import annotations

import time
from typing import Any

from benchmarks.evidence.case import Case
from ident import IdentificationError
from ident.discrepancy import diagnose
from ident.discrepancy.by_evidence import diagnose_by_evidence
from ident.discrepancy.by_evidence.report.as_json import answer_json

SEARCHES = ("evidence", "rules")


def asked(case: Case, search: str) -> dict[str, Any]:
    """Verdict; names with joints from 1, probability, whether named, and the set that holds 95 %."""
    started = time.process_time()
    try:
        answer = _by_evidence(case) if search == "evidence" else _by_rules(case)
    except IdentificationError as error:
        answer = {"verdict": "refused", "names": [], "reason": str(error)}
    return {**answer, "processor_seconds": round(time.process_time() - started, 1)}


def _by_evidence(case: Case) -> dict[str, Any]:
    content = answer_json(diagnose_by_evidence(case.question("evidence")))
    names = [
        {
            "name": one["effect"],
            "joints": one["joints"],
            "probability": one["probability"],
            "named": one["named"],
            "set": [[other["effect"], other["joints"], other["probability"]] for other in one["set"]],
        }
        for one in content["findings"]
    ]
    kept = ("verdict", "probability_clean", "ranking", "joints", "gate_1_rejected")
    return {**{key: content[key] for key in kept}, "names": names}


def _by_rules(case: Case) -> dict[str, Any]:
    found = diagnose(case.question("rules"))
    names = [
        {
            "name": one.effect,
            "joints": list(one.joints),
            "probability": 1.0,
            "named": found.verdict in ("named", "ambiguous"),
            "set": [[one.effect, list(one.joints), 1.0]],
        }
        for one in found.findings
    ]
    return {"verdict": found.verdict, "names": names}
