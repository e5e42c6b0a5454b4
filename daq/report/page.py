"""The report of one identification: a single page that says whether to trust the model, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from daq.report.check_view import CheckView
from daq.report.consistency import consistency_view
from daq.report.gates import gate_views, statistic_text, verdict_view
from daq.report.parameters import joint_heading, parameter_groups, third_estimate, truth_summaries
from daq.report.signals import essential_view, held_out_rows, signals_view
from daq.report.templates import templates, write_page
from daq.report.traces import PLOTS, POLICY, TraceFigure, pixels_per_trace, position_figure, trace_figure
from daq.text.numbers import NOTHING, correlation, count, percent, probability, setting, significant
from daq.text.verdict_words import words_of
from ident.results import Estimate, Identification
from robots.arrays import FloatArray
from robots.description import Robot

_FILTERS = {"chebyshev": "Chebyshev filter of order 8 both ways", "fir": "finite filter of four rows' reach"}


@dataclass(frozen=True)
class ClosedLoopTrace:
    """Joint positions of the real run and of the simulated one, rad or m, samples × joints."""

    time: FloatArray
    measured: FloatArray
    simulated: FloatArray


@dataclass(frozen=True)
class MotionTrace:
    """Joint positions beside their references, rad or m, samples × joints, recording after recording."""

    time: FloatArray
    measured: FloatArray
    reference: FloatArray


@dataclass(frozen=True)
class ReportContent:
    """Everything that the page shows."""

    title: str
    robot: Robot
    identification: Identification
    joint_names: tuple[str, ...]
    truth: Mapping[str, float] | None = None
    """True values of the base parameters by name, where a simulated arm tells them."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """How the data was made, label → text, in the order shown."""
    closed_loop: ClosedLoopTrace | None = None
    motion: MotionTrace | None = None
    """What was recorded; None where no reference was."""
    check: CheckView | None = None
    """Of the check that the identification was made for; its page begins with it."""


@dataclass(frozen=True)
class EstimatorColumn:
    """What one estimator says of each joint, and of the whole."""

    label: str
    total: str
    per_joint: tuple[tuple[str, str, str], ...]
    settings: tuple[tuple[str, str], ...]


def write_report(path: Path, content: ReportContent) -> None:
    """Write the page: one HTML file that needs no other file and no network.

    The same content gives the same bytes.

    Raises:
        ReportError: the file cannot be written.
    """
    write_page(path, render(content), "report")


def render(content: ReportContent) -> str:
    """The page as text."""
    identification = content.identification
    truth = dict(content.truth) if content.truth is not None else None
    textbook = identification.textbook
    has_iv = identification.instrumental is not None
    third = third_estimate(identification)
    groups = parameter_groups(identification, truth, content.joint_names)
    return (
        templates()
        .get_template("report.html.j2")
        .render(
            title=content.title,
            check=content.check,
            robot=content.robot,
            test=identification.test,
            verdict=verdict_view(identification, content.joint_names),
            gates=gate_views(identification),
            textbook=textbook,
            textbook_statistic=statistic_text(textbook) if textbook is not None else "",
            textbook_p=probability(textbook.p_value) if textbook is not None else "",
            figures=_torque_figures(content),
            loop_figures=_closed_loop_figures(content),
            motion_figures=_motion_figures(content),
            script=PLOTS,
            policy=POLICY,
            joints=[joint_heading(j, name) for j, name in enumerate(content.joint_names)],
            joint_units=[joint.torque_unit for joint in content.robot.joint],
            estimators=_estimators(identification),
            groups=groups,
            has_picture=has_iv or truth is not None or third is not None,
            third="" if third is None else _label(third),
            has_expression=any(row.expression for group in groups for row in group.rows),
            has_iv=has_iv,
            iv_reason=identification.instrumental_reason,
            has_truth=truth is not None,
            summaries=truth_summaries(identification, truth),
            warnings=identification.warnings,
            signals=signals_view(identification, content.robot, content.joint_names),
            held_out=held_out_rows(identification.held_out),
            consistency=consistency_view(identification.consistency),
            essential=essential_view(identification.essential),
            settings=_settings(content.robot),
            facts=content.facts,
        )
    )


def _torque_figures(content: ReportContent) -> list[TraceFigure]:
    trace = content.identification.trace
    estimate = content.identification.least_squares
    joints = len(content.joint_names)
    pixels = pixels_per_trace(3 * joints * (1 if content.closed_loop is None else 2))
    figures = []
    for j, name in enumerate(content.joint_names):
        unit = content.robot.joint[j].torque_unit
        numbers = (
            ("relative error", percent(float(estimate.relative_error_percent_per_joint[j]))),
            ("rms", f"{significant(float(estimate.torque_rms[j]))} {unit}"),
            ("lag-1", correlation(float(estimate.lag1_autocorrelation[j]))),
        )
        figures.append(
            trace_figure(
                joint_heading(j, name),
                unit,
                numbers,
                trace.time,
                trace.measured[:, j],
                trace.predicted[:, j],
                pixels,
            )
        )
    return figures


def _closed_loop_figures(content: ReportContent) -> list[TraceFigure]:
    loop = content.closed_loop
    if loop is None:
        return []
    pixels = pixels_per_trace(6 * len(content.joint_names))
    return [
        trace_figure(
            joint_heading(j, name),
            content.robot.joint[j].unit,
            (),
            loop.time,
            loop.measured[:, j],
            loop.simulated[:, j],
            pixels,
        )
        for j, name in enumerate(content.joint_names)
    ]


def _motion_figures(content: ReportContent) -> list[TraceFigure]:
    motion = content.motion
    if motion is None:
        return []
    joints = zip(content.joint_names, content.robot.joint, strict=True)
    return [
        position_figure(j, name, joint.unit, motion.time, motion.measured[:, j], motion.reference[:, j])
        for j, (name, joint) in enumerate(joints)
    ]


def _estimators(identification: Identification) -> list[EstimatorColumn]:
    trusted = identification.recommended
    return [_estimator(estimate, estimate is trusted) for estimate in identification.estimates]


def _estimator(estimate: Estimate, trusted: bool) -> EstimatorColumn:
    per_joint = tuple(
        (percent(float(error)), significant(float(rms)), correlation(float(lag)))
        for error, rms, lag in zip(
            estimate.relative_error_percent_per_joint,
            estimate.torque_rms,
            estimate.lag1_autocorrelation,
            strict=True,
        )
    )
    iterations = count(estimate.iterations) + ("" if estimate.converged else ", did not converge")
    settings = (
        ("Condition number", significant(estimate.condition)),
        ("Covariance of the estimates", estimate.covariance_kind or NOTHING),
        ("Iterations", iterations),
        ("Shown in the banner", "yes" if trusted else "no"),
    )
    return EstimatorColumn(_label(estimate), percent(estimate.relative_error_percent), per_joint, settings)


def _label(estimate: Estimate) -> str:
    name = words_of(estimate.method)
    label = f"{name[0].upper()}{name[1:]}"
    return f"{label} ({estimate.method.upper()})" if estimate.method in {"ls", "iv"} else label


def _offset_words(offset: bool | tuple[bool, ...]) -> str:
    """Which joints have one."""
    if isinstance(offset, tuple):
        return f"of joint {', '.join(str(k + 1) for k, has in enumerate(offset) if has) or 'none'}"
    return "yes" if offset else "no"


def _settings(robot: Robot) -> list[tuple[str, str]]:
    rows = robot.identification
    sign = f"tanh(q̇ / {setting(rows.friction_width)})" if rows.friction_sign == "tanh" else "sign(q̇)"
    shown = [
        ("Robot", f"{robot.name}: {robot.description}"),
        ("Position filter", f"zero-phase Butterworth {rows.filter_order}, {setting(rows.cutoff_hz)} Hz"),
        ("Derivatives", f"central differences of order {rows.derivative_accuracy}"),
        ("Control-signal lag", f"{setting(1e3 * rows.control_signal_lag)} ms"),
        ("Decimation", f"one row in {rows.decimation}, {_FILTERS[rows.decimation_filter]}"),
        ("Trimmed", f"{rows.trim_samples[0]} samples at the start, {rows.trim_samples[1]} at the end"),
        ("Friction sign", sign),
        ("Torque offset per joint", _offset_words(rows.offset)),
        ("Margin of gate 1, regressors", f"{setting(100.0 * rows.instrument_margin)} %"),
        ("Margin of gate 1, torque", f"{setting(100.0 * rows.torque_margin)} %"),
        ("Margin of gate 1, following error", f"{setting(100.0 * rows.following_error_margin)} %"),
    ]
    controller = robot.controller
    if controller.is_given:
        loop = {"cascade_p_pi": "cascade P–PI", "pd": "PD", "pid": "PID"}[controller.type]
        shown.append(("Position loop", f"{loop}, sampled every {setting(1e3 * controller.sample_time)} ms"))
    else:
        shown.append(("Position loop", "not described: the loop is not simulated"))
    if robot.drive:
        uncertainty = max(drive.gain_relative_uncertainty for drive in robot.drive)
        shown.append(("Drive gain uncertainty", f"{setting(100.0 * uncertainty)} %"))
    return shown
