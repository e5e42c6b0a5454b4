"""What the data say against the settings of an identification, and of what the motion hardly shows."""

from __future__ import annotations

from ident.identification.alignment import LagEstimate
from ident.identification.tried_cutoff import ProposedCutoff
from ident.listing import SHOWN, listed
from ident.results import Rank, Signals


def doubts_of(
    signals: Signals, proposal: ProposedCutoff, lag: LagEstimate, rank: Rank, friction_sign: str
) -> list[str]:
    """Settings that the data speak against, and parameters that the motion hardly shows."""
    found = []
    if proposal.hz != signals.cutoff_hz and proposal.tried is not None:
        found.append(
            f"cut-off {signals.cutoff_hz:g} Hz leaves {100 * proposal.tried.left_before:.3g} % of torque that"
            f" was not fitted; {proposal.hz:g} Hz leaves {100 * proposal.tried.left:.3g} %"
        )
    if lag.disagrees and signals.lag == lag.given:
        found.append(
            f"control-signal lag {1e3 * lag.given:g} ms; the data say {1e3 * lag.lag:.3g} ±"
            f" {1e3 * lag.sigma:.1g} ms, and a wrong lag reads as inertia and viscous friction"
        )
    if friction_sign == "tanh" and signals.friction_width < signals.proposed_friction_width:
        found.append(
            f"friction width {signals.friction_width:g}: noise swings the friction's sign at standstill;"
            f" at least {signals.proposed_friction_width:.2g} is proposed"
        )
    if rank.one_way:
        joints = f"joint {', '.join(map(str, rank.one_way))}"
        found.append(
            f"one way only: dry friction of {joints} holds what is constant of the torque; do not rely on"
            " this model the other way"
        )
    if rank.data < rank.structural:
        found.append(
            f"the data have rank {rank.data} of {rank.structural}: the motion does not lift"
            f" {listed(rank.unseen)} above the noise of the positions"
        )
        found += [f"why it does not: {reason}" for reason in rank.reasons[:SHOWN]]
    return found
