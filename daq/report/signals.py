"""What the report says of signals, rank, held-out recordings and essential parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.report.parameters import joint_heading
from daq.text.numbers import NOTHING, count, percent, probability, setting, significant, with_sigma
from daq.text.verdict_words import words_of
from ident.listing import listed
from ident.results import DroppedParameter, Essential, HeldOut, Identification, Rank, Signals
from robots.description import Robot


@dataclass(frozen=True)
class SettingRow:
    """A setting that was used beside what the data say of it."""

    label: str
    used: str
    proposed: str
    note: str


@dataclass(frozen=True)
class JointNoise:
    """Noise and quantum of one joint's position."""

    joint: str
    noise: str
    quantum: str
    unit: str


@dataclass(frozen=True)
class SignalsView:
    settings: tuple[SettingRow, ...]
    joints: tuple[JointNoise, ...]


@dataclass(frozen=True)
class HeldOutRow:
    """One estimate's prediction of one recording: relative error and rms per joint."""

    recording: str
    estimator: str
    total: str
    per_joint: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class DroppedRow:
    name: str
    percent_sigma: str
    statistic: str
    p_value: str


@dataclass(frozen=True)
class EssentialView:
    """Which parameters the data need: a sentence, and the steps of the F-tests."""

    sentence: str
    dropped: tuple[DroppedRow, ...]
    refused: DroppedRow | None


def signals_view(
    identification: Identification, robot: Robot, joint_names: Sequence[str]
) -> SignalsView | None:
    """Settings beside what the data propose, and the noise of each joint; None where it was not looked at."""
    signals = identification.signals
    if signals is None:
        return None
    rows = [
        SettingRow(
            "Cut-off of the positions",
            f"{setting(signals.cutoff_hz)} Hz",
            f"{setting(signals.proposed_cutoff_hz)} Hz",
            "five times the bandwidth of the motion, at most where it sinks into the noise",
        ),
        _lag_row(signals),
        SettingRow(
            "Width of the friction sign",
            setting(signals.friction_width),
            f"at least {significant(signals.proposed_friction_width, 2)}",
            "three deviations of the speeds' noise, rad/s or m/s",
        ),
    ]
    if identification.rank is not None:
        rows.append(_rank_row(identification.rank))
    joints = tuple(
        JointNoise(
            joint_heading(j, name),
            significant(float(noise), 2),
            significant(float(quantum), 3) if np.isfinite(quantum) else NOTHING,
            joint.unit,
        )
        for j, (name, noise, quantum, joint) in enumerate(
            zip(joint_names, signals.position_noise, signals.quantum, robot.joint, strict=True)
        )
    )
    return SignalsView(tuple(rows), joints)


def _lag_row(signals: Signals) -> SettingRow:
    estimate = "none found"
    if signals.estimated_lag is not None and signals.lag_sigma is not None:
        value, sigma = with_sigma(1e3 * signals.estimated_lag, 1e3 * signals.lag_sigma)
        estimate = f"{value} ± {sigma} ms"
    return SettingRow(
        "Lag of the control signal",
        f"{setting(1e3 * signals.lag)} ms",
        estimate,
        "from a reading to its torque; the estimate is that of the whole arm",
    )


def _rank_row(rank: Rank) -> SettingRow:
    note = "directions of the observation matrix that stand out of the noise of its own columns"
    if rank.unseen:
        note = f"not above the noise: {listed(rank.unseen)}"
    if rank.reasons:
        note += f" ({'; '.join(rank.reasons)})"
    return SettingRow("Rank", f"{rank.structural} by structure", f"{rank.data} in the data", note)


def held_out_rows(held_out: Sequence[HeldOut]) -> tuple[HeldOutRow, ...]:
    """One row per recording and estimate."""
    return tuple(
        HeldOutRow(
            entry.recording,
            words_of(entry.method),
            percent(entry.relative_error_percent),
            tuple(
                (percent(float(error)), significant(float(rms)))
                for error, rms in zip(entry.relative_error_percent_per_joint, entry.torque_rms, strict=True)
            ),
        )
        for entry in held_out
    )


def essential_view(essential: Essential | None) -> EssentialView | None:
    """The F-tests in their order; None where they were not asked for."""
    if essential is None:
        return None
    kept, dropped = len(essential.parameters), len(essential.dropped)
    sentence = f"All {count(kept)} parameters are needed."
    if dropped:
        sentence = (
            f"{count(kept)} of {count(kept + dropped)} parameters are needed:"
            " the fit without the others is not worse."
        )
    return EssentialView(
        sentence,
        tuple(_dropped(parameter) for parameter in essential.dropped),
        None if essential.refused is None else _dropped(essential.refused),
    )


def _dropped(parameter: DroppedParameter) -> DroppedRow:
    df = f"{count(round(parameter.df[0]))}, {count(round(parameter.df[1]))}"
    return DroppedRow(
        parameter.name,
        percent(parameter.percent_sigma),
        f"F({df}) = {significant(parameter.statistic)}",
        probability(parameter.p_value),
    )
