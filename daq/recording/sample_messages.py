"""Samples of a stream as the three messages of each cycle, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.recording import messages
from daq.recording.mcap_file import Rows
from daq.recording.mcap_scan import MessageRun, Scan
from daq.recording.topics import MEASURED_TOPIC, NUMBERS, REFERENCE_TOPIC, STATUS_TOPIC
from drivers.frames.samples import Samples
from robots import Robot
from robots.arrays import IntArray


class SampleMessages:
    """Encodes samples of one arm.

    Args:
        robot: its joints give the names, its gains the torques.
        reference: whether there is a reference.
    """

    def __init__(self, robot: Robot, *, reference: bool = True) -> None:
        # τ = Tᵀ (g_τ ∘ v_τ) (eq. 5) as one matrix: the description derives its arrays at each call.
        self._torque = robot.gains[:, np.newaxis] * robot.transmission_matrix
        names = [joint.name for joint in robot.joint]
        self._reference = messages.joint_state_layout(names) if reference else None
        self._velocity = any(drive.velocity is not None for drive in robot.drive)
        self._measured = messages.joint_state_layout(names, velocity=self._velocity, effort=True)
        self._status = messages.cycle_status_layout(names)

    def rows(self, samples: Samples, stamps: IntArray) -> dict[str, Rows]:
        """Messages by topic, N × size each.

        Args:
            samples: N cycles.
            stamps: (N,) ns since the epoch.
        """
        error = samples.reference - samples.position
        torque = samples.control_signal @ self._torque
        measured = {"position": samples.position, "effort": torque}
        if self._velocity:
            measured["velocity"] = samples.velocity
        status: dict[str, NDArray[Any]] = {
            "cycle": samples.cycle,
            "lateness": samples.lateness,
            "control_signal": samples.control_signal,
            "statusword": samples.statusword,
            "complete": samples.complete,
            "following_error": error,
        }
        found = {
            MEASURED_TOPIC: self._measured.rows(stamps, measured),
            STATUS_TOPIC: self._status.rows(stamps, status),
        }
        if self._reference is not None:
            found[REFERENCE_TOPIC] = self._reference.rows(stamps, {"position": samples.reference})
        return found


def samples_of(
    found: Scan, joints: Sequence[str], period: float, *, reference: bool = True
) -> tuple[Samples, int]:
    """The cycles of which all messages are there, and how many bytes could not be decoded.

    Args:
        found: a scanned capture.
        joints: names in their order.
        period: of SYNC, s.
        reference: whether the capture has references; NaN where not.
    """
    state = messages.joint_state_layout(joints)
    layouts = {
        MEASURED_TOPIC: tuple(
            messages.joint_state_layout(joints, velocity=velocity, effort=True) for velocity in (True, False)
        ),
        STATUS_TOPIC: (
            messages.cycle_status_layout(joints),
            messages.cycle_status_layout(joints, following_error=False),
        ),
    }
    if reference:
        layouts[REFERENCE_TOPIC] = (state,)
    columns: dict[str, dict[str, NDArray[np.generic]]] = {}
    sequences: dict[str, IntArray] = {}
    undecodable = 0
    for topic, forms in layouts.items():
        runs = found.runs.get(NUMBERS[topic], [])
        sequences[topic], columns[topic], bad = _decoded(runs, forms, _FIELDS[topic])
        undecodable += bad
    return _aligned(columns, sequences, period, len(joints)), undecodable


_FIELDS = {
    REFERENCE_TOPIC: ("position",),
    MEASURED_TOPIC: ("position", "velocity"),
    STATUS_TOPIC: ("cycle", "lateness", "control_signal", "statusword", "complete"),
}


def _decoded(
    runs: Sequence[MessageRun], forms: Sequence[messages.Layout], names: Sequence[str]
) -> tuple[IntArray, dict[str, NDArray[np.generic]], int]:
    """Sequence numbers and fields of all messages that fit one of the forms; bytes of those that do not."""
    sequences: list[NDArray[np.int64]] = []
    parts: dict[str, list[NDArray[np.generic]]] = {name: [] for name in names}
    undecodable = 0
    empty = forms[0].decode(np.zeros((0, len(forms[0].template)), dtype=np.uint8))
    for run in runs:
        found = next((v for v in (form.decode(run.rows) for form in forms) if v is not None), None)
        if found is None:
            undecodable += run.rows.size
            continue
        sequences.append(run.sequence.astype(np.int64))
        for name in names:
            has = name in (found.dtype.names or ())
            # Only the velocity may be missing: where no PDO carried it.
            parts[name].append(found[name].copy() if has else np.full_like(found["position"], np.nan))
    assert empty is not None
    columns = {name: np.concatenate(values or [empty[name]]) for name, values in parts.items()}
    return np.concatenate(sequences or [np.zeros(0, dtype=np.int64)]), columns, undecodable


def _aligned(
    columns: Mapping[str, Mapping[str, NDArray[np.generic]]],
    sequences: Mapping[str, IntArray],
    period: float,
    joints: int,
) -> Samples:
    common = sequences[STATUS_TOPIC]
    for sequence in sequences.values():
        common = np.intersect1d(common, sequence)
    picked = {
        topic: {name: np.asarray(values)[_rows_of(sequences[topic], common)] for name, values in part.items()}
        for topic, part in columns.items()
    }
    status = picked[STATUS_TOPIC]
    cycle = status["cycle"].astype(np.int64)
    missing = np.full((len(common), joints), np.nan)
    return Samples(
        cycle=cycle,
        time=np.asarray(cycle * period, dtype=np.float64),
        reference=picked.get(REFERENCE_TOPIC, {}).get("position", missing),
        position=picked[MEASURED_TOPIC]["position"],
        control_signal=status["control_signal"],
        statusword=status["statusword"],
        complete=status["complete"],
        lateness=status["lateness"],
        velocity=picked[MEASURED_TOPIC]["velocity"],
    )


def _rows_of(sequence: IntArray, wanted: IntArray) -> NDArray[np.intp]:
    order = np.argsort(sequence, kind="stable")
    return order[np.searchsorted(sequence[order], wanted)]
