"""What settles a name that motion alone cannot: for pairs of effects, the one thing to change on the arm."""

from __future__ import annotations

from collections.abc import Iterable

_SETTLED_BY: tuple[tuple[frozenset[str], str], ...] = (
    (
        frozenset({"drive_gain_error", "payload"}),
        "take the tool off and record again: a payload leaves with it, a wrong gain stays",
    ),
    (
        frozenset({"drive_gain_error"}),
        "record once more with a known payload: it weighs too much where the gain is wrong (armhil gain)",
    ),
    (
        frozenset({"current_offset", "asymmetric_friction"}),
        "hold still under a known load, reached from both sides: an offset stays, friction turns its sign",
    ),
    (
        frozenset({"current_offset"}),
        "hold still with the arm upright, where gravity asks for no torque: what is left is the offset",
    ),
    (
        frozenset({"backlash", "joint_elasticity"}),
        "lock the motor and push the link both ways with a dial gauge on it: play moves without force",
    ),
    (
        frozenset({"stribeck_friction", "nonlinear_viscous_friction"}),
        "let the joint creep at several constant speeds below a hundredth of its limit",
    ),
    (
        frozenset({"static_friction", "stribeck_friction"}),
        "raise the torque of the resting joint slowly until it breaks away",
    ),
    (
        frozenset({"gravity_spring", "contact"}),
        "clear the surroundings of the arm and record again: a contact is gone, a spring is not",
    ),
    (
        frozenset({"gravity_spring", "cable_spring"}),
        "take the dress pack off and record again: a cable is gone, a spring is not",
    ),
    (
        frozenset({"cable_spring", "contact"}),
        "take the dress pack off and record again: a cable is gone, a contact is not",
    ),
    (
        frozenset({"payload", "base_tilt"}),
        "put a level on the base: a tilt shows there, a payload does not",
    ),
    (
        frozenset({"payload", "rotor_inertia"}),
        "take the tool off and record again: a payload leaves with it, a rotor does not",
    ),
    (
        frozenset({"time_delay", "current_loop_lag"}),
        "lock the joint and step the control signal: a delay shifts the current, a lag rounds it",
    ),
    (
        frozenset({"torque_ripple", "gear_ripple"}),
        "uncouple the motor and turn it alone: ripple of the torque stays, an error of the gear is gone",
    ),
    (
        frozenset({"drifting_friction", "viscous_friction"}),
        "record the same motion cold and warm",
    ),
)

_ANY = "change one of the causes on the arm (take it off, lock it, warm it up) and record again"


def settled_by(effects: Iterable[str]) -> str:
    """The change on the arm that tells effects apart where no motion does; the most specific one known."""
    names = frozenset(effects)
    for pair, how in _SETTLED_BY:
        if pair <= names:
            return how
    return _ANY
