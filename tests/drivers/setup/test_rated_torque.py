"""The torque of one count beside the drive's rated torque: what a gear and a motor can be, and no more."""

from __future__ import annotations

import pytest

import robots
from drivers.setup.limits import compare_limits
from drivers.setup.rated_torque import compare_torque, doubtful_gain
from robots import Robot
from tests.drivers.setup.test_limits import settings


def described(robot: Robot, factor: float, index: int = 0x6077) -> Robot:
    """The gain of drive 3 times a factor."""
    drives = list(robot.drive)
    signal = drives[2].control_signal.model_copy(update={"index": index})
    drives[2] = drives[2].model_copy(update={"gain": drives[2].gain * factor, "control_signal": signal})
    return robot.model_copy(update={"drive": tuple(drives)})


@pytest.mark.parametrize("unit", [1, 1000])
@pytest.mark.parametrize(
    ("factor", "doubted"),
    [(0.1, True), (0.38, True), (0.42, False), (1.0, False), (1.17, False), (1.23, True), (2.5, True)],
)
def test_a_gain_is_doubted_where_no_gear_and_no_motor_explain_it(
    tx40: Robot, factor: float, unit: int, doubted: bool
) -> None:
    """6076 in mN·m, as CiA 402-2 has it, and in µN·m."""
    told = settings(tx40, 2)
    told["6076"] = (told["6076"] or 0) * unit
    found = doubtful_gain(described(tx40, factor), 2, told)
    assert (found is not None) == doubted
    if found is not None:
        assert f"{factor:.2g} times the {told['6076']} {'mN·m' if unit == 1 else 'µN·m'}" in found
        findings = compare_limits(described(tx40, factor), 2, told)
        (gain,) = [finding for finding in findings if finding.subject == "6076"]
        assert (gain.severity, gain.text) == ("warning", found)


@pytest.mark.parametrize("index", [0x6074, 0x6078])
def test_demanded_torque_and_current_are_relative_too(tx40: Robot, index: int) -> None:
    assert doubtful_gain(described(tx40, 2.5, index), 2, settings(tx40, 2)) is not None


def test_what_says_nothing_is_not_compared(tx40: Robot) -> None:
    emps = robots.load("emps")
    wrong, told = described(tx40, 2.5), settings(tx40, 2)
    for rated in (None, 0):
        assert doubtful_gain(wrong, 2, told | {"6076": rated}) is None
        (found,) = compare_torque(wrong, 2, told | {"6076": rated})
        assert (found.severity, found.subject) == ("info", "6076")
    assert doubtful_gain(described(tx40, 2.5, 0x2022), 2, told) is None, "a maker's own object"
    assert doubtful_gain(emps, 0, settings(emps, 0) | {"6076": 1}) is None, "N·m or N: nobody knows"


def test_a_limit_of_a_screw_is_a_force() -> None:
    """Per metre a screw with 400 turns makes 2π · 400 N of each N·m."""
    emps = robots.load("emps")
    torque = emps.torque_limits[0] / (400 * 2 * 3.14159265)
    for times, expected in ((1.9, []), (2.1, ["6072"])):
        told = {"6072": 1000, "6076": round(1e3 * times * torque)}
        assert [finding.subject for finding in compare_torque(emps, 0, told)] == expected
