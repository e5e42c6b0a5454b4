"""Something without a name, in the place of a member of a set.

It looks on the rows that were fitted like the name that comes nearest, and has its evidence there; of what
that name predicts of other motion any share may be there. Several names can describe it together, one against
the other; that sizes of friction are possible (:mod:`.possible`) what has no name does not need.

A name that is there leaves about what a model leaves without any change. One that only comes nearest may
imitate what is there as well as that, and may leave any part of it.
"""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.decide.left_over import misfit_of, own_joint, torque_of, usual_at
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found
from ident.discrepancy.by_evidence.evidence.solved import Posterior
from ident.discrepancy.confirmation import Shown
from robots.arrays import FloatArray

NO_NAME = "something without a name"
"""In the place of a name, with the joints of the name that comes nearest."""

OUTSIDE = 0.1
"""Prior odds of an effect that has no name: of eleven that an arm gets ten are in the vocabulary."""

AS_NOT = 1.0
"""The same of one that explains no more than an arm leaves that nothing has happened to."""

_IMITATED = 0.2
"""Probability that a name imitates something else so well that nothing more is left than usual."""

_AT_A_JOINT = 0.5
"""Probability that what a name only imitates leaves more than usual at a joint where the name acts."""

_FORM = 0.03
"""Of a name's torque, by which its form and its shapes are wrong where it is there."""

_FORM_OF_ROUGH = 0.3
"""The same of what rows hold the most of alone: impacts, ringing and what comes at once."""

_FORM_OF_FRICTION = 0.1
"""The same of friction: some minutes later a drive is warmer, and has another."""

_USUAL = 0.5
"""Of ln κ about ln κ accepted beside a name that is there, where the density is half as high."""


def odds_of_no_name(
    alone: Shown,
    refitted: Shown,
    price: float,
    possible: float,
    left: float,
    form: float = _FORM,
    outside: float = OUTSIDE,
) -> float:
    """Log odds of something without a name against the name that comes nearest; the rows' part coarsened.

    On the rows that were fitted it makes the torque of the name, beside the parameters that the name has. Or
    it makes what is left of that beside the parameters of the set without it, at the price of their prior:
    after a refit there is none, so what parameters make up for is no evidence of a name. The likelier counts.

    Args:
        alone: of the name's torque on other motion, how much is there.
        refitted: of what the set predicts otherwise than the set without the name.
        price: nats (:func:`price_of_parameters`).
        possible: log probability that the sizes of names are possible (:mod:`.possible`).
        left: nats of what stays unexplained (:func:`left_beside`).
        form: share of the name's torque by which it may be another on other motion (:func:`form_error`).
        outside: odds of it beforehand (:func:`odds_beforehand`).
    """
    nats = max(alone.to_form(form).nats_of_no_name, refitted.to_form(form).nats_of_no_name - price)
    return float(np.log(outside)) + left + TEMPERATURE * (nats - possible)


def odds_beforehand(problem: Problem, found: Found, number: int) -> float:
    """Odds of something without a name, before a name that comes nearest is looked at on other motion.

    Every arm leaves something that has no name: what explains no more than that is as likely as not it.

    Args:
        problem: the data.
        found: the set.
        number: of the member that comes nearest.
    """
    torque = torque_of(problem, found, number)
    joint = own_joint(found, number, torque)
    return OUTSIDE if torque[joint] > usual_at(problem, found, joint) else AS_NOT


def form_error(rough: bool, friction: bool) -> float:
    """Share of a name's torque by which it may be another on other motion where the name is there.

    Args:
        rough: whether rows hold the most of it alone.
        friction: whether it is torque against the speed of a drive.
    """
    if rough:
        return _FORM_OF_ROUGH
    return _FORM_OF_FRICTION if friction else _FORM


def price_of_parameters(precision: FloatArray, without: Posterior, found: Posterior) -> float:
    """Nats of the prior by which parameters of a set without a member are less likely; 0 where they are not.

    Of the model's own parameters: what a lag makes up for between channels is no evidence of a name.

    Args:
        precision: (b,) of their factors, the first of the known ones; 0 of those that have no prior.
        without: the set without it.
        found: the set.
    """
    own = slice(precision.size)
    return max(0.0, 0.5 * float(precision @ (without.known[own] ** 2 - found.known[own] ** 2)))


def left_beside(problem: Problem, found: Found, number: int) -> float:
    """Nats for something without a name, against a member of a set, of what stays unexplained beside it.

    All joints count together at which the member explains more than an accepted model leaves: a load that
    swings is a payload with as much left at the wrist as usual, and more at the shoulder. None where no
    accepted run says what is usual, and none of what rows hold the most of: a play leaves instants of
    impacts, a drag that comes and goes at once its further waves. Nor is that of what is beside it, as much
    of it as that one's own torque: beside a soft gear of 0.05 N·m, which was not there, 0.5 N·m of a load
    that sloshes had been the gear's, and the payload was sure (98606).

    Args:
        problem: the data.
        found: the set.
        number: of the member.
    """
    member = found.members[number]
    if member.candidate.family.rough or not problem.misfit.of_run:
        return 0.0
    torque, kappa = torque_of(problem, found, number), found.level.kappa
    beside = [k for k, one in enumerate(found.members) if one.candidate.family.rough]
    of_others = sum(torque_of(problem, found, k) ** 2 for k in beside)
    rough = np.maximum(misfit_of(problem, found) ** 2 - kappa**2 - of_others, 0.0)
    accepted, own = problem.misfit.accepted, own_joint(found, number, torque)
    acts = [j for j in member.joints if j == own or torque[j] > accepted[j]]
    return nats_of_left(np.sqrt(kappa**2 + rough)[acts], accepted[acts], torque[acts])


def nats_of_left(misfit: FloatArray, accepted: FloatArray, explains: FloatArray) -> float:
    """Nats for something without a name, against the name, of what stays unexplained beside the name.

    Where the name is there ln κ is about the accepted one (Cauchy), with a form's own error. Where it is not,
    so with one fifth at all joints, and else at least at one of them, each as likely as not, κ is anything
    from that to all that is there, equally in ln κ.

    Args:
        misfit: (J,) of the joints where the name acts, beside the set, N·m (or N).
        accepted: (J,) of an accepted run, the same unit.
        explains: (J,) root mean square of what the name explains there, the same unit.
    """
    usual = np.hypot(accepted, _FORM * explains)
    away, most = np.log(misfit / usual), np.log(np.hypot(misfit, explains) / usual)
    there = 1.0 / (np.pi * _USUAL * (1.0 + (away / _USUAL) ** 2))
    more = np.divide(1.0, most * there, out=np.zeros_like(away), where=away > 0.0)
    as_usual = 1.0 - _AT_A_JOINT
    none = as_usual**away.size
    at_some = (np.prod(as_usual + _AT_A_JOINT * more) - none) / (1.0 - none)
    return float(np.log(_IMITATED + (1.0 - _IMITATED) * at_some))
