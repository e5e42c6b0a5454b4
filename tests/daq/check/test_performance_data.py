"""Performance data as Nagios and its kin read it, checked by the grammar of their guidelines."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np

from daq.check.check_json import performance_data

GRAMMAR = re.compile(
    r"'(?P<label>[^'=]+)'=(?P<value>-?[0-9.]+(?:e[+-]?[0-9]+)?)(?P<unit>s|us|ms|%|[KMGT]?B|c)?"
    r"(?:;(?P<warn>[-0-9.e:~@]*))?(?:;(?P<crit>[-0-9.e:~@]*))?(?:;(?P<min>[-0-9.e]*))?(?:;(?P<max>[-0-9.e]*))?"
)


def result(tolerance: float, p_value: float | None = 1.3e-5) -> Any:
    between = None if p_value is None else SimpleNamespace(p_value=p_value)
    compared = SimpleNamespace(
        torque_change=np.array([0.012, 1.5e-7]), torque_rms=np.array([2.0, 0.5]), between_runs=between
    )
    return SimpleNamespace(comparison=compared, tolerance=tolerance)


def test_each_joint_has_the_tolerance_as_its_limit() -> None:
    found = [GRAMMAR.fullmatch(part) for part in performance_data(result(0.05)).split(" ")]
    assert all(found) and len(found) == 3
    first, second, p_value = (one.groupdict() for one in found if one is not None)
    assert (first["label"], first["crit"], first["warn"], first["min"]) == ("torque_change_1", "0.1", "", "0")
    assert float(second["value"]) == 1.5e-7 and second["crit"] == "0.025"
    assert (p_value["label"], p_value["value"], p_value["max"]) == ("p_value", "1.3e-05", "1")
    assert "'torque_change_1'=0.012;;0.2;0" in performance_data(result(0.1, None))


def test_nothing_was_compared() -> None:
    assert performance_data(SimpleNamespace(comparison=None)) == ""  # type: ignore[arg-type]
