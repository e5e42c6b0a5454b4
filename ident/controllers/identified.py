"""Identify the drives' controller from (q_r, q_mes) → v_τ, where it is not known (method.md 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from ident.controllers.columns import LoopSignals
from ident.controllers.gains import Products, factors, solve_gains
from ident.controllers.selection import Blocks, best_form, best_timing, explained, held_out
from ident.controllers.structure import FREE, Form, Timing
from ident.covariances import Autoregressive, covariance_of, estimated_rows
from ident.errors import IdentificationError
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Controller, Robot

LEAST_EXPLAINED = 0.99
"""Share of v_τ's variation on held-out blocks below which IDIM-IV is not allowed: a tenth in amplitude."""

_FIRST_SAMPLES = 10
"""Left out: filters and delays of the loop begin in a state that was not recorded."""

_FEWEST = 400
_COMPLETE = 0.25
"""By how much a free combination of all columns may be better, in ln of the mean square error."""


@dataclass(frozen=True)
class LoopGain:
    """One gain of one drive: its key in robot.toml, value and standard deviation, in that key's unit."""

    key: str
    value: float
    sigma: float


@dataclass(frozen=True)
class DriveLoop:
    """The loop of one drive (from 1): its gains, and the share of v_τ explained on held-out blocks."""

    drive: int
    gains: tuple[LoopGain, ...]
    explained: float


@dataclass(frozen=True)
class IdentifiedController:
    """The control law that explains the control signals best.

    Attributes:
        controller: as robot.toml would describe it, to simulate with; None where a gain came out impossible.
        drives: gains with σ and quality, one per drive.
        form: which terms the law has.
        timing: interpolation, velocity, delay.
        reason: why IDIM-IV must not rest on it; empty where it may.
        notes: what the data leave open, one sentence each.
    """

    controller: Controller | None
    drives: tuple[DriveLoop, ...]
    form: Form
    timing: Timing
    reason: str
    notes: tuple[str, ...]

    @property
    def explained(self) -> FloatArray:
        """Share of v_τ explained on held-out blocks, (n,)."""
        return np.array([drive.explained for drive in self.drives])

    @property
    def trusted(self) -> bool:
        """Whether instruments may be simulated with it."""
        return not self.reason


def identify_controller(robot: Robot, recordings: tuple[Recording, ...]) -> IdentifiedController:
    """Find the drives' control law from set-points, positions and control signals.

    The described sample time, limits and SYNC are taken as they are; type, gains, feed-forward, velocity
    measurement, delay and interpolation are found. The longest recording is used: the integral starts each
    in another state.

    Args:
        robot: the arm; its described controller is kept where the data do not say better.
        recordings: with references.

    Raises:
        IdentificationError: no reference, too short, a drive that never moves, or sampling that is not a
            multiple of the controller's.
    """
    signals = _signals(robot, recordings)
    blocks = Blocks(signals)
    described = robot.controller
    timing = best_timing(blocks, described)
    form = best_form(blocks, timing, described).chosen
    timing = best_timing(blocks, described, (form,))
    forms = best_form(blocks, timing, described)
    form = forms.chosen
    folds = blocks.products(timing)
    columns = signals.columns(timing)
    drives = tuple(_drive(k, form, signals, columns, explained(form, folds[k])) for k in range(robot.n))
    notes = list(_notes(signals, forms.as_good()))
    controller, impossible = _controller(described, form, timing, drives)
    incomplete = _incomplete(folds, form)
    if incomplete:
        notes.append(incomplete)
    return IdentifiedController(
        controller, drives, form, timing, impossible or _too_poor(drives), tuple(notes)
    )


def _signals(robot: Robot, recordings: tuple[Recording, ...]) -> LoopSignals:
    if not recordings:
        raise IdentificationError("no recording to identify a controller from")
    recording = max(recordings, key=lambda one: one.time.shape[0])
    if recording.reference is None:
        raise IdentificationError(f"{recording.name}: no position reference was recorded")
    ratio = recording.sample_time / robot.controller.sample_time
    per_sample = round(ratio)
    if per_sample < 1 or abs(ratio - per_sample) > 0.01 * per_sample:
        raise IdentificationError(
            f"{recording.name}: sampled every {recording.sample_time:g} s, the controller every"
            f" {robot.controller.sample_time:g} s; allowed: a whole multiple"
        )
    if recording.time.shape[0] < _FEWEST:
        raise IdentificationError(
            f"{recording.name}: {recording.time.shape[0]} samples; allowed: at least {_FEWEST} to identify a"
            " controller"
        )
    signals = LoopSignals.of(robot, recording, per_sample)
    signals.used[:_FIRST_SAMPLES] = False
    for k in range(robot.n):
        if np.ptp(signals.targets[:, k]) == 0.0 or np.ptp(signals.signal[:, k]) == 0.0:
            raise IdentificationError(
                f"{recording.name}: drive {k + 1} never moves, so its controller does not show;"
                " move all joints"
            )
    return signals


