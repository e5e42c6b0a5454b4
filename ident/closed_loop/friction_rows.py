"""Friction as rows of numbers: what compiled code and plain Python both work on."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.effects import FrictionSign, SpeedTerm
from ident.effects.simulated import Bristle, FrictionTorque, SoftConstraint, SpeedLaw
from ident.kernels.values import BRISTLE, CONSTRAINT, LAW_CELLS, LINEAR, SLIP, TABULATED, TANH
from robots.arrays import FloatArray

_SHARP = 1e-6
"""Width of the smooth sign that stands for an exact one, as a share of the arm's velocity limits."""

_SHORT = 1e-3
"""Steps that are shorter, as a share of a term's time constant, take it as the mean of old and new."""

FASTEST = 3.0
"""End of a tabulated law, as a multiple of the speed at the arm's velocity limits."""


@dataclass(frozen=True)
class FrictionRows:
    """K terms of friction: strength · torque row · law(speed row · q̇), each law growing with speed.

    A parameter that makes friction push (a negative Coulomb friction) is a negative strength: torque row and
    speed row of a term never point against each other.

    Attributes:
        heads: (K, 4) 1/width, kind of law, direction, number of the tabulated law or what is below zero.
        speed, torque: (K, n) rows.
        strength: (K,).
        laws: tabulated laws, (2 · LAW_CELLS + 1,) each.
        sources: (K,) which friction torque a term is of; (0,) for speed terms.
    """

    heads: FloatArray
    speed: FloatArray
    torque: FloatArray
    strength: FloatArray
    laws: tuple[FloatArray, ...] = ()
    sources: tuple[int, ...] = ()


def speed_term_rows(terms: Sequence[tuple[SpeedTerm, float]], n: int) -> FrictionRows:
    """Rows of speed terms with their parameters; an exact sign has become a smooth one before."""
    rows = _Rows(n)
    for term, value in terms:
        kind, scale = _plain(term.law)
        rows.add(
            (scale, kind, term.direction, -1),
            np.array(term.speed_row),
            value * np.array(term.torque_row),
        )
    return rows.rows()


def friction_rows(torques: Iterable[FrictionTorque], limits: FloatArray, h: float) -> FrictionRows:
    """Rows of friction torques.

    A law that is a function is tabulated, with its rising and its falling parts as two terms: the falling
    one has a strength of the other sign.

    Args:
        torques: any number.
        limits: (n,) velocity limits of the joints.
        h: integration step, s.
    """
    rows = _Rows(limits.size)
    for source, torque in enumerate(torques):
        speed, share = np.asarray(torque.speed_row, float), np.asarray(torque.torque_row, float)
        rows.source = source
        law = torque.law
        if isinstance(law, FrictionSign) and law.kind == "sign":
            law = FrictionSign("tanh", _SHARP * float(limits.min()))
        if isinstance(law, Bristle):
            kind = BRISTLE if law.kind == "exponential" else SLIP
            rows.add((h / law.length, kind, torque.direction, -1), speed, share)
        elif isinstance(law, SoftConstraint):
            # v + time·(v − v before)/h, over the width.
            past = law.time / (h + law.time)
            scale = (1.0 + law.time / h) / law.width
            rows.add((scale, CONSTRAINT, torque.direction, -1.0 - past), speed, share)
        elif law is None or isinstance(law, FrictionSign):
            kind, scale = _plain(law)
            rows.add((scale, kind, torque.direction, -1), speed, share)
        else:
            fastest = FASTEST * float(np.abs(speed) @ limits)
            for part, sign in zip(_rising_and_falling(law, fastest), (1.0, -1.0), strict=True):
                if part.any():
                    head = (1.0 / fastest, TABULATED, torque.direction, len(rows.laws))
                    rows.laws.append(part)
                    rows.add(head, speed, share, sign)
    return rows.rows()


