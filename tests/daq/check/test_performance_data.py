"""Performance data as Nagios and its kin read it, checked by the grammar of their guidelines."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.check.check_json import performance_data

GRAMMAR = re.compile(
    r"'(?P<label>[^'=]+)'=(?P<value>-?[0-9.]+(?:e[+-]?[0-9]+)?)(?P<unit>s|us|ms|%|[KMGT]?B|c)?"
    r"(?:;(?P<warn>[-0-9.e:~@]*))?(?:;(?P<crit>[-0-9.e:~@]*))?(?:;(?P<min>[-0-9.e]*))?(?:;(?P<max>[-0-9.e]*))?"
)


def result(tolerance: float, p_value: float | None = 1.3e-5) -> Any:
    between = None if p_value is None else SimpleNamespace(p_value=p_value)
    course = SimpleNamespace(amount=np.array([0.0, 4.0]), low=-1.0, high=3.0)
    compared = SimpleNamespace(
        torque_change=np.array([0.012, 1.5e-7]),
        torque_rms=np.array([2.0, 0.5]),
        between_runs=between,
        course=course,
    )
    return SimpleNamespace(comparison=compared, tolerance=tolerance)


def test_each_joint_has_the_tolerance_as_its_limit() -> None:
    found = [GRAMMAR.fullmatch(part) for part in performance_data(result(0.05)).split(" ")]
    assert all(found) and len(found) == 4
    first, second, used, p_value = (one.groupdict() for one in found if one is not None)
    assert (first["label"], first["crit"], first["warn"], first["min"]) == ("torque_change_1", "0.1", "", "0")
    assert float(second["value"]) == 1.5e-7 and second["crit"] == "0.025"
    assert (used["label"], used["warn"], used["crit"], used["min"]) == ("forgiven_used", "1", "", "0")
    assert float(used["value"]) == 1.5, "three of the two that were fine"
    assert (p_value["label"], p_value["value"], p_value["max"]) == ("p_value", "1.3e-05", "1")
    assert "'torque_change_1'=0.012;;0.2;0" in performance_data(result(0.1, None))


@pytest.mark.parametrize("course", [None, SimpleNamespace(amount=np.zeros(1), low=0.0, high=0.0)])
def test_a_night_without_a_band_has_no_limit_of_a_warning(course: Any) -> None:
    found = result(0.05)
    found.comparison.course = course
    assert "forgiven_used" not in performance_data(found)


def test_nothing_was_compared() -> None:
    assert performance_data(SimpleNamespace(comparison=None)) == ""  # type: ignore[arg-type]
