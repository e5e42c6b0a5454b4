"""Known bodies that the arm carries in some recordings: what nobody knows of them is found from the data.

Often only the mass is known. Where its centre and inertia show, beside the parameters of the arm, they are
fitted together with these:

    y = X β + Z θ + ε ,    θ ~ N(0, S²) before any data.

S is the size of what an arm of this size carries. Directions of θ that the rows show to better than S take
the values of the fit; the others stay at zero. β̂ = X⁺(y − Zθ̂) is then that of the joint fit, and its
covariance is that for a known θ, wider by X⁺Z Cov(θ̂) (X⁺Z)ᵀ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.decimation import decimate
from ident.effects import RigidBody, State
from ident.effects.scales import payload
from ident.estimators.fit import LinearFit, stack, stack_columns
from ident.estimators.least_squares import joint_deviations
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observe
from ident.recording import Recording
from ident.signals import motion, own_rows, own_settings
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray
from robots.carried import Load
from robots.standard import LINK_SYMBOLS


@dataclass(frozen=True, eq=False)
class Unknown:
    """What of the bodies was not known: one entry per body with something unknown, in their order.

    Attributes:
        loads: as they were given.
        covariance: (k, k) of everything that was not known, after the data.
        seen: (k,) share of each unknown's variance that the data have taken away.
        values: (k,).
    """

    loads: tuple[Load, ...] = ()
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    seen: FloatArray = field(default_factory=lambda: np.zeros(0))
    values: FloatArray = field(default_factory=lambda: np.zeros(0))

    def found(self, load: Load) -> Load:
        """A body with what the data say of it."""
        start = 0
        for one in self.loads:
            if one is load:
                return one.with_values(self.values[start : start + len(one.unknown)])
            start += len(one.unknown)
        return load

    def complete(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        """The recordings with bodies of which everything is known."""
        return tuple(
            one if one.load is None or not one.load.unknown else replace(one, load=self.found(one.load))
            for one in recordings
        )

    def sentences(self) -> tuple[str, ...]:
        """What was found and what was not, one line per body."""
        told, start = [], 0
        deviation = np.sqrt(np.diag(self.covariance))
        for load in self.loads:
            part = slice(start, start + len(load.unknown))
            start = part.stop
            shown = [
                f"{LINK_SYMBOLS[index]} {value:.3g} ± {sigma:.1g}"
                for index, value, sigma, seen in zip(
                    load.unknown, self.values[part], deviation[part], self.seen[part], strict=True
                )
                if seen > 0.5 and index < _INERTIA
            ]
            rest = int(np.sum(self.seen[part] <= 0.5))
            words = f"its centre times mass is {', '.join(shown)} kg·m" if shown else ""
            hidden = (
                f"{rest} of the {len(load.unknown)} unknown figures do not show and widen the σ of the arm's"
            )
            told.append(f"{load.name}: {'; '.join(filter(None, [words, hidden if rest else '']))}")
        return tuple(told)


_INERTIA = 4
"""The first of a link's ten parameters that is an inertia."""


def unknown_of(base: BaseParameters, recordings: Sequence[Recording]) -> Unknown:
    """What the recordings say of what is not known of the bodies in them.

    Args:
        base: the parameters of the arm, with the settings of the rows.
        recordings: that are fitted to.

    Raises:
        IdentificationError: rows that do not determine the parameters of the arm.
    """
    loads = _unknown_loads(recordings)
    if not loads:
        return Unknown()
    rows = observe(base, tuple(recordings), base.model.robot.identification)
    added = columns_of(base, recordings, loads)
    size = _sizes(base, loads)
    sigma = joint_deviations(stack(replace(rows, regressor=np.concatenate([rows.regressor, added], axis=2))))
    weight = (1.0 / sigma)[np.repeat(np.arange(rows.joints), rows.used.sum(axis=0))]
    x = stack_columns(rows.regressor, rows.used) * weight[:, np.newaxis]
    z = stack_columns(added, rows.used) * weight[:, np.newaxis] * size
    scale = np.linalg.norm(x, axis=0)
    basis = np.linalg.qr(x / np.where(scale > 0.0, scale, 1.0))[0]
    beside = z - basis @ (basis.T @ z)
    known, directions = eigen_of(beside.T @ beside)
    shows = known > 1.0
    chosen = size[:, np.newaxis] * directions[:, shows]
    values, covariance = _fitted(base, rows, added @ chosen, sigma)
    hidden = size[:, np.newaxis] * directions[:, ~shows]
    whole = chosen @ covariance @ chosen.T + hidden @ hidden.T
    return Unknown(loads, whole, 1.0 - np.diag(whole) / size**2, chosen @ values)


