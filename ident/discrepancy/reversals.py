"""What is looked for at reversals, in closed loop, beside what the moving arm has shown."""

from __future__ import annotations

from collections.abc import Sequence

from ident.discrepancy.accepted import Accepted
from ident.effects.vocabulary import confused_with


def confusable_with_found(findings: Sequence[Accepted]) -> set[tuple[str, tuple[int, ...]]]:
    """Names and joints (from 0) that are known to pass for what was found there.

    Where friction falls with speed, the friction that lets go at a reversal is a part of that: another name
    for the same, on the drive that has it, is no further effect.
    """
    return {
        (name, finding.placed.place.joints) for finding in findings for name in confused_with(finding.effect)
    }


def joints_not_told(findings: Sequence[Accepted]) -> set[int]:
    """Joints (from 0) of findings that have more than one name: what one leaves may be the other's part."""
    joints = {
        joint
        for finding in findings
        for rival in finding.indistinguishable_from
        for places in (finding.joints, *rival.joints)
        for joint in places
    }
    return {joint - 1 for joint in joints}
