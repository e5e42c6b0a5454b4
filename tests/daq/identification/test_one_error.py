"""What is left of a joint's torque is one figure, of the rows of the fit, wherever it is shown."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from daq.files.model_file import model_of
from daq.identification.answer import per_joint
from daq.identification.identification_json import identification_json
from daq.identification.terminal import print_identification
from daq.report.page import ReportContent, render
from daq.text.numbers import percent
from ident import Fitted, identify
from ident.recording import Recording
from tests.ident.pinocchio_arm import record, tx40


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(5, encoder=0.0, noise=0.3, seconds=20.0)


@pytest.fixture(scope="module")
def fitted(recording: Recording) -> Fitted:
    return identify(tx40(), (recording,))


def left(fitted: Fitted, joint: int | None) -> float:
    """By its definition, %: of one joint, or of all."""
    rows = fitted.rows
    used = rows.used if joint is None else rows.used & (np.arange(rows.joints) == joint)
    rest = (rows.torque - rows.predicted(fitted.least_squares.beta))[used]
    return float(100.0 * np.linalg.norm(rest) / np.linalg.norm(rows.torque[used]))


def test_rows_are_left_out_that_would_change_the_figures(fitted: Fitted) -> None:
    rows = fitted.rows
    rest = rows.torque - rows.predicted(fitted.least_squares.beta)
    everywhere = 100.0 * np.linalg.norm(rest, axis=0) / np.linalg.norm(rows.torque, axis=0)
    of_the_fit = [left(fitted, joint) for joint in range(rows.joints)]
    assert all(percent(a) != percent(b) for a, b in zip(everywhere, of_the_fit, strict=True))


def test_the_error_of_a_joint_is_one_figure_everywhere(fitted: Fitted, tmp_path: Path) -> None:
    robot, result = fitted.base.model.robot, fitted.result
    assert result.recommended is result.least_squares
    expected = [left(fitted, joint) for joint in range(robot.n)]
    shown = [percent(value) for value in expected]

    assert [row[1] for row in per_joint(result, robot)[1]] == shown
    terminal = StringIO()
    print_identification(Console(file=terminal, width=80), fitted)
    assert all(f" {value} " in terminal.getvalue() for value in shown)

    of_json = identification_json(result, ("log",))["estimates"]["ls"]["relative_error_percent"]
    assert of_json["per_joint"] == pytest.approx(expected, rel=1e-9)
    assert of_json["total"] == pytest.approx(left(fitted, None), rel=1e-9)

    names = tuple(joint.name for joint in robot.joint)
    page = render(ReportContent("a report", robot, result, names))
    for value in shown:
        assert page.count(value) >= 2  # beside its traces and in the table of estimators
    assert percent(left(fitted, None)) in page

    assert result.worst is not None
    assert result.worst.error_percent == pytest.approx(expected[result.worst.joint], rel=1e-9)

    log = tmp_path / "log.csv"
    log.write_text("recorded", encoding="utf-8")
    model = model_of(fitted, (log,), robot)
    assert model.estimate.relative_error_percent == pytest.approx(left(fitted, None), rel=1e-9)
