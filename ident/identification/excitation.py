"""What a motion lets one see: the rank of the data beside that of the structure, and the reasons for a gap.

The structure says which combinations of parameters exist at all (:mod:`ident.parameters.base`). Whether a
recording shows them is another matter: a joint that stands still or never accelerates shows none of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects import State
from ident.errors import IdentificationError
from ident.estimators.fit import Stacked
from ident.listing import listed
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from ident.preparation.spectrum import PositionSpectrum
from ident.recording import Recording
from ident.results import Rank
from ident.signals import kept_samples, motion, own_samples
from ident.statistics.triangle import triangle_of
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Identification

_NUMERICAL = 1e-10
"""Singular values of unit columns below this share of the largest are rounding."""

_TAKES_PART = 0.1
"""Share of a unit direction from which on a parameter is part of it."""

_STATES = 400
"""States at which the noise of the columns is computed."""

_ROWS_PER_PARAMETER = 2.0
"""Of each joint's share of the parameters."""

_FEWEST_ROWS = 24
"""Of a joint: what is said of its errors needs some."""

_SEED = 0
_SLOW = 0.02
"""Shares of the limits of speed and acceleration below which a joint hardly shows anything."""

_BACK = 1e-3
"""Share of its way that a joint which moves in one direction goes back: noise, no motion."""

_TURNS_WITH_SPEED = ("Fc", "Fcp", "Fcn", "Fcm", "Fc_cold", "Fc_heat", "Fc_settled")
"""Dry friction: its columns turn their sign with the speed."""


@dataclass(frozen=True)
class _Moved:
    """How recordings move an arm; of hours of them not all is kept.

    Attributes:
        states: positions, velocities and accelerations, states × joints each, spread over the recordings.
        travel, speed, rate: (n,) range of the positions, largest speed and acceleration.
        one_way: (n,) whether a joint moves in one direction only.
    """

    states: tuple[FloatArray, FloatArray, FloatArray]
    travel: FloatArray
    speed: FloatArray
    rate: FloatArray
    one_way: BoolArray

    @classmethod
    def of(cls, recordings: Sequence[Recording], settings: Identification) -> _Moved:
        lengths = [kept_samples(r.time.shape[0], own_samples(r, settings)) for r in recordings]
        ends = np.cumsum([0, *(kept.stop - kept.start for kept in lengths)])
        chosen = np.linspace(0, ends[-1] - 1, min(_STATES, int(ends[-1]))).astype(np.int64)
        parts, lowest, highest, fastest, quickest = [], [], [], [], []
        for recording, begin, end in zip(recordings, ends[:-1], ends[1:], strict=True):
            moved = motion(recording.time, recording.position, own_samples(recording, settings))
            own = chosen[(chosen >= begin) & (chosen < end)] - begin
            parts.append((moved.position[own], moved.velocity[own], moved.acceleration[own]))
            lowest.append(moved.position.min(axis=0))
            highest.append(moved.position.max(axis=0))
            fastest.append(np.abs(moved.velocity).max(axis=0))
            quickest.append(np.abs(moved.acceleration).max(axis=0))
        q, qd, qdd = (np.concatenate(values) for values in zip(*parts, strict=True))
        travel = np.max(highest, axis=0) - np.min(lowest, axis=0)
        return cls((q, qd, qdd), travel, np.max(fastest, axis=0), np.max(quickest, axis=0), one_way(qd))


def one_way(velocity: FloatArray) -> BoolArray:
    """(n,) which joints move in one direction, but for a thousandth of their way; velocities samples × n."""
    there, back = (np.maximum(sign * velocity, 0.0).sum(axis=0) for sign in (1.0, -1.0))
    return np.asarray(np.minimum(there, back) <= _BACK * np.maximum(there, back))


def rank_of(
    base: BaseParameters, stacked: Stacked, recordings: tuple[Recording, ...], spectrum: PositionSpectrum
) -> Rank:
    """Rank of the observation matrix against the noise of its own columns.

    Columns are scaled to unit norm. A singular value counts where it is larger than the spectral norm of what
    the positions' noise puts into the columns: below, the direction may as well be noise (Stewart 1993).

    Args:
        base: the parameters.
        stacked: rows of the recordings.
        recordings: measured positions.
        spectrum: of these positions, for their noise.

    Raises:
        IdentificationError: the rows have no information on some parameters; names them and says why.
    """
    settings = base.model.robot.identification
    moved = _Moved.of(recordings, settings)
    triangle, count = triangle_of(stacked.x), len(stacked.x)
    scale = np.linalg.norm(triangle, axis=0)
    silent = scale == 0.0
    if silent.any():
        raise _unseen("does not excite", np.flatnonzero(silent), base, moved)
    _, values, directions = np.linalg.svd(triangle / scale)
    blind = values < _NUMERICAL * values[0]
    if blind.any():
        raise _unseen("does not tell apart", _taking_part(directions[blind]), base, moved)
    floor = _noise_of_columns(base, moved, spectrum, settings) / scale * np.sqrt(count)
    level = float(np.linalg.norm(floor))
    weak = values < level
    unseen = _taking_part(directions[weak])
    return Rank(
        structural=len(base.names),
        data=int(np.count_nonzero(~weak)),
        smallest=float(values[-1]),
        noise_level=level,
        unseen=tuple(base.names[k] for k in unseen),
        reasons=tuple(_reasons(unseen, base, moved).values()),
        one_way=_without_offset(base, moved),
    )