def _fitted(
    base: BaseParameters, rows: Rows, added: FloatArray, sigma: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values (k,) of columns beside those of the arm, and their covariance with errors that remember."""
    from ident.covariances import covariance_named, covariance_of, estimated_rows  # most know their loads

    k = added.shape[2]
    if not k:
        return np.zeros(0), np.zeros((0, 0))
    regressor = np.concatenate([rows.regressor, added], axis=2)
    stacked = stack(replace(rows, regressor=regressor))
    weight = stacked.spread(1.0 / sigma)
    x = stacked.x * weight[:, np.newaxis]
    scale = np.linalg.norm(x, axis=0)
    whole = np.linalg.lstsq(x / scale, stacked.y * weight, rcond=None)[0] / scale
    settings = base.model.robot.identification
    name = "hac" if settings.covariance in ("ar", "block") else settings.covariance
    estimated = estimated_rows(
        regressor, regressor, rows.torque - regressor @ whole, sigma, rows.segment, rows.used
    )
    return whole[-k:], covariance_of(estimated, covariance_named(name))[-k:, -k:]


def columns_of(base: BaseParameters, recordings: Sequence[Recording], loads: Sequence[Load]) -> FloatArray:
    """Torque per unit of everything that is not known of the bodies: rows × joints × k."""
    robot = base.model.robot
    settings, body = robot.identification, RigidBody(robot)
    parts = []
    for recording in recordings:
        moved = motion(recording.time, recording.position, own_settings(recording, settings))
        pieces = []
        for load in loads:
            columns = np.zeros((*moved.position.shape, len(load.unknown)))
            if recording.load is load:
                state = State(moved.position, moved.velocity, moved.acceleration)
                columns = body.columns_from(load.link, state)[:, :, list(load.unknown)]
            pieces.append(columns)
        whole = np.concatenate(pieces, axis=2)
        thin = decimate(whole.reshape(whole.shape[0], -1), settings.decimation, settings.decimation_filter)
        parts.append(own_rows(thin.reshape(-1, *whole.shape[1:]), recording, settings))
    return np.concatenate(parts)


def spread_of(
    fit: LinearFit, base: BaseParameters, rows: Rows, recordings: Sequence[Recording], unknown: Unknown
) -> FloatArray | None:
    """(b, b) covariance of the parameters by what is not known of the bodies; None where all is.

    Args:
        fit: with bodies that were completed.
        base: its parameters.
        rows: that it was fitted to.
        recordings: that these are of, with bodies as they were given.
        unknown: of these.
    """
    if not unknown.loads:
        return None
    weight = (1.0 / fit.sigma)[np.repeat(np.arange(rows.joints), rows.used.sum(axis=0))][:, np.newaxis]
    x = stack_columns(rows.regressor, rows.used) * weight
    z = stack_columns(columns_of(base, recordings, unknown.loads), rows.used) * weight
    scale = np.linalg.norm(x, axis=0)
    share = np.linalg.lstsq(x / scale, z, rcond=None)[0] / scale[:, np.newaxis]
    return np.asarray(share @ unknown.covariance @ share.T)


def _unknown_loads(recordings: Sequence[Recording]) -> tuple[Load, ...]:
    """Bodies with something unknown, each once."""
    found: list[Load] = []
    for recording in recordings:
        load = recording.load
        if load is not None and load.unknown and all(load is not one for one in found):
            found.append(load)
    return tuple(found)


def _sizes(base: BaseParameters, loads: Sequence[Load]) -> FloatArray:
    """(k,) deviation of each unknown before any data."""
    lever = payload(base.model.robot)[1]
    return np.array(
        [load.mass * (lever if index < _INERTIA else lever**2) for load in loads for index in load.unknown]
    )
