"""Is what was found there on recordings that were not fitted?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from ident.discrepancy.deviations import BLOCK, block_labels
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray, IntArray

_INTERVAL = 1.959964
"""Standard deviations to either side of a 95 % interval."""

_ROUNDING = 1e-9
"""Of a residual: a change that is smaller is the rounding of two sums."""

_STEPS = 0.01
"""Of position errors: a change that is smaller is none. (An integral makes up for a constant torque, and the
positions show nothing of it but what a simulation's steps make: of an offset that was there 31 nrad beside
errors of 5.6 µrad, which were −1372 ± 3 % of it, 98693.)"""


_FORM = 0.1
"""Of what a finding adds to a row, by which it may be wrong there where the finding is there: it comes a
little earlier, or is a little rounder."""


@dataclass(frozen=True)
class Shown:
    """Of a change of the model that a finding makes, how much the recordings show that were not fitted.

    With r the residual without the finding and d what the finding adds to the model, both whitened, ``share``
    is dᵀr/dᵀd: 1 where all of it is there, 0 where nothing is. Below one half the residual has grown,
    ‖r − d‖ > ‖r‖: a model without the finding predicts better. Rows of torque count by their noise and by
    what the finding's form may be wrong by there: of a drag that closes nine tenths of the gap its two ends,
    4 ms early, showed 20 ± 11 %.

    Attributes:
        share: see above.
        sigma: its standard deviation, over blocks of time.
    """

    share: float
    sigma: float

    @property
    def there(self) -> bool:
        """Nearer to all than to nothing, and told from nothing."""
        return self.share > max(0.5, _INTERVAL * self.sigma)

    def to_form(self, error: float) -> Shown:
        """With what the form of the finding may be wrong by, as a share of what is asked about.

        Nothing is known of a change that the data do not have.
        """
        return Shown(self.share, float(np.hypot(self.sigma, error))) if self.sigma > 0.0 else self

    @property
    def nats(self) -> float:
        """For the finding against none, or against what it is compared with.

        The share is normal with its deviation about 1 where all is there and about 0 where nothing is.
        """
        return (2.0 * self.share - 1.0) / (2.0 * self.sigma**2) if self.sigma > 0.0 else 0.0

    def nats_in_loop(self, at_reversals: bool) -> float:
        """The same of a simulated loop.

        Less than nothing is neither of the two, nor is more than all, nor what is told from both at 95 %: so
        large at least is what the loop does otherwise than both, which no deviation over blocks knows.

        Args:
            at_reversals: whether the finding shows there alone, where its change is of another size than
                elsewhere: then more than all of it is all.
        """
        share = min(self.share, 1.0) if at_reversals else self.share
        nearest = float(np.clip(share, 0.0, 1.0))
        between = max(min(nearest, 1.0 - nearest) - _INTERVAL * self.sigma, 0.0)
        return Shown(nearest, float(np.hypot(self.sigma, abs(share - nearest) + between))).nats

    @property
    def nats_of_no_name(self) -> float:
        """For something that is only like the finding, against it: of such a thing any share may be there.

        More than twice, told at 95 %, is as far from all of it as so much less.
        """
        if self.sigma == 0.0:
            return 0.0
        share = self.as_much_less.share if self.exceeded else self.share
        low, high = -share / self.sigma, (1.0 - share) / self.sigma
        density = -0.5 * high**2 - np.log(self.sigma * np.sqrt(2.0 * np.pi))
        # On the side on which the difference keeps its digits.
        low, high = (low, high) if low + high < 0.0 else (-high, -low)
        above, below = log_ndtr([high, low])
        return float(above + np.log1p(-np.exp(below - above)) - density)

    @property
    def contradicted(self) -> bool:
        """Nearer to nothing than to all, beyond its own deviation: the gap has grown."""
        return not self.of_nothing and self.share + _INTERVAL * self.sigma < 0.5

    def nats_against(self, form: float) -> float:
        """For something that is only like the finding, of a share that is told from all of it.

        Args:
            form: of the finding, as a share (:meth:`to_form`).
        """
        return max(0.0, self.as_much_less.to_form(form).nats_of_no_name)

    @property
    def as_much_less(self) -> Shown:
        """Where more than all of it is there, what is as far from all of it on the other side."""
        return Shown(1.0 - abs(self.share - 1.0), self.sigma)

    @property
    def exceeded(self) -> bool:
        """More than twice, beyond its own deviation: most of what is there is something else."""
        return self.share - _INTERVAL * self.sigma > 2.0

    @property
    def of_nothing(self) -> bool:
        """Whether nothing is changed on these recordings, so that they say nothing of it."""
        return self.share == 0.0 and self.sigma == 0.0


@dataclass(frozen=True)
class Confirmation:
    """Of one finding, on recordings that were not fitted, less the finding alone and with it.

    Attributes:
        torque: of the inverse model, or of the drives in the simulated closed loop where it was found there.
        loop: of the simulated positions; None where there is no simulation.
        unsure: what makes it this effect and is not told from its absence, in words; empty where all is.
        of_reversals: whether it was found in the simulated loop, whose positions it has to explain then.
    """

    torque: Shown
    loop: Shown | None
    unsure: str = ""
    of_reversals: bool = False

    @property
    def passed(self) -> bool:
        return not self.reason

    @property
    def unseen(self) -> bool:
        """Whether data that was not fitted says nothing of it: it does not move where it acts."""
        return self.torque.of_nothing and not self.refuted

    @property
    def refuted(self) -> bool:
        """Whether data that was not fitted speaks against it, or it may as well be nothing.

        What is merely not shown there (too little moves, too much noise) is not refuted.
        """
        return bool(self.unsure or self.against)

    @property
    def against(self) -> tuple[Shown, ...]:
        """Shares that are told from all of it, at 95 %: nearer to nothing, or more than twice.

        More of its torque is asked of what the moving arm shows, whose positions an integral makes up for;
        more of its change of the simulated positions of what was found in these.
        """
        loop = self._loop.contradicted or (self._loop.exceeded and self.of_reversals)
        return (self.torque,) * self._torque_against + (self._loop,) * loop

    @property
    def _torque_against(self) -> bool:
        return self.torque.contradicted or (self.torque.exceeded and not self.of_reversals)

    @property
    def reason(self) -> str:
        """Why it is not confirmed, in words; empty where it is."""
        if self.unsure:
            return self.unsure
        if self.torque.of_nothing:
            return "data that was not fitted does not move where it acts; record a motion that does"
        if not self.torque.there or self._torque_against:
            share = f"{100 * self.torque.share:.0f} ± {100 * self.torque.sigma:.0f} %"
            return f"of the torque that it adds, data that was not fitted shows {share}"
        if not self.against:
            return ""
        if self._loop.contradicted:
            return "with it the simulated closed loop is farther from the arm on data that was not fitted"
        share = f"{100 * self._loop.share:.0f} ± {100 * self._loop.sigma:.0f} %"
        return f"of what it changes in the simulated closed loop, data that was not fitted shows {share}"

    @property
    def _loop(self) -> Shown:
        """Of the simulated positions; of nothing where there is no simulation."""
        return Shown(0.0, 0.0) if self.loop is None else self.loop


def shown_share(
    before: FloatArray, after: FloatArray, blocks: IntArray, least: float = _ROUNDING, form: float = 0.0
) -> Shown:
    """How much of a change data show.

    Args:
        before, after: (N,) residuals without and with the change.
        blocks: (N,) block of time of each row, in which errors may depend on each other.
        least: share of the residual up to which a change is none.
        form: share of itself by which the change may be wrong in each row, beside an error of deviation 1: no
            row tells the share better than to that.
    """
    change = before - after
    whole = float(change @ change)
    if whole <= least**2 * float(before @ before):
        return Shown(0.0, 0.0)
    weighted = change / (1.0 + (form * change) ** 2)
    whole = float(weighted @ change)
    share = float(weighted @ before) / whole
    moments = np.bincount(blocks, weighted * (before - share * change))
    count = int(np.count_nonzero(np.bincount(blocks)))
    spread = float(moments @ moments) * count / max(1, count - 1)
    return Shown(share, float(np.sqrt(spread)) / whole)


def shown_in_torque(
    prepared: Sequence[PreparedRecording],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    whitening: Whitening,
) -> Shown:
    """The same of decimated torque residuals per piece, rows × joints, where the joints move.

    Args:
        prepared: recordings that were not fitted.
        before, after: without and with the finding.
        whitening: of the noise, as it was fitted with.
    """
    segment = np.repeat(np.arange(len(prepared)), [piece.rows for piece in prepared])
    used = np.concatenate([piece.moving for piece in prepared])
    both = np.stack([np.concatenate(list(before)), np.concatenate(list(after))], axis=2)
    white = whitening.apply(both, segment, used)
    blocks = block_labels(prepared, segment, used, whitening)
    return shown_share(white[:, 0], white[:, 1], blocks, form=_FORM)


def shown_in_positions(
    times: Sequence[FloatArray],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
    unit: FloatArray,
) -> Shown:
    """The same of position errors of the simulated loop per piece, samples × joints.

    Args:
        times: of the samples of each piece, s.
        before, after: measured less simulated, without and with the finding.
        unit: (n,) what an error of each joint is measured by.
    """
    whole, other = np.concatenate(list(before)) / unit, np.concatenate(list(after)) / unit
    labels, first = [], 0
    for time in times:
        labels.append(first + ((time - time[0]) // BLOCK).astype(np.int64))
        first = int(np.max(labels[-1])) + 1
    blocks = np.repeat(np.concatenate(labels), whole.shape[1])
    return shown_share(whole.ravel(), other.ravel(), blocks, _STEPS)
