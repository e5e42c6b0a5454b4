"""What is kept with the samples of a run, and what a report says of it."""

from __future__ import annotations

import json
from importlib.metadata import version

import numpy as np

from daq.catalogue.who import user
from daq.files.trajectory_file import trajectory_text
from daq.recording.capture import DESCRIPTION, RUN, TRAJECTORY, Capture, Facts
from drivers import DriveReport, StreamResult
from robots import Robot
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
        "cycles": str(result.cycles),
        "missed_cycles": str(result.missed_cycles),
        "late_cycles": str(result.late_cycles),
        "incomplete_cycles": str(result.incomplete_cycles),
        "incomplete_before": str(result.incomplete_before),
        "overflows": str(result.overflows),
        "ending": result.ending,
        "notes": "; ".join(result.notes),
    }


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
            f" condition number {float(capture.trajectory.get('condition', 'nan')):.0f}"
        ),
        "Seed of the simulated arm": capture.run.get("seed", "none"),
        "armhil": json.loads(capture.run.get("versions", "{}")).get("armhil", "unknown"),
    }
