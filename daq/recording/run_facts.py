"""What is kept with the samples of a run, and what a report says of it."""

from __future__ import annotations

import json
from importlib.metadata import version

import numpy as np

from daq.recording.capture import DESCRIPTION, MESHES, RUN, TRAJECTORY, UNKNOWN, Capture, Facts
from daq.recording.trajectory_file import trajectory_text
from daq.recording.who import user
from drivers import DriveReport, StreamResult
from robots import Robot
from robots.identity import mesh_checksums
from trajectories import Trajectory
from trajectories.motions.sampled import SampledMotion


def run_facts(
    robot: Robot, run: Facts, trajectory: Trajectory, drives: tuple[DriveReport, ...]
) -> dict[str, Facts]:
    """The metadata of a capture: description, run, trajectory.

    Args:
        robot: the arm.
        run: what only the caller knows: channel, seed, kind; ``note`` where it is given.
        trajectory: what was streamed.
        drives: what the set-up found.
    """
    identities = [
        {
            "joint": d.joint,
            "node": d.node_id,
            "vendor": d.vendor,
            "product": d.product,
            "revision": d.revision,
            "serial": d.serial,
        }
        for d in drives
    ]
    gains = [
        {"joint": joint.name, "gain": drive.gain, "relative_uncertainty": drive.gain_relative_uncertainty}
        for joint, drive in zip(robot.joint, robot.drive, strict=True)
    ]
    sampled = isinstance(trajectory.motion, SampledMotion)
    packages = ("armhil", "mcap", "numpy", "scipy", "pin", "ruckig", "python-can", "canopen")
    return {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            MESHES: json.dumps(mesh_checksums(robot)),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: {
            "period": repr(robot.bus.cycle_time),
            "operator": user(),
            **run,
            "drives": json.dumps(identities),
            "gains": json.dumps(gains),
            "versions": json.dumps({name: version(name) for name in packages}),
        },
        TRAJECTORY: {
            "family": trajectory.family,
            "seed": str(trajectory.seed),
            "score": repr(trajectory.score),
            "condition": repr(trajectory.detail.condition),
            "duration": repr(trajectory.duration),
            # A motion that is samples is in the record itself.
            **({} if sampled else {"file": trajectory_text(trajectory, robot)}),
        },
    }


def outcome_facts(result: StreamResult) -> Facts:
    """How a stream ended, as a metadata record."""
    return {
        "outcome": result.outcome,
        "reason": result.reason,
        "cycles": _count(result.cycles),
        "missed_cycles": _count(result.missed_cycles),
        "late_cycles": _count(result.late_cycles),
        "incomplete_cycles": _count(result.incomplete_cycles),
        "incomplete_before": _count(result.incomplete_before),
        "overflows": _count(result.overflows),
        "pauses": ", ".join(map(str, result.pauses)),
        "doubtful": "; ".join(result.doubtful),
        "ending": result.ending,
        "notes": "; ".join(result.notes),
    }


def _count(number: int | None) -> str:
    return UNKNOWN if number is None else str(number)


def _rounded(text: str) -> str:
    """A number of a record without decimals; what is none is unknown."""
    try:
        return f"{float(text):.0f}"
    except ValueError:
        return UNKNOWN


def _version(text: str) -> str:
    """The version of armhil that a record of versions names."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return UNKNOWN
    return str(found.get("armhil", UNKNOWN)) if isinstance(found, dict) else UNKNOWN


def report_facts(capture: Capture) -> dict[str, str]:
    """What the report says of how a capture was made, label → text."""
    outcome = capture.outcome or {}
    late = 1e3 * np.percentile(np.abs(capture.samples.lateness), 99)
    return {
        "Capture": f"{capture.path.name}, SHA-256 {capture.sha256[:16]}…",
        "Bus": capture.run.get("channel", "unknown"),
        "SYNC period": f"{1e3 * capture.period:g} ms",
        "Cycles": f"{len(capture.samples.cycle)} ({len(capture.samples.cycle) * capture.period:.1f} s)",
        "Missed and incomplete cycles": (
            f"{outcome.get('missed_cycles', '?')} and {outcome.get('incomplete_cycles', '?')}"
        ),
        "Lateness of SYNC, 99 %": f"{late:.2f} ms",
        "Trajectory": (
            f"{capture.trajectory.get('family', 'unknown')}, seed {capture.trajectory.get('seed', '?')},"
            f" condition number {_rounded(capture.trajectory.get('condition', 'nan'))}"
        ),
        "Seed of the simulated arm": capture.run.get("seed", "none"),
        "armhil": _version(capture.run.get("versions", "{}")),
    }