def _without_offset(base: BaseParameters, moved: _Moved) -> tuple[int, ...]:
    """Joints, from 1, whose dry friction holds what is constant of their torque."""
    offset = np.broadcast_to(base.model.robot.identification.offset, moved.one_way.shape)
    return tuple((np.flatnonzero(moved.one_way & ~offset) + 1).tolist())


def require_enough_rows(rows: Rows, parameters: int) -> None:
    """Refuse what is too short to tell errors from parameters.

    Raises:
        IdentificationError: names the joint with the fewest rows.
    """
    counts = rows.used.sum(axis=0)
    fewest = max(_FEWEST_ROWS, int(np.ceil(_ROWS_PER_PARAMETER * parameters / rows.joints)))
    joint = int(np.argmin(counts))
    if counts[joint] < fewest:
        raise IdentificationError(
            f"{counts[joint]} rows in which joint {joint + 1} is in motion; allowed: at least {fewest} of"
            " each joint. Record for longer, or with fewer reversals"
        )


def _noise_of_columns(
    base: BaseParameters, moved: _Moved, spectrum: PositionSpectrum, settings: Identification
) -> FloatArray:
    """(b,) rms over the rows of what noise in q̇̂ and q̈̂ changes in each column.

    Noise enters through the accelerations, in which the columns are linear, and through the speeds, where
    they are smooth: one draw at states of the recording gives the size. The Coulomb columns are left out
    where they change sign with the noise; rows without a sign are no rows.
    """
    generator = np.random.default_rng(_SEED)
    q, qd, qdd = moved.states
    speed, rate = _motion_noise(spectrum, settings)
    clean = base.columns(State(q, qd, qdd))
    noisy = base.columns(
        State(
            q,
            qd + speed * generator.standard_normal(qd.shape),
            qdd + rate * generator.standard_normal(qdd.shape),
        )
    )
    difference = noisy - clean
    flips = np.abs(difference) > np.abs(clean)
    signs = np.array([parameter.symbol in _TURNS_WITH_SPEED for parameter in base.leading])
    difference[flips & signs] = 0.0
    return np.asarray(np.sqrt(np.mean(difference**2, axis=(0, 1))))


def _motion_noise(spectrum: PositionSpectrum, settings: Identification) -> tuple[FloatArray, FloatArray]:
    """(n,) deviations of q̇̂ and q̈̂ in the rows, after the low-pass and the decimation."""
    frequency = np.linspace(0.0, spectrum.rate / 2 / settings.decimation, 1000)
    passed = 1.0 / (1.0 + (frequency / settings.cutoff_hz) ** (2 * settings.filter_order)) ** 2
    omega = 2 * np.pi * frequency
    powers = (np.trapezoid(omega**k * passed, frequency) for k in (2, 4))
    speed, rate = (np.sqrt(power * spectrum.noise) for power in powers)
    return np.asarray(speed), np.asarray(rate)


def _taking_part(directions: FloatArray) -> IntArray:
    """Which parameters take part in any of the directions, k × b."""
    return np.flatnonzero((np.abs(directions) > _TAKES_PART).any(axis=0))


def _unseen(what: str, which: IntArray, base: BaseParameters, moved: _Moved) -> IdentificationError:
    reasons = _reasons(which, base, moved)
    first, *others = reasons or (0,)
    why = reasons[first] if reasons else ""
    if others:
        why += f"; look at joint{'s' * (len(others) > 1)} {', '.join(map(str, others))} too"
    advice = why or "the joints move in step with one another; record a more exciting trajectory"
    return IdentificationError(f"the motion {what} {listed([base.names[k] for k in which])}: {advice}")


def _reasons(which: IntArray, base: BaseParameters, moved: _Moved) -> dict[int, str]:
    """Why parameters cannot be seen: which of the joints they belong to stand still or are too slow."""
    robot = base.model.robot
    found: dict[int, str] = {}
    joints = (base.leading[k].joint for k in which)
    for joint in sorted({joint for joint in joints if joint is not None}):
        unit = robot.joint[joint].unit
        travel, speed, rate = (float(values[joint]) for values in (moved.travel, moved.speed, moved.rate))
        limits = robot.joint[joint]
        if travel < 1e-3 * float(robot.upper[joint] - robot.lower[joint]):
            found[joint + 1] = f"joint {joint + 1} does not move ({travel:.2g} {unit} in all)"
        elif speed < _SLOW * limits.velocity:
            found[joint + 1] = f"joint {joint + 1} moves too slowly (at most {speed:.2g} {unit}/s)"
        elif rate < _SLOW * limits.acceleration:
            found[joint + 1] = f"joint {joint + 1} hardly accelerates (at most {rate:.2g} {unit}/s²)"
    same = [joint + 1 for joint in np.flatnonzero(moved.one_way) if _constant(base, which, int(joint))]
    if new := [joint for joint in same if joint not in found]:
        found[int(new[0])] = (
            f"joint {', '.join(map(str, same))} moves one way only, so dry friction is constant as its offset"
            " is: record the way back, or set no offset there (robot.toml)"
        )
    return found


def _constant(base: BaseParameters, which: IntArray, joint: int) -> bool:
    """Whether both constants of a joint that moves one way only are among these parameters."""
    symbols = {base.leading[k].symbol for k in which if base.leading[k].joint == joint}
    return "off" in symbols and bool(symbols & set(_TURNS_WITH_SPEED))