def shares_at_new_velocity(
    heads: FloatArray,
    speed: FloatArray,
    torque: FloatArray,
    strength: FloatArray,
    mass: FloatArray,
    h: float,
) -> FloatArray:
    """How much of each term a step takes at its new velocity, (K,); the rest is taken at the old one.

    A term at the new velocity alone is half a step early, so that viscous friction acts as inertia and dry
    friction turns too soon; the mean of both would let stiff friction at standstill swing for ever. The share
    1/(1 − e⁻ᶻ) − 1/z, with z the step times the rate at which the term alone would stop the arm, is one half
    where the step is short and one where friction is stiff; decay at a constant rate comes out exact
    (exponential fitting: Liniger and Willoughby 1970). Terms of other laws than ``LINEAR`` and ``TANH`` are
    taken at the new velocity, those of negative strength at the old one.

    Args:
        heads: (K, 4) as of ``FrictionRows``.
        speed, torque: (K, m) rows.
        strength: (K,).
        mass: (m, m) of the arm, with its drives.
        h: step, s.
    """
    admittance = np.sum(speed * torque / np.maximum(np.abs(np.diag(mass)), 1e-300), axis=1)
    z = h * np.abs(strength * heads[:, 0] * admittance)
    fitted = np.where(z > _SHORT, 1.0 / -np.expm1(-np.maximum(z, _SHORT)) - 1.0 / np.maximum(z, _SHORT), 0.5)
    share = np.where((heads[:, 1] == LINEAR) | (heads[:, 1] == TANH), fitted, 1.0)
    return np.asarray(np.where(strength > 0.0, share, 0.0))


def together(usual: FrictionRows, more: FrictionRows, apart: Collection[int]) -> FrictionRows:
    """All terms; those of one law over one speed are added up, direction by direction.

    So a term that lessens another one is part of a law that still grows with speed, as long as the sum does.

    Args:
        usual, more: the terms.
        apart: sources of ``more`` that are left as they are, since they change with the motion.
    """
    n = usual.speed.shape[1]
    out, sums = _Rows(n), dict[tuple[bytes, ...], tuple[FloatArray, FloatArray, FloatArray, FloatArray]]()
    for rows in (usual, more):
        for k, head in enumerate(rows.heads):
            source = rows.sources[k] if rows is more else -1
            if source in apart or head[1] not in (LINEAR, TANH):
                out.source = source
                if head[3] >= 0:
                    head = np.array([*head[:3], len(out.laws)])
                    out.laws.append(rows.laws[int(rows.heads[k, 3])])
                out.add(tuple(head), rows.speed[k], rows.torque[k], float(rows.strength[k]))
                continue
            size = float(np.linalg.norm(rows.torque[k]))
            if size == 0.0:
                continue
            along = rows.torque[k] / size
            key = (head[:2].tobytes(), rows.speed[k].tobytes(), np.round(along, 12).tobytes())
            sums.setdefault(key, (head, rows.speed[k], along, np.zeros(3)))[3][int(head[2])] += (
                size * rows.strength[k]
            )
    out.source = -1
    for head, speed, along, (always, forwards, backwards) in sums.values():
        parts = [(0, always)]
        if forwards or backwards:
            parts = [(1, always + forwards), (-1, always + backwards)]
        for direction, size in parts:
            if size:
                out.add((*head[:2], direction, -1), speed, size * along)
    return out.rows()


@dataclass
class _Rows:
    n: int
    heads: list[tuple[float, ...]] = field(default_factory=list)
    speed: list[FloatArray] = field(default_factory=list)
    torque: list[FloatArray] = field(default_factory=list)
    strength: list[float] = field(default_factory=list)
    laws: list[FloatArray] = field(default_factory=list)
    sources: list[int] = field(default_factory=list)
    source: int = -1

    def add(
        self, head: tuple[float, ...], speed: FloatArray, torque: FloatArray, strength: float = 1.0
    ) -> None:
        against = float(speed @ torque) < 0.0
        self.heads.append(head)
        self.speed.append(speed)
        self.torque.append(-torque if against else torque)
        self.strength.append(-strength if against else strength)
        self.sources.append(self.source)

    def rows(self) -> FrictionRows:
        return FrictionRows(
            np.array(self.heads, dtype=np.float64).reshape(-1, 4),
            np.array(self.speed).reshape(-1, self.n),
            np.array(self.torque).reshape(-1, self.n),
            np.array(self.strength, dtype=np.float64),
            tuple(self.laws),
            tuple(self.sources),
        )


def _plain(law: FrictionSign | None) -> tuple[int, float]:
    return (LINEAR, 1.0) if law is None else (TANH, 1.0 / law.width)


def _rising_and_falling(law: SpeedLaw, fastest: float) -> tuple[FloatArray, FloatArray]:
    """A law as a rising function less another rising one, at speeds spaced by squares."""
    assert callable(law)
    cells = np.arange(-LAW_CELLS, LAW_CELLS + 1)
    speeds = np.sign(cells) * fastest * (cells / LAW_CELLS) ** 2
    values = np.asarray(law(speeds), dtype=np.float64)
    steps = np.diff(values)
    rising, falling = (np.concatenate([[0.0], np.cumsum(np.maximum(s, 0.0))]) for s in (steps, -steps))
    at_rest = LAW_CELLS
    return rising - rising[at_rest] + values[at_rest], falling - falling[at_rest]
