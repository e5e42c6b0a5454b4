"""Settings of the search that are not the arm's."""

from __future__ import annotations

from dataclasses import dataclass

from ident.recording import Recording
from robots.description import Robot

ROW_RATE = 125.0
"""Hz. Rows are kept close together: a decimation filter spreads each reversal over its neighbours."""

_ACCURACY = 8
"""Order of the derivatives: a lower one takes a part off the accelerations of a ripple."""

MINIMUM_SPEED = 0.01
STANDSTILL_MARGIN = 0.04
"""s on both sides of a standstill; enough where rows are not decimated."""


@dataclass(frozen=True)
class SearchSettings:
    """What the search goes by.

    Attributes:
        smallest_share: a finding takes away at least this multiple of the noise's own energy; where noise is
            not told from repeats that energy is not known, and likelihood alone decides.
        smallest_share_in_loop: the same where the rows are those of the simulated loop.
        least_score: no finding scores less, whatever the noise alone could give.
        false_alarm: chance that noise alone gives a finding on a clean arm.
        indistinguishable: two candidates count as told apart where the worse leaves this many times more of
            the excess unexplained than the better one.
        indistinguishable_without_repeats: the same as a share of the score, where noise is not told from
            repeats.
        explained: share of the excess that findings together have to explain to be named.
        second_share: a second effect takes away at least this share of what the first does; less is taken
            for the first one's form being a little different.
        form_share: the same on the joints of the first.
        unnamed_share: what is left without a name counts from this multiple of the noise's energy.
        misfit_in_loop: what a simulation of the right model leaves, as a multiple of the noise's energy.
        unnamed_in_loop: the same, from which on an arm in which nothing was found is not clean.
        not_the_arm_in_loop: a simulation that leaves more than this multiple of it is not the arm's.
        most: how many effects may be found one after the other.
        draws: residuals of noise alone that the threshold is taken from.
        seed: of those.
    """

    smallest_share: float = 0.02
    smallest_share_in_loop: float = 0.005
    least_score: float = 30.0
    false_alarm: float = 0.01
    indistinguishable: float = 0.5
    indistinguishable_without_repeats: float = 0.03
    explained: float = 0.5
    second_share: float = 0.02
    form_share: float = 0.03
    unnamed_share: float = 0.08
    misfit_in_loop: float = 0.07
    unnamed_in_loop: float = 0.5
    not_the_arm_in_loop: float = 10.0
    most: int = 3
    draws: int = 400
    seed: int = 0


DEFAULTS = SearchSettings()


def searching(robot: Robot, recording: Recording) -> Robot:
    """The arm with the identification settings that the search wants for a recording."""
    rate = 1.0 / recording.sample_time
    changed = {
        "decimation": max(1, int(rate / ROW_RATE + 1e-6)),
        "derivative_accuracy": max(robot.identification.derivative_accuracy, _ACCURACY),
        "decimation_filter": "fir",  # a Chebyshev filter rings for long after a reversal
        "minimum_speed": max(robot.identification.minimum_speed, MINIMUM_SPEED),
        "standstill_margin": STANDSTILL_MARGIN,
    }
    return robot.model_copy(update={"identification": robot.identification.model_copy(update=changed)})
