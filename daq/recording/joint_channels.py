"""Channels that a log has beside positions and control signals, as one message of each cycle, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from daq.recording import messages
from daq.recording.mcap_file import Rows
from daq.recording.mcap_scan import Scan
from daq.recording.topics import BESIDE_TOPIC, NUMBERS
from robots.arrays import FloatArray, IntArray

KINDS = {
    "second": "second_position",
    "outside": "torque_from_outside",
    "added": "added_signal",
    "temperature": "temperature",
}
"""Channels of a recording → fields of the message."""


def channel_rows(joints: Sequence[str], stamps: IntArray, channels: Mapping[str, FloatArray]) -> Rows:
    """Messages of N cycles, N × size.

    Args:
        joints: names in their order.
        stamps: (N,) ns since the epoch.
        channels: of ``KINDS``, N × joints each; those that are absent stay empty.
    """
    layout = messages.joint_channels_layout(joints, list(KINDS.values()), [KINDS[kind] for kind in channels])
    return layout.rows(stamps, {KINDS[kind]: values for kind, values in channels.items()})


def channels_of(
    found: Scan, joints: Sequence[str], kinds: Sequence[str], cycles: IntArray
) -> tuple[dict[str, FloatArray], int]:
    """The channels at each cycle, N × joints, NaN where their message is lost; and bytes that do not decode.

    Args:
        found: a scanned capture.
        joints: names in their order.
        kinds: the channels that were recorded; others are not known to this version.
        cycles: (N,) of the samples.
    """
    kinds = [kind for kind in KINDS if kind in kinds]
    channels = {kind: np.full((len(cycles), len(joints)), np.nan) for kind in kinds}
    if not kinds:
        return channels, 0
    layout = messages.joint_channels_layout(joints, list(KINDS.values()), [KINDS[kind] for kind in kinds])
    numbers, undecodable = cycles & 0xFFFFFFFF, 0
    order = np.argsort(numbers, kind="stable")
    for run in found.runs.get(NUMBERS[BESIDE_TOPIC], ()):
        rows = layout.decode(run.rows)
        if rows is None:
            undecodable += run.rows.size
            continue
        place = np.searchsorted(numbers[order], run.sequence)
        at = order[np.minimum(place, len(order) - 1)] if len(order) else place
        here = numbers[at] == run.sequence if len(order) else np.zeros(len(place), dtype=np.bool_)
        for kind, values in channels.items():
            values[at[here]] = rows[KINDS[kind]][here]
    return channels, undecodable
