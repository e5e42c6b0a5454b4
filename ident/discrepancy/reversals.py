"""What is looked for at reversals, in closed loop, beside what the moving arm has shown."""

from __future__ import annotations

from collections.abc import Sequence

from ident.discrepancy.results import Finding
from ident.effects.family import EffectFamily

AT_REVERSALS = (
    "static_friction",
    "stribeck_friction",
    "hysteresis",
    "backlash",
    "joint_elasticity",
)
"""Effects that may show at reversals alone, which are looked at in closed loop."""


def forms_of_found(
    findings: Sequence[Finding], families: Sequence[EffectFamily]
) -> set[tuple[str, tuple[int, ...]]]:
    """Names and joints (from 0) that are known to pass for what was found there.

    Where friction falls with speed, the friction that lets go at a reversal is a part of that: another name
    for the same, on the drive that has it, is no further effect.
    """
    alike = {family.name: set(family.confused_with) for family in families}
    return {
        (name, finding.placed.place.joints)
        for finding in findings
        for name, others in alike.items()
        if name in alike.get(finding.effect, ()) or finding.effect in others
    }


def joints_not_told(findings: Sequence[Finding]) -> set[int]:
    """Joints (from 0) of findings that have more than one name: what one leaves may be the other's part."""
    joints = {
        joint
        for finding in findings
        for rival in finding.indistinguishable_from
        for places in (finding.joints, *rival.joints)
        for joint in places
    }
    return {joint - 1 for joint in joints}