def _drive(k: int, form: Form, signals: LoopSignals, columns: FloatArray, share: float) -> DriveLoop:
    used = signals.used[:, k]
    x, v = columns[:, k], signals.signal[:, k]
    theta, slope = solve_gains(form, Products.of(x[used], v[used]))
    jacobian = (x @ slope)[:, np.newaxis]
    residual = (v - x @ factors(form, theta))[:, np.newaxis]
    sigma = np.array([max(float(np.std(residual[used])), 1e-12 * float(np.std(v)))])
    segment = np.zeros(v.size, dtype=np.int64)
    rows = estimated_rows(jacobian, jacobian, residual, sigma, segment, used[:, np.newaxis])
    covariance = covariance_of(rows, Autoregressive())
    return DriveLoop(k + 1, _gains(form, theta, covariance), share)


def _gains(form: Form, theta: FloatArray, covariance: FloatArray) -> tuple[LoopGain, ...]:
    """θ as the keys of robot.toml, with σ by the slopes of the quotients."""
    a, b = theta[0], theta[1]
    cascade = form.law == "cascade_p_pi"
    unit = np.eye(theta.size)
    by_b = unit[1] / b
    found = [
        ("position_gain", a / b, unit[0] / b - a / b * by_b) if cascade else ("position_gain", a, unit[0]),
        ("velocity_gain", b, unit[1]),
    ]
    place = 2
    if form.velocity_feed_forward:
        c = theta[2]
        found.append(("velocity_feed_forward", c / b, unit[2] / b - c / b * by_b))
        place = 3
    if form.law != "pd":
        found.append(("integral_gain", theta[place], unit[place]))
    if form.acceleration_feed_forward:
        found.append(("acceleration_feed_forward", theta[-1], unit[-1]))
    return tuple(
        LoopGain(key, float(value), float(np.sqrt(slope @ covariance @ slope))) for key, value, slope in found
    )


def _controller(
    described: Controller, form: Form, timing: Timing, drives: tuple[DriveLoop, ...]
) -> tuple[Controller | None, str]:
    """The controller to simulate with, or what is impossible about it."""
    n = len(drives)
    values = {
        gain.key: tuple(drive.gains[place].value for drive in drives)
        for place, gain in enumerate(drives[0].gains)
    }
    for name in ("velocity_feed_forward", "integral_gain"):
        # What is slightly negative, within its errors, is none.
        values[name] = tuple(0.0 if -0.02 < v < 0.0 else v for v in values.get(name, (0.0,) * n))
    law: str = form.law
    if law == "pd" and described.type != "pd":
        # The same law: a cascade without integral multiplies its two gains.
        law = "cascade_p_pi"
        position, velocity = values["position_gain"], values["velocity_gain"]
        values["position_gain"] = tuple(a / b for a, b in zip(position, velocity, strict=True))
    wanted: dict[str, Any] = described.model_dump() | {
        "type": law,
        "friction_feed_forward": None,
        "acceleration_feed_forward": None,
        **values,
        "velocity_difference_samples": timing.difference,
        "velocity_cutoff_hz": timing.cutoff_hz,
        "delay_samples": timing.delay,
        "interpolation": timing.interpolation,
    }
    try:
        return Controller.model_validate(wanted), ""
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key, *place = first["loc"]
        drive = f" of drive {int(place[0]) + 1}" if place else ""
        return None, (
            f"no controller: the {key}{drive} that explains the control signal best is {first['input']:.4g};"
            " the law is none of P-PI, PD and PID"
        )


def _too_poor(drives: tuple[DriveLoop, ...]) -> str:
    worst = min(drives, key=lambda drive: drive.explained)
    if worst.explained >= LEAST_EXPLAINED:
        return ""
    return (
        f"the controller found explains {100 * worst.explained:.3g} % of the control signal of drive"
        f" {worst.drive} on blocks that it was not fitted on; at least {100 * LEAST_EXPLAINED:g} % are needed"
        " to simulate with it"
    )


def _incomplete(folds: list[list[Products]], form: Form) -> str:
    """Whether a combination of the same columns without any law would predict much better."""
    gap = [
        float(np.mean(np.log(held_out(form, drive)) - np.log(np.maximum(held_out(FREE, drive), 1e-300))))
        for drive in folds
    ]
    worst = int(np.argmax(gap))
    if gap[worst] < _COMPLETE:
        return ""
    return (
        f"drive {worst + 1}: a free combination of the same signals would leave {np.exp(-gap[worst]):.0%} of"
        " the error; the law has a part that none of the known laws has"
    )


def _notes(signals: LoopSignals, as_good: tuple[Form, ...]) -> list[str]:
    notes = []
    if signals.per_sample > 1:
        notes.append(
            f"one position in {signals.per_sample} that the drive read was recorded; the others are"
            " interpolated, so encoder noise between two SYNCs stays unexplained"
        )
    fewer = [form.words() for form in as_good if not form.acceleration_feed_forward]
    if fewer:
        notes.append(f"the data do not tell this law from: {', '.join(fewer)}")
    notes.append(
        "a delay between control signal and torque does not show here; limits are those of the description"
    )
    return notes
