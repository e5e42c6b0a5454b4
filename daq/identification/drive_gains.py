"""``armhil gain``: drive gains from recordings with and without a known payload."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.files.payload_file import read_payload
from daq.importing.captures import loaded_capture
from daq.importing.load import load_recording
from daq.recording.described_arm import described
from daq.text.numbers import percent, with_sigma
from daq.text.progress import Steps
from ident import RegressorModel, base_parameters
from ident.identification.drive_gain import DriveGain, GainFit, identify_drive_gains
from ident.preparation.checks import check_recordings
from robots import Robot


@dataclass(frozen=True)
class GainRequest:
    """What to identify from what.

    Attributes:
        unloaded: captures or logs without the payload.
        loaded: with it.
        payload: the payload's file.
        robot: name or path; the first capture's own description where None.
        columns: a column map for logs; the robot's where None.
    """

    unloaded: tuple[Path, ...]
    loaded: tuple[Path, ...]
    payload: Path
    robot: str | None = None
    columns: Path | None = None


@dataclass(frozen=True)
class GainResult:
    """The gains, and what was said of the recordings on the way."""

    robot: Robot
    fit: GainFit
    warnings: tuple[str, ...]


def run_gain(request: GainRequest, steps: Steps) -> GainResult:
    """Read and identify.

    Raises:
        CaptureError, RobotFileError, PayloadFileError, PayloadError, IdentificationError: one line each.
    """
    payload = read_payload(request.payload)
    with described(request.robot, request.unloaded[0]) as (robot, first):
        payload.parameters(robot)  # refused here, before anything long is computed
        with steps.step("Read recordings"):
            parts = [
                loaded_capture(first, robot)
                if first is not None and path == first.path
                else load_recording(path, robot, request.columns)
                for path in (*request.unloaded, *request.loaded)
            ]
        count = len(request.unloaded)
        without, with_it = (
            tuple(recording for part in kind for recording in part.recordings)
            for kind in (parts[:count], parts[count:])
        )
        robot = robot.model_copy(update={"identification": parts[0].settings})
        warnings = [sentence for part in parts for sentence in part.warnings]
        warnings += check_recordings(robot, (*without, *with_it))
        with steps.step("Identify gains"):
            fit = identify_drive_gains(base_parameters(RegressorModel.of(robot)), without, with_it, payload)
    return GainResult(robot, fit, tuple(warnings))


def gains_json(result: GainResult, request: GainRequest) -> dict[str, Any]:
    """The JSON object; docs/reference/json.md documents it."""
    fit = result.fit
    return {
        "armhil": version("armhil"),
        "robot": result.robot.name,
        "unloaded": [str(path) for path in request.unloaded],
        "loaded": [str(path) for path in request.loaded],
        "gains": [_gain(gain) for gain in fit.gains],
        "covariance": fit.covariance.tolist(),
        "covariance_kind": fit.covariance_kind,
        "rows": fit.rows,
        "relative_error_percent": fit.relative_error_percent,
        "iterations": fit.iterations,
        "warnings": list(result.warnings),
    }


def _gain(gain: DriveGain) -> dict[str, Any]:
    return {
        "drive": gain.drive,
        "value": gain.value,
        "sigma": gain.sigma,
        "described": gain.described,
        "described_uncertainty": gain.described_uncertainty,
        "change": gain.change,
        "payload_share": gain.payload_share,
        "seen": bool(gain.seen),
        "sentence": gain.sentence(),
    }


def print_gains(console: Console, result: GainResult) -> None:
    """A table, and below it what to write into robot.toml."""
    table = Table(title="Drive gains", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("drive", "described", "identified", "σ", "% σ"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    for gain in result.fit.gains:
        value, sigma, described_text = with_sigma(gain.value, gain.sigma, gain.described)
        share = percent(100.0 * gain.relative_sigma)
        table.add_row(str(gain.drive), described_text, value, sigma, share, gain.sentence())
    console.print(table)
    error = percent(result.fit.relative_error_percent)
    console.print(f"{result.fit.rows} rows, relative error of the control signals {error}.", highlight=False)
    seen = [gain for gain in result.fit.gains if gain.seen]
    if seen:
        console.print("For robot.toml:", highlight=False)
    for gain in seen:
        digits = max(2, 2 - int(np.floor(np.log10(gain.relative_sigma))))
        console.print(
            f"  \\[\\[drive]] {gain.drive}: gain = {gain.value:.{digits}g},"
            f" gain_relative_uncertainty = {gain.relative_sigma:.2g}",
            highlight=False,
        )
    for warning in result.warnings:
        console.print(f"[yellow]warning:[/] {warning}", highlight=False)
