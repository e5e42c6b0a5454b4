"""The answer as plain values: what ``diagnose --json`` prints under ``evidence``."""

from __future__ import annotations

from typing import Any

from ident.discrepancy.by_evidence.decide.names import Named
from ident.discrepancy.by_evidence.power.smallest import Smallest, worst_first
from ident.discrepancy.by_evidence.report.answer import EvidenceAnswer, EvidenceFinding


def answer_json(answer: EvidenceAnswer) -> dict[str, Any]:
    """The answer as a JSON object."""
    return {
        "verdict": answer.verdict,
        "probability_clean": answer.probability_clean,
        "findings": [_finding(finding) for finding in answer.findings],
        "refuted": [one.words() for one in answer.refuted],
        "ranking": [_named(one) for one in answer.ranking[:_LISTED]],
        "joints": [
            {
                "joint": one.joint,
                "unexplained": {"before": one.before, "after": one.after},
                "misfit": one.kappa,
                "misfit_accepted": one.accepted,
                "probability_above": one.above,
                "nearest": None if one.nearest is None else _named(one.nearest),
            }
            for one in answer.joints
        ],
        "smallest_named": [smallest_json(one) for one in worst_first(answer.nameable)],
        "gate_1_rejected": answer.gate_one_rejected,
        "repeats": answer.repeats,
        "log_evidence": {"without": answer.log_evidence[0], "with": answer.log_evidence[1]},
    }


_LISTED = 10
"""Names of a ranking."""


def _finding(finding: EvidenceFinding) -> dict[str, Any]:
    confirmation = finding.confirmation
    return {
        "effect": finding.name,
        "joints": list(finding.joints),
        "sentence": finding.words(),
        "probability": finding.probability,
        "named": finding.named,
        "set": [_named(one) for one in finding.set],
        "parameters": [
            {"name": one.name, "value": one.value, "sigma": one.sigma, "unit": one.unit, "shape": one.shape}
            for one in finding.parameters
        ],
        "confirmation": {
            "confirmed": finding.held_up,
            "set_fails": finding.fails,
            "no_name": finding.no_name,
            "predicted": confirmation.predicted,
            "deviation": confirmation.deviation,
            "observed": confirmation.observed,
        },
        "explains": finding.explains,
        "left_at_its_joint": finding.left,
    }


def _named(one: Named) -> dict[str, Any]:
    return {
        "effect": one.name,
        "joints": [joint + 1 for joint in one.joints],
        "probability": one.probability,
    }


def smallest_json(one: Smallest) -> dict[str, Any]:
    """The smallest size of one effect at one place; null where no size of it would be named."""
    return {
        "effect": one.name,
        "joints": list(one.joints),
        "parameter": one.parameter,
        "size": one.size if one.seen else None,
        "unit": one.unit,
        "at_most": one.falls,
        "torque": one.torque if one.seen else None,
        "torque_joint": one.joint,
        "torque_unit": one.torque_unit,
        "shape": {name: value for name, value, _ in one.shape},
        "last_told_from": {"effect": one.rival[0], "joints": list(one.rival[1])},
    }
