"""Drive limits beside the description, by severity."""

from __future__ import annotations

import numpy as np
import pytest

from drivers import DriveError
from drivers.session.envelope import check_drive_limits, checked_period_ends
from drivers.setup.limits import compare_limits
from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.parameters import set_parameters
from robots import Robot

KEYS = {
    "605A": (0x605A, 0),
    "605B": (0x605B, 0),
    "605C": (0x605C, 0),
    "605E": (0x605E, 0),
    "6065": (0x6065, 0),
    "6066": (0x6066, 0),
    "6072": (0x6072, 0),
    "6076": (0x6076, 0),
    "607D:01": (0x607D, 1),
    "607D:02": (0x607D, 2),
    "607E": (0x607E, 0),
    "607F": (0x607F, 0),
    "6080": (0x6080, 0),
    "6085": (0x6085, 0),
    "608F:01": (0x608F, 1),
    "608F:02": (0x608F, 2),
    "6091:01": (0x6091, 1),
    "6091:02": (0x6091, 2),
}


def settings(robot: Robot, axis: int, **changed: int | None) -> dict[str, int | None]:
    dictionary = ObjectDictionary(robot.drive[axis].node_id)
    set_parameters(dictionary, robot, axis, 1)
    values: dict[str, int | None] = {name: dictionary.integer(*key) for name, key in KEYS.items()}
    return values | {name.replace("_", ":").removeprefix("x"): value for name, value in changed.items()}


def found(robot: Robot, axis: int = 1, **changed: int | None) -> list[tuple[str, str]]:
    findings = compare_limits(robot, axis, settings(robot, axis, **changed))
    return [(f.severity, f.subject) for f in findings if f.severity != "info"]


@pytest.mark.parametrize("axis", range(6))
def test_a_drive_set_up_from_the_description_fits_it(tx40: Robot, axis: int) -> None:
    assert found(tx40, axis) == []


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"x608F_01": 65536}, ("refusal", "608F")),
        ({"x6091_01": 50}, ("refusal", "6091")),
        ({"x607E": 0x80}, ("warning", "607E")),
        ({"x607D_01": -1000}, ("warning", "607D")),
        ({"x607D_02": 2**31 - 1}, ("warning", "607D")),
        ({"x607D_01": 0, "x607D_02": 0}, ("warning", "607D")),
        ({"x607D_01": None}, ("warning", "607D")),
        ({"x6065": 0xFFFFFFFF}, ("warning", "6065")),
        ({"x6065": None}, ("warning", "6065")),
        ({"x6065": 10**7}, ("warning", "6065")),
        ({"x6066": 5000}, ("warning", "6066")),
        ({"x607F": 1000}, ("warning", "607F")),
        ({"x6080": 100}, ("warning", "6080")),
        ({"x6072": 40000}, ("warning", "6072")),
        ({"x6076": 60}, ("warning", "6076")),
        ({"x605A": 0}, ("warning", "605A")),
        ({"x605E": 0}, ("warning", "605E")),
        ({"x6085": 0}, ("warning", "6085")),
    ],
)
def test_each_difference_is_told_by_its_severity(
    tx40: Robot, changed: dict[str, int | None], expected: tuple[str, str]
) -> None:
    assert found(tx40, **changed) == [expected]


def test_a_gear_outside_of_the_drive_is_no_contradiction(tx40: Robot) -> None:
    assert found(tx40, x6091_01=1) == []


def test_set_points_that_a_drive_would_clip_are_refused(tx40: Robot) -> None:
    class Report:
        def __init__(self, high: int | None) -> None:
            self.settings = {"607D:01": -1000, "607D:02": high}

    reports = [Report(None)] * 5 + [Report(2000)]
    counts = np.zeros((4, 6), dtype=np.int32)
    check_drive_limits(tx40, counts, reports)  # type: ignore[arg-type]
    counts[2, 5] = 2001
    with pytest.raises(DriveError, match=r"drive 6 \(joint_6\) goes from 0 to 2001, its own limits"):
        check_drive_limits(tx40, counts, reports)  # type: ignore[arg-type]


def test_period_ends_are_inside_the_reference() -> None:
    assert checked_period_ends([30, 10, 30], 40) == (10, 30)
    for row in (0, 40, -1):
        with pytest.raises(DriveError, match=f"cannot end at row {row}; allowed: 1 to 39"):
            checked_period_ends([row], 40)
