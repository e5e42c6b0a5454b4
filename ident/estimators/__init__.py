"""Estimators: rows in, a fit with its covariance out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
    from ident.estimators.choices import ALTERNATIVES, ESTIMATORS, METHODS, RowEstimator
    from ident.estimators.essential import Dropped, EssentialFit, essential_parameters
    from ident.estimators.fit import LinearFit, Stacked, stack
    from ident.estimators.instrumental import instrumental_variables
    from ident.estimators.least_squares import joint_deviations, weighted_least_squares
    from ident.estimators.robust import RobustFit
    from ident.estimators.two_stage import TwoStageFit, two_stage_least_squares

__all__ = [
    "ALTERNATIVES",
    "ESTIMATORS",
    "METHODS",
    "Dropped",
    "EssentialFit",
    "LinearFit",
    "RobustFit",
    "RowEstimator",
    "Stacked",
    "TwoStageFit",
    "essential_parameters",
    "instrumental_variables",
    "joint_deviations",
    "stack",
    "two_stage_least_squares",
    "weighted_least_squares",
]

__getattr__ = exporter(
    __name__,
    {
        "ident.estimators.choices": ("ALTERNATIVES", "ESTIMATORS", "METHODS", "RowEstimator"),
        "ident.estimators.essential": ("Dropped", "EssentialFit", "essential_parameters"),
        "ident.estimators.fit": ("LinearFit", "Stacked", "stack"),
        "ident.estimators.instrumental": ("instrumental_variables",),
        "ident.estimators.least_squares": ("joint_deviations", "weighted_least_squares"),
        "ident.estimators.robust": ("RobustFit",),
        "ident.estimators.two_stage": ("TwoStageFit", "two_stage_least_squares"),
    },
)
