"""What draws an arm: its description once, and the transforms of its joints over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from daq.recording.cdr import CdrEncoder
from daq.recording.mcap_file import Rows
from daq.recording.topics import DESCRIPTION_TOPIC, STATIC_TOPIC, TF_TOPIC
from drivers.frames.samples import Samples
from robots import Robot
from robots.arrays import FloatArray, IntArray
from robots.urdf import FIXED, UrdfJoint, read_urdf
from robots.urdf_bodies import transform

RATE = 20.0
"""Hz of the transforms in a capture: each batch of samples then brings one."""

Batch = tuple[dict[str, Rows], NDArray[np.uint32], IntArray]
"""Messages by topic, their sequence numbers and their stamps."""


class LinkMessages:
    """Of one recording: URDF and fixed joints with the first samples, then the joints that move."""

    def __init__(self, robot: Robot) -> None:
        joints = read_urdf(robot.urdf_path).joints
        self._text = robot.urdf_path.read_text(encoding="utf-8")
        self._fixed = [joint for joint in joints if joint.kind == FIXED]
        self._moving = [joint for joint in joints if joint.kind != FIXED]
        self._axes = {joint.name: axis for axis, joint in enumerate(robot.joint)}
        self._every = max(1, round(1.0 / (RATE * robot.bus.cycle_time)))
        self._begun = False

    def batches(self, samples: Samples, stamps: IntArray) -> Iterator[Batch]:
        """What to write beside samples (N cycles with stamps, ns)."""
        if not self._begun:
            self._begun = True
            yield self._once(stamps[:1]), np.zeros(1, dtype=np.uint32), stamps[:1]
        position = np.asarray(samples.position)
        shown = (samples.cycle % self._every == 0) & np.isfinite(position).all(axis=1)
        if shown.any():
            positions = {name: position[shown, axis] for name, axis in self._axes.items()}
            rows = transform_rows(self._moving, stamps[shown], positions)
            yield {TF_TOPIC: rows}, (samples.cycle[shown] & 0xFFFFFFFF).astype(np.uint32), stamps[shown]

    def _once(self, stamp: IntArray) -> dict[str, Rows]:
        text = CdrEncoder()
        text.string(self._text)
        found = {DESCRIPTION_TOPIC: np.frombuffer(text.finish(), dtype=np.uint8)[np.newaxis]}
        return found | ({STATIC_TOPIC: transform_rows(self._fixed, stamp, {})} if self._fixed else {})


def transform_rows(joints: list[UrdfJoint], stamps: IntArray, positions: Mapping[str, FloatArray]) -> Rows:
    """One TFMessage per stamp with all the joints, N × size; positions (samples,) of those that move."""
    encoder, names, formats, offsets = CdrEncoder(), [], [], []
    encoder.primitive("uint32", len(joints))

    def number(name: str, kind: str, form: str) -> None:
        encoder.primitive(kind, 0)
        names.append(name)
        formats.append(form)
        offsets.append(encoder.offset)

    for joint in joints:
        number(f"{joint.name} sec", "int32", "<i4")
        number(f"{joint.name} nanosec", "uint32", "<u4")
        encoder.string(joint.parent)
        encoder.string(joint.child)
        for part in "xyzijkw":
            number(f"{joint.name} {part}", "float64", "<f8")
    template = np.frombuffer(encoder.finish(), dtype=np.uint8)
    rows = np.tile(template, (len(stamps), 1))
    record = {"names": names, "formats": formats, "offsets": offsets, "itemsize": template.size}
    cells = rows.view(np.dtype(record))[:, 0]  # type: ignore[call-overload]
    for joint in joints:
        cells[f"{joint.name} sec"], cells[f"{joint.name} nanosec"] = np.divmod(stamps, 1_000_000_000)
        place, turn = _pose(joint, positions.get(joint.name, np.zeros(len(stamps))))
        for part, values in zip("xyzijkw", (*place.T, *turn.T), strict=True):
            cells[f"{joint.name} {part}"] = values
    return rows


def _pose(joint: UrdfJoint, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Translation (samples, 3) and quaternion x y z w (samples, 4) of the child in the parent."""
    pose, axis = transform(joint.pose), np.array(joint.axis)
    place = np.tile(pose[:3, 3], (len(position), 1))
    if joint.kind == "prismatic":
        place += np.outer(position, pose[:3, :3] @ axis)
        return place, np.tile(_quaternion(pose[:3, :3]), (len(position), 1))
    half = np.zeros_like(position) if joint.kind == FIXED else position / 2
    vector, scalar = np.outer(np.sin(half), axis), np.cos(half)
    *fixed, w = _quaternion(pose[:3, :3])
    turned = scalar[:, np.newaxis] * np.array(fixed) + w * vector + np.cross(np.array(fixed), vector)
    return place, np.column_stack([turned, w * scalar - vector @ np.array(fixed)])


def _quaternion(rotation: FloatArray) -> NDArray[np.float64]:
    """x y z w of a rotation (3, 3)."""
    import pinocchio

    return np.asarray(pinocchio.Quaternion(rotation).coeffs())
