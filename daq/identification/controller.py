"""``armhil controller``: the drives' control law from recordings."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.files.toml_text import toml_text
from daq.importing.captures import loaded_capture
from daq.importing.load import load_recording
from daq.recording.described_arm import described
from daq.text.numbers import significant, with_sigma
from daq.text.progress import Steps
from ident.controllers import IdentifiedController, identify_controller
from ident.preparation.checks import check_recordings
from robots import Robot

_TO_CHANGE = (
    "type",
    "position_gain",
    "velocity_gain",
    "integral_gain",
    "velocity_feed_forward",
    "acceleration_feed_forward",
    "velocity_difference_samples",
    "velocity_cutoff_hz",
    "delay_samples",
    "interpolation",
)


@dataclass(frozen=True)
class ControllerResult:
    """The control law, and what was said of the recordings on the way."""

    robot: Robot
    found: IdentifiedController
    warnings: tuple[str, ...]


def run_controller(
    paths: tuple[Path, ...], robot_source: str | None, columns: Path | None, steps: Steps
) -> ControllerResult:
    """Read and identify; the longest recording is used.

    Raises:
        CaptureError, RobotFileError, IdentificationError: one line each.
    """
    with described(robot_source, paths[0]) as (robot, first):
        robot.require_controller("identifying the law (its sample_time and saturation)")
        with steps.step("Read recordings"):
            parts = [
                loaded_capture(first, robot)
                if first is not None and path == first.path
                else load_recording(path, robot, columns)
                for path in paths
            ]
        recordings = tuple(recording for part in parts for recording in part.recordings)
        warnings = [sentence for part in parts for sentence in part.warnings]
        warnings += check_recordings(robot, recordings)
        with steps.step("Identify the control law"):
            found = identify_controller(robot, recordings)
    return ControllerResult(robot, found, tuple(warnings))


def controller_json(result: ControllerResult, captures: list[str]) -> dict[str, Any]:
    """The JSON object; docs/reference/json.md documents it."""
    found = result.found
    return {
        "armhil": version("armhil"),
        "robot": result.robot.name,
        "captures": captures,
        "law": found.form.words(),
        "timing": found.timing.words(),
        "trusted": found.trusted,
        "reason": found.reason or None,
        "drives": [
            {
                "drive": drive.drive,
                "explained": drive.explained,
                "gains": [{"key": g.key, "value": g.value, "sigma": g.sigma} for g in drive.gains],
            }
            for drive in found.drives
        ],
        "controller": _changed(found),
        "notes": list(found.notes),
        "warnings": list(result.warnings),
    }


def _changed(found: IdentifiedController) -> dict[str, Any] | None:
    """Keys of ``[controller]`` that the data say something of; the others stay as they are described."""
    if found.controller is None:
        return None
    whole = found.controller.model_dump(mode="json")
    return {key: _rounded(whole[key]) for key in _TO_CHANGE}


def _rounded(value: Any) -> Any:
    """Numbers with six digits: more than any recording shows."""
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def print_controller(console: Console, result: ControllerResult) -> None:
    """Gains with σ, what they explain, and the lines for robot.toml."""
    found = result.found
    table = Table(title="Drive loops", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    table.add_column("drive", justify="right")
    table.add_column("gain", no_wrap=True)
    for heading in ("value", "σ", "explained"):
        table.add_column(heading, justify="right", no_wrap=True)
    for drive in found.drives:
        for place, gain in enumerate(drive.gains):
            value, sigma = with_sigma(gain.value, gain.sigma)
            number, share = str(drive.drive), f"{significant(100.0 * drive.explained, 5)} %"
            table.add_row(
                *((number,) if place == 0 else ("",)), gain.key, value, sigma, *_first(place, share)
            )
    console.print(table)
    console.print(f"Law: {found.form.words()}; {found.timing.words()}.", highlight=False)
    for note in (*found.notes, *result.warnings):
        console.print(f"note: {note}.", highlight=False)
    if not found.trusted:
        console.print(f"[bold red]DO NOT SIMULATE WITH IT[/]: {found.reason}.", highlight=False)
        return
    console.print("\nFor robot.toml:", highlight=False)
    console.print(toml_text({"controller": _changed(found)}), markup=False, highlight=False, soft_wrap=True)


def _first(place: int, text: str) -> tuple[str, ...]:
    """Said once for all gains of a drive."""
    return (text,) if place == 0 else ("",)
