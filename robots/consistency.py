"""What the tables of a robot.toml must agree on: counts of entries, ranges, what the bus objects can hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from robots.arrays import FloatArray
from robots.controller_description import Controller
from robots.drive_description import INT32_MAX, Drive
from robots.errors import ValueNotAllowed
from robots.identification_description import Identification
from robots.joint_description import Bus, Joint

INT16_MAX = 2**15 - 1
TORQUE_ACTUAL_VALUE = 0x6077
LEAST_COUNTS = 1000
"""At the joint limits; with fewer a drive does not know where its joint is."""
MAX_CONDITION = 1e8
"""Of the transmission: far above any gear train, far below where its inverse loses its digits."""


class Tables(Protocol):
    """What is looked at here of a ``robots.Robot``."""

    joint: tuple[Joint, ...]
    drive: tuple[Drive, ...]
    home: tuple[float, ...]
    transmission: tuple[tuple[float, ...], ...]
    controller: Controller
    bus: Bus
    identification: Identification

    @property
    def has_drives(self) -> bool: ...
    @property
    def lower(self) -> FloatArray: ...
    @property
    def upper(self) -> FloatArray: ...
    @property
    def transmission_matrix(self) -> FloatArray: ...
    @property
    def counts_per_output_unit(self) -> FloatArray: ...


def check_consistency(robot: Tables) -> None:
    """Check what one table alone cannot show.

    Raises:
        ValueNotAllowed: the key that does not fit the others, and what would.
    """
    if robot.has_drives and not robot.controller.is_given:
        raise ValueNotAllowed(("controller",), "is missing", "[controller] beside [[drive]], or neither")
    _one_entry_per_axis(robot)
    _names_and_node_ids_differ(robot)
    _transmission_is_invertible(robot)
    _home_is_within_limits(robot)
    if robot.has_drives:
        _objects_hold_the_values(robot)
        _whole_controller_steps_per_sync(robot)


def _one_entry_per_axis(robot: Tables) -> None:
    n = len(robot.joint)
    lists: dict[tuple[str | int, ...], int] = {
        ("drive",): len(robot.drive),
        ("home",): len(robot.home),
        ("transmission",): len(robot.transmission),
    }
    lists |= {("transmission", i): len(row) for i, row in enumerate(robot.transmission)}
    if robot.controller.is_given:
        lists |= _controller_lists(robot)
    if isinstance(robot.identification.offset, tuple):
        lists[("identification", "offset")] = len(robot.identification.offset)
    for path, length in lists.items():
        if length == 0:
            raise ValueNotAllowed(path, "is missing", f"{n} entries, one per joint")
        if length != n:
            raise ValueNotAllowed(path, f"has {length} of {n} entries", f"{n} entries, one per joint")


def _controller_lists(robot: Tables) -> dict[tuple[str | int, ...], int]:
    """Lengths of the controller's lists by key."""
    lists: dict[tuple[str | int, ...], int] = {}
    for key in ("position_gain", "velocity_gain", "integral_gain", "velocity_feed_forward", "saturation"):
        lists[("controller", key)] = len(getattr(robot.controller, key))
    for key in ("friction_feed_forward", "acceleration_feed_forward"):
        gains = getattr(robot.controller, key)
        if gains is not None:
            lists[("controller", key)] = len(gains)
    return lists


def _names_and_node_ids_differ(robot: Tables) -> None:
    _all_differ("joint", "name", [joint.name for joint in robot.joint])
    if not robot.has_drives:
        return
    _all_differ("drive", "node_id", [drive.node_id for drive in robot.drive])
    master = robot.bus.master_node_id
    if master in {drive.node_id for drive in robot.drive}:
        raise ValueNotAllowed(
            ("bus", "master_node_id"), "is also the node_id of a drive", "a node id that no drive has"
        )


def _transmission_is_invertible(robot: Tables) -> None:
    if np.linalg.cond(robot.transmission_matrix) > MAX_CONDITION:
        raise ValueNotAllowed(("transmission",), "cannot be inverted", "an invertible matrix")


def _home_is_within_limits(robot: Tables) -> None:
    for i, (joint, home) in enumerate(zip(robot.joint, robot.home, strict=True)):
        lower, upper = joint.position
        if not lower <= home <= upper:
            raise ValueNotAllowed(
                ("home", i), f"is outside the position limits of {joint.name}", f"{lower} to {upper}"
            )


def _objects_hold_the_values(robot: Tables) -> None:
    """Positions travel as 32-bit counts, the standard torque object has 16 bits."""
    with np.errstate(all="ignore"):  # figures at the edge of floating point are refused just below
        farthest = np.abs(robot.transmission_matrix) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))
        counts = farthest * np.abs(robot.counts_per_output_unit)
    for i, drive in enumerate(robot.drive):
        if not LEAST_COUNTS <= counts[i] <= INT32_MAX:
            key = "encoder_counts" if drive.counts_per_output_turn is None else "counts_per_output_turn"
            raise ValueNotAllowed(
                ("drive", i, key),
                f"makes {counts[i]:.3g} counts at the joint limits",
                f"{LEAST_COUNTS} to {INT32_MAX} counts there, what a 32-bit position holds",
            )
        signal = drive.control_signal
        reach = INT16_MAX * signal.per_count
        if signal.index == TORQUE_ACTUAL_VALUE and robot.controller.saturation[i] > reach:
            raise ValueNotAllowed(
                ("drive", i, "control_signal", "per_count"),
                f"lets 16 bits reach {reach:.4g} only",
                f"at least {robot.controller.saturation[i] / INT16_MAX:.3g}, for controller.saturation",
            )


def _whole_controller_steps_per_sync(robot: Tables) -> None:
    steps = robot.bus.cycle_time / robot.controller.sample_time
    if not (0.999 <= steps <= INT16_MAX and abs(steps - round(steps)) < 1e-6):
        raise ValueNotAllowed(
            ("controller", "sample_time"),
            f"does not divide the cycle time of {robot.bus.cycle_time} s",
            "bus.cycle_time / 1, 2, 3 …",
        )


def _all_differ(table: str, key: str, values: Sequence[str | int]) -> None:
    for i, value in enumerate(values):
        if value in values[:i]:
            raise ValueNotAllowed(
                (table, i, key),
                f"is already the {key} of {table}[{values.index(value) + 1}]",
                f"a {key} of its own for each {table}",
            )
