"""The files that an identification leaves in its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from daq.files.model_file import write_model
from daq.identification.identification_json import identification_json
from daq.identification.torque_noise import torque_noise
from daq.report.check_view import CheckView
from daq.report.page import MotionTrace, ReportContent, write_report
from ident import Fitted, Recording
from ident.effects.entry import found_words
from robots import Robot


def write_results(
    folder: Path,
    robot: Robot,
    fitted: Fitted,
    captures: Sequence[Path],
    recordings: Sequence[Recording],
    *,
    title: str,
    facts: Mapping[str, str],
    truth: Mapping[str, float] | None = None,
) -> Path:
    """Write result.json, the model file and the report; returns the report's path.

    Args:
        folder: exists and is writable.
        robot: the arm, with the settings that were used.
        fitted: the identification.
        captures: what it was made from.
        recordings: what they hold.
        title: of the report.
        facts: how the data was made, label → text.
        truth: base parameters of a simulated arm by name, SI; None for a real one.

    Raises:
        ModelFileError, ReportError: a file cannot be written.
    """
    content = identification_json(fitted.result, [str(path) for path in captures], truth)
    text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
    (folder / "result.json").write_text(text, encoding="utf-8")
    noise = torque_noise(robot, fitted.base.model.effects, recordings)
    write_model(folder / f"{robot.name}.model.toml", fitted, captures, robot, noise)
    report = folder / "report.html"
    content_of = report_content(robot, fitted, recordings, title=title, facts=facts, truth=truth)
    write_report(report, content_of)
    return report


def report_content(
    robot: Robot,
    fitted: Fitted,
    recordings: Sequence[Recording],
    *,
    title: str,
    facts: Mapping[str, str],
    truth: Mapping[str, float] | None = None,
    check: CheckView | None = None,
) -> ReportContent:
    """What the report shows.

    Args:
        robot, fitted, recordings, title, facts, truth: as of :func:`write_results`.
        check: that the identification was made for; None where it was made for itself.
    """
    if fitted.result.found:
        facts = {**facts, "Found effects": found_words(fitted.result.found)}
    return ReportContent(
        title=title,
        robot=robot,
        identification=fitted.result,
        joint_names=tuple(joint.name for joint in robot.joint),
        truth=truth,
        facts=facts,
        motion=_motion(recordings),
        check=check,
    )


def _motion(recordings: Sequence[Recording]) -> MotionTrace | None:
    """Positions beside their references, of all recordings that have both."""
    with_reference = [(one, one.reference) for one in recordings if one.reference is not None]
    if not with_reference:
        return None
    time = [one.time - one.time[0] for one, _ in with_reference]
    measured = [one.position for one, _ in with_reference]
    reference = [reference for _, reference in with_reference]
    return MotionTrace(np.concatenate(time), np.concatenate(measured), np.concatenate(reference))
