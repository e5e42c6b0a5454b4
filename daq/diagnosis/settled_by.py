"""What settles a name that motion alone cannot: the one thing to change on the arm."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_PAIRS: Mapping[frozenset[str], str] = {
    frozenset(pair): how
    for pair, how in (
        (
            ("drive_gain_error", "payload"),
            "take the tool off and record again: a payload leaves with it, a wrong gain stays",
        ),
        (
            ("drive_gain_error", "load_dependent_friction"),
            "hold a known payload still, reached from both sides: friction turns its sign, a gain does not",
        ),
        (
            ("drive_gain_error", "saturation"),
            "run the same motion at half the speed: what saturates is gone, a wrong gain stays",
        ),
        (
            ("current_offset", "asymmetric_friction"),
            "hold still under a known load, reached from both sides: an offset stays, friction turns",
        ),
        (
            ("backlash", "joint_elasticity"),
            "lock the motor and push the link both ways with a dial gauge on it: play moves without force",
        ),
        (
            ("backlash", "hysteresis"),
            "lock the motor and push the link both ways with a dial gauge on it: play moves without force",
        ),
        (
            ("current_loop_lag", "joint_elasticity"),
            "lock the link and step the control signal: the current shows the lag, no gear is in it",
        ),
        (
            ("stribeck_friction", "nonlinear_viscous_friction"),
            "let the joint creep at several constant speeds below a hundredth of its limit",
        ),
        (
            ("static_friction", "stribeck_friction"),
            "raise the torque of the resting joint slowly until it breaks away",
        ),
        (
            ("static_friction", "hysteresis"),
            "raise the torque of the resting joint slowly, lower it before it breaks away: hysteresis comes"
            " back by another way",
        ),
        (
            ("gravity_spring", "contact"),
            "clear the surroundings of the arm and record again: a contact is gone, a spring is not",
        ),
        (
            ("gravity_spring", "cable_spring"),
            "take the dress pack off and record again: a cable is gone, a spring is not",
        ),
        (
            ("cable_spring", "contact"),
            "take the dress pack off and record again: a cable is gone, a contact is not",
        ),
        (
            ("gravity_spring", "base_tilt"),
            "put a level on the base: a tilt shows there, a spring does not",
        ),
        (
            ("payload", "base_tilt"),
            "put a level on the base: a tilt shows there, a payload does not",
        ),
        (
            ("payload", "rotor_inertia"),
            "take the tool off and record again: a payload leaves with it, a rotor does not",
        ),
        (
            ("time_delay", "current_loop_lag"),
            "lock the joint and step the control signal: a delay shifts the current, a lag rounds it",
        ),
        (
            ("current_loop_lag", "rotor_inertia"),
            "lock the joint and step the control signal: a lag rounds the current, a resting rotor does not",
        ),
        (
            ("time_delay", "rotor_inertia"),
            "lock the joint and step the control signal: a delay shifts the current, a resting rotor does"
            " not",
        ),
        (
            ("torque_ripple", "gear_ripple"),
            "uncouple the motor and turn it alone: ripple of the torque stays, an error of the gear is gone",
        ),
        (
            ("load_dependent_friction", "coulomb_friction"),
            "record the same motion with a known payload: friction of the load grows, dry friction does not",
        ),
        (
            ("load_dependent_friction", "position_dependent_friction"),
            "record the same motion with a known payload: friction of the load grows, the other does not",
        ),
    )
}
"""What tells two effects apart: changed on the arm, one of them is gone or shows itself."""

_ALONE: Mapping[str, str] = {
    "contact": "clear the surroundings of the arm and record again: a contact is gone",
    "cable_spring": "take the dress pack off and record again: a cable is gone",
    "payload": "take the tool off and record again: a payload leaves with it",
    "base_tilt": "put a level on the base: a tilt shows there",
    "drive_gain_error": "record once more with a known payload: it weighs too much where the gain is wrong"
    " (armhil gain)",
    "gain_drift": "record the same motion cold and warm: a gain that drifts has changed, all else has not",
    "current_offset": "hold still with the arm upright, where gravity asks for no torque: what is left is the"
    " offset",
    "gravity_spring": "unhook the spring, with the arm held, and record again: its torque is gone",
    "drifting_friction": "record the same motion cold and warm: only what drifts has changed",
    "static_friction": "raise the torque of the resting joint slowly until it breaks away",
    "stribeck_friction": "let the joint creep at several constant speeds below a hundredth of its limit",
    "backlash": "lock the motor and push the link both ways, a dial gauge on it: play moves without force",
    "joint_elasticity": "lock the motor and hang known weights on the link, a dial gauge on it: a gear that"
    " gives way moves in proportion",
    "hysteresis": "push the resting joint there and back by less than it takes to break away: hysteresis"
    " comes back by another way",
    "saturation": "run the same motion at half the speed: what saturates is gone",
    "time_delay": "lock the joint and step the control signal: a delay shifts the current",
    "current_loop_lag": "lock the joint and step the control signal: a lag rounds the current",
    "torque_ripple": "uncouple the motor and turn it alone: ripple of the torque stays",
    "gear_ripple": "uncouple the motor and turn it alone: an error of the gear is gone",
    "rotor_inertia": "uncouple the motor and accelerate it alone: the torque is that of the rotor",
    "wrist_coupling": "move one of the two axes while the other rests: the coupling shows there",
    "load_dependent_friction": "record the same motion with a known payload: friction of the load grows",
    "position_dependent_friction": "turn the joint slowly through its range: the torque follows the place",
    "asymmetric_friction": "run the joint at one constant speed both ways: the torques differ",
    "nonlinear_viscous_friction": "run the joint at several constant speeds: the torque is no straight line",
    "viscous_friction": "run the joint at several constant speeds: the torque is a straight line",
    "coulomb_friction": "run the joint at several constant speeds: at none the torque is this",
}
"""What shows each effect by itself, those first that are easiest to take away."""


def settled_by(effects: Iterable[str]) -> str:
    """The change on the arm that tells effects apart where no motion does.

    Args:
        effects: names of the vocabulary; the same twice is one effect at two places.
    """
    names = frozenset(effects)
    for pair, how in _PAIRS.items():
        if pair <= names:
            return how
    return next(how for name, how in _ALONE.items() if name in names)
