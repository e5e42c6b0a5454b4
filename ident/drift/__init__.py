"""Whether an arm is still what its baseline says: which parameter moved, on which joint, since when."""

from __future__ import annotations

from ident.drift.charts import cusum, run_length, trend_threshold
from ident.drift.common import CommonBase, Relation, common_base, determined_by, in_base_of, in_terms_of
from ident.drift.comparison import compare
from ident.drift.geometry import Geometry, geometry_of
from ident.drift.naming import UNEXPLAINED
from ident.drift.patterns import Pattern, patterns_of
from ident.drift.values import (
    Alarm,
    ChangePoint,
    Comparison,
    Course,
    DriftSettings,
    DriftTest,
    MovedParameter,
    NamedChange,
    Night,
    Usual,
)
from ident.drift.wald import holm, wald_test
from ident.drift.words import change_words

__all__ = [
    "UNEXPLAINED",
    "Alarm",
    "ChangePoint",
    "CommonBase",
    "Comparison",
    "Course",
    "DriftSettings",
    "DriftTest",
    "Geometry",
    "MovedParameter",
    "NamedChange",
    "Night",
    "Pattern",
    "Relation",
    "Usual",
    "change_words",
    "common_base",
    "compare",
    "cusum",
    "determined_by",
    "geometry_of",
    "holm",
    "in_base_of",
    "in_terms_of",
    "patterns_of",
    "run_length",
    "trend_threshold",
    "wald_test",
]
