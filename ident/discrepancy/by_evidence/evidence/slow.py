"""What of a residual that does not repeat is slow, or friction that changes with time: a finding, no noise.

Noise is read off what does not repeat, and no effect is looked for in noise. So what comes and goes over a
recording has to leave it: a constant torque, dry and viscous friction, each times half waves over the
recording. How many is what the residual says: a drift needs few, a brake that rubs every seven seconds more
(with six half waves over 30 s it was noise of 0.16 N·m with a long memory at a joint that has 0.01, and
nothing was found there). They are twice as many as long as that is likelier by the innovations of the noise
that is left (Schwarz's criterion, Ann. Statist. 6, 1978; with Akaike's, which asks for less, log 10 of the
foreign plant had two false effects beside its play: noise that was too small).

The speed is that of the mean period. A period's own has the noise in it that its torque has, and half waves
of which two periods see the same leave of the speed nothing but that noise: on clean arms two thirds of the
noise of a light wrist went with it, and its rows were twice as noisy as what was left.
"""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.evidence.noise import autoregressive
from ident.discrepancy.repeats import mean_period, not_repeating
from ident.effects import State
from robots.arrays import BoolArray, FloatArray

_SLOW = 6
"""Half waves over a recording, at least: what changes more slowly than that is no noise."""

_ROWS = 10
"""Per column: with fewer a fit takes noise."""


def without_slow(own: State, used: BoolArray, noise: FloatArray, period: int) -> FloatArray:
    """Noise less what of it is slow.

    Args:
        own: motion at the rows of one recording.
        used: rows × joints that count.
        noise: rows × joints, N·m (or N), what does not repeat.
        period: rows.
    """
    assert own.time is not None
    share = (own.time - own.time[0]) / (own.time[-1] - own.time[0])
    rest, speeds = noise.copy(), mean_period(own.velocity, period)
    for joint in range(noise.shape[1]):
        speed = speeds[:, joint]
        causes = np.stack([np.ones_like(speed), np.sign(speed), speed], axis=1)
        rest[:, joint] = _likeliest(causes, share, used[:, joint], noise[:, joint], period)
    return rest


def _likeliest(
    causes: FloatArray, share: FloatArray, used: BoolArray, noise: FloatArray, period: int
) -> FloatArray:
    """(rows,) noise of a joint less causes (rows, 3) that change with time.

    Args:
        causes: torque that is constant, dry friction, viscous friction.
        share: (rows,) of the recording that is over.
        used: (rows,) that count.
        noise: (rows,) N·m (or N).
        period: rows.
    """
    waves, count = _SLOW, int(used.sum())
    rest = _less(causes, share, used, noise, period, waves)
    while 2 * waves * causes.shape[1] * _ROWS <= count:
        fewer = _less(causes, share, used, noise, period, 2 * waves)
        gain = 2.0 * count * np.log(_innovation(rest, used) / _innovation(fewer, used))
        if gain <= waves * causes.shape[1] * np.log(count):
            break
        waves, rest = 2 * waves, fewer
    return rest


def _less(
    causes: FloatArray, share: FloatArray, used: BoolArray, noise: FloatArray, period: int, waves: int
) -> FloatArray:
    """(rows,) noise less what least squares make of causes times so many half waves."""
    slow = np.cos(np.pi * np.arange(1, waves + 1) * share[:, np.newaxis])
    basis = not_repeating((causes[:, :, np.newaxis] * slow[:, np.newaxis, :]).reshape(share.size, -1), period)
    scale = np.maximum(np.linalg.norm(basis[used], axis=0), 1e-12)
    fit = np.linalg.lstsq(basis[used] / scale, noise[used], rcond=1e-6)[0]
    return np.asarray(noise - basis / scale @ fit)


def _innovation(noise: FloatArray, used: BoolArray) -> float:
    """Deviation of what an autoregressive model of a noise (rows,) leaves, N·m (or N)."""
    return autoregressive(noise, np.zeros(noise.size, dtype=np.int64), used).deviation
